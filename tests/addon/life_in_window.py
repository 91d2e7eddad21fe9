"""Run by test_life_cycle.py in a Blender with a window: what a user does while a picture renders, by keys and operators.

Each step of `story` yields what it waits for; a timer of Blender's asks for it, so that Blender's own loop runs meanwhile. What
was found is printed in lines `STEP NAME VALUE`. Where a render of any engine begins while a panel is being drawn, Blender forbids
Python to write anything from then on; that ends the story with the exit code REFUSED, and another try may go well.
"""

import ctypes
import os
import sys
import tempfile
import time
import traceback
from pathlib import Path

import addon_utils
import bpy

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / folder) for folder in ("blend_scenes", "tests", "tests/addon")]
import blender_scene  # noqa: E402

POLL_SECONDS = 0.01
PATIENCE = 60.0
ESCAPE = 0xFF1B  # X11's name of the key
REFUSED = 3  # exit code
FOLDER = Path(tempfile.mkdtemp())


def story():
    """Cancel, undo, edit, open another file, each while a picture renders; and what the next render shows."""
    make_scene()
    yield from render_to_the_end()
    whole = picture()
    tell("whole", whole.mean())

    for name, photons in (("cancelled", 0), ("cancelled-in-step", 1 << 24)):
        bpy.context.scene.sppm.photons_per_iteration = photons
        started = time.monotonic()
        yield from start_long_render()
        yield lambda: photons == 0 or time.monotonic() > started + 2.0
        pressed = time.monotonic()
        press(ESCAPE)
        yield has_ended
        tell(name, time.monotonic() - pressed)
        if photons == 0:
            tell("kept", picture().mean() / whole.mean())
    bpy.context.scene.sppm.photons_per_iteration = 0

    ball = bpy.data.objects["Ball"]
    with in_window():
        bpy.ops.ed.undo_push(message="before")
        ball.location.x = 0.5
        bpy.ops.ed.undo_push(message="moved")
    yield from start_long_render()
    with in_window():
        bpy.ops.ed.undo()
    yield has_ended
    tell("undone", bpy.data.objects["Ball"].location.x)

    yield from start_long_render()
    for thing in ("Ball", "Floor"):
        bpy.data.objects.remove(bpy.data.objects[thing])
    press(ESCAPE)
    yield has_ended
    tell("removed", len(bpy.data.objects))

    yield from start_long_render()
    with in_window():
        bpy.ops.wm.read_homefile(use_factory_startup=True, load_ui=False, use_empty=True)
    yield has_ended
    make_scene()
    yield from render_to_the_end()
    tell("again", abs(picture() - whole).max())

    yield from start_long_render()
    addon_utils.disable("sppm")
    yield has_ended
    addon_utils.enable("sppm")
    yield from render_to_the_end()
    tell("reloaded", abs(picture() - whole).max())


def make_scene():
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    blender_scene.add_ball_on_floor()
    scene = bpy.context.window_manager.windows[0].scene
    scene.camera, scene.world = bpy.data.objects["Camera"], None
    scene.render.engine = "SPPM"
    scene.render.resolution_x = scene.render.resolution_y = 64
    scene.sppm.iterations = 32
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth = "32"
    bpy.context.preferences.view.render_display_type = "NONE"


def in_window():
    return bpy.context.temp_override(window=bpy.context.window_manager.windows[0])


def start_render():
    with in_window():
        assert bpy.ops.render.render("INVOKE_DEFAULT") == {"RUNNING_MODAL"}


def has_ended():
    return not bpy.app.is_job_running("RENDER")


def render_to_the_end():
    start_render()
    yield has_ended


def start_long_render():
    """Until something is to be seen of it."""
    scene = bpy.context.window_manager.windows[0].scene
    scene.sppm.iterations = 1_000_000
    start_render()
    started = time.monotonic()
    yield lambda: bpy.app.is_job_running("RENDER") and time.monotonic() > started + 1.5
    scene.sppm.iterations = 32


def picture():
    """What the image editor would show."""
    path = FOLDER / "picture.exr"
    bpy.data.images["Render Result"].save_render(str(path), scene=bpy.context.window_manager.windows[0].scene)
    return blender_scene.read(path)[..., :3]


def press(key):
    """By X, so that it arrives as from a keyboard."""
    x11, xtest = ctypes.CDLL("libX11.so.6"), ctypes.CDLL("libXtst.so.6")
    x11.XOpenDisplay.restype = ctypes.c_void_p
    display = ctypes.c_void_p(x11.XOpenDisplay(None))
    code = x11.XKeysymToKeycode(display, ctypes.c_ulong(key))
    xtest.XTestFakeMotionEvent(display, -1, 300, 300, ctypes.c_ulong(0))
    for is_down in (1, 0):
        xtest.XTestFakeKeyEvent(display, code, is_down, ctypes.c_ulong(0))
    x11.XFlush(display)
    x11.XCloseDisplay(display)


def tell(name, value):
    print(f"STEP {name} {value:.6g}", flush=True)


def drive(steps):
    """The timer: asks for what the story waits for. An error would leave the window open for ever."""
    awaited, end = None, 0.0

    def tick():
        nonlocal awaited, end
        try:
            if awaited is None or awaited():
                awaited, end = next(steps), time.monotonic() + PATIENCE
            assert time.monotonic() < end, "waited in vain"
            return POLL_SECONDS
        except StopIteration:
            bpy.ops.wm.quit_blender()
        except BaseException as error:
            traceback.print_exc()
            sys.stderr.flush()
            is_refused = "is not allowed" in str(error) or "can't modify blend data" in str(error)
            os._exit(REFUSED if is_refused else 1)

    return tick


bpy.app.timers.register(drive(story()), first_interval=1.0, persistent=True)
