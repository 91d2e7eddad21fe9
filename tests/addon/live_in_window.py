"""Run by test_live.py in a Blender with a window: does what users do with a viewport in Rendered shading, prints what came of it.

A line is `LIVE name json`. Pictures go to the folder that is given.
"""

import json
import sys
import threading
import time
import traceback
from pathlib import Path

import addon_utils
import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "blend_scenes"))
import make_scenes

FOLDER = Path(sys.argv[-1])
SECONDS = 60  # until it gives up
ITERATIONS = 16

# ---------------------------------------------------------------- what there is


def window():
    return bpy.context.window_manager.windows[0]


def area():
    return next(area for area in window().screen.areas if area.type == "VIEW_3D")


def region():
    return next(region for region in area().regions if region.type == "WINDOW")


def space():
    return area().spaces[0]


def override():
    return bpy.context.temp_override(window=window(), area=area(), region=region())


def views():
    """The add-on's own objects, of which there is one a viewport."""
    from sppm import live_view

    return list(live_view._views)


def drawn():
    """The picture that is on the screen, or None."""
    return next((view.drawn for view in views()), None)


def threads():
    return sum(thread.name == "sppm live" for thread in threading.enumerate())


def ball():
    """The ball on the screen, as InstanceDesc."""
    return next(item for item in drawn().job.scene.instances if item.name == "Ball")


def ball_x():
    return ball().transform[0, 3]


def ball_triangles():
    return len(drawn().job.scene.meshes[ball().mesh - 1].indices)


def tell(name, **facts):
    print(f"LIVE {name} {json.dumps(facts)}", flush=True)


# ---------------------------------------------------------------- waiting; each is a generator, for Blender must go on meanwhile


def until(condition):
    limit = time.monotonic() + SECONDS
    while not condition():
        if time.monotonic() > limit:
            raise RuntimeError("it never came")
        yield


def until_resting(value):
    """Until it has stayed the same for a second."""
    old, since = value(), time.monotonic()
    while time.monotonic() - since < 1.0:
        yield
        if value() != old:
            old, since = value(), time.monotonic()


def until_drawn(iteration=1):
    yield from until(lambda: drawn() and not drawn().is_reduced and drawn().iteration >= iteration)


def restart(name, change, **facts):
    """Tells how long after a change the first picture that shows it is drawn, and what was read again for it."""
    before = drawn().job
    read = Read()
    begin = time.monotonic()
    change()
    yield from until(lambda: drawn() and drawn().job is not before)
    seconds, first = time.monotonic() - begin, drawn()
    tell(name, seconds=seconds, read=sorted(read.names), size=first.pixels.shape[:2], reduced=first.is_reduced,
         **{key: fact() for key, fact in facts.items()})
    read.end()


class Read:
    """Names of the meshes and materials that are read while it is there."""

    def __init__(self):
        from sppm import export_cache, export_scene

        self.names, self._wrapped = [], []
        self._wrap(export_scene, "export_mesh", 0)
        self._wrap(export_cache.MaterialExporter, "export", 1)

    def _wrap(self, owner, name, position):
        original = getattr(owner, name)

        def wrapper(*arguments):
            self.names.append(arguments[position].name)
            return original(*arguments)

        self._wrapped.append((owner, name, original))
        setattr(owner, name, wrapper)

    def end(self):
        for owner, name, original in self._wrapped:
            setattr(owner, name, original)


# ---------------------------------------------------------------- steps


def prepare():
    """A ball of glass and a box on a floor under a small lamp; a bare viewport that looks through the camera."""
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    scene = bpy.context.scene
    scene.render.engine, scene.view_settings.view_transform = "SPPM", "Standard"
    scene.render.resolution_x, scene.render.resolution_y = 160, 120
    scene.sppm.viewport_iterations, scene.sppm.iterations = ITERATIONS, ITERATIONS
    make_scenes.add_floor(6.0, make_scenes.diffuse("Floor", make_scenes.WHITE))
    make_scenes.add_sphere("Ball", (0.35, 0, 0.5), 0.4, make_scenes.glass("Glass"), 64, 32)
    make_scenes.add_box("Box", (-0.6, 0.3, 0.25), (0.5, 0.5, 0.5), make_scenes.diffuse("Red", make_scenes.RED), turn=20)
    make_scenes.add_lamp("POINT", (1.2, -0.4, 2.5), (0, 0, 0), 100.0, shadow_soft_size=0.05)
    make_scenes.add_camera((0, -4, 2.2), (0, 0, 0.3)).show_passepartout = False
    view = space()
    view.show_region_header = view.show_region_toolbar = view.show_region_ui = view.show_gizmo = False
    view.overlay.show_overlays = False
    view.region_3d.view_perspective = "CAMERA"
    view.region_3d.view_camera_zoom = 20.0


def preview():
    """The small pictures of materials that Blender shows in its panels and lists."""
    for name in ("Red", "Glass"):
        material = bpy.data.materials[name]
        begin = time.monotonic()
        material.asset_generate_preview()
        yield from until(lambda: material.preview and any(material.preview.image_pixels[:]))
        seconds = time.monotonic() - begin
        yield from until_resting(lambda: material.preview.image_pixels[:])
        width, height = material.preview.image_size
        np.save(FOLDER / f"{name}.npy", np.array(material.preview.image_pixels_float[:]).reshape(height, width, 4))
        tell(f"preview {name}", seconds=seconds, size=[width, height])
        material.asset_clear()


def show():
    """Rendered shading; the screen, the picture on it and where the camera's frame is."""
    space().shading.type = "RENDERED"
    yield from until_drawn(ITERATIONS)
    yield
    with override():
        bpy.ops.screen.screenshot_area(filepath=str(FOLDER / "shown.png"))
    np.save(FOLDER / "shown.npy", drawn().pixels)
    camera = bpy.context.scene.camera
    corners = [camera.matrix_world @ corner for corner in camera.data.view_frame(scene=bpy.context.scene)]
    frame = np.array([location_3d_to_region_2d(region(), space().region_3d, corner) for corner in corners])
    yield from until(lambda: threads() == 0)
    tell("shown", size=[region().height, region().width], frame=[*frame.min(axis=0), *frame.max(axis=0)])


def render():
    """F12 beside the viewport."""
    bpy.ops.render.render()
    settings = bpy.context.scene.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    bpy.data.images["Render Result"].save_render(str(FOLDER / "rendered.exr"))
    for _ in range(20):  # Blender tells viewports that something has changed
        yield
    yield from until(lambda: threads() == 0)
    tell("rendered")


def change():
    thing, color = bpy.data.objects["Ball"], bpy.data.materials["Red"].node_tree.nodes[0].inputs["Color"]
    for number, x in enumerate((0.1, 0.0, -0.1)):
        yield from restart(f"moved {number}", lambda: setattr(thing.location, "x", x), x=ball_x)
        yield from until_drawn()
    yield from restart("material", lambda: setattr(color, "default_value", (0.0, 0.0, 1.0, 1.0)))
    yield from until_drawn()
    before = drawn().job
    thing.select_set(True)
    for _ in range(20):
        yield
    tell("selected", restarted=drawn().job is not before)


def undo():
    with override():
        bpy.ops.ed.undo_push(message="Before")
        bpy.data.objects["Ball"].location.x = 0.6
        bpy.ops.ed.undo_push(message="After")
    yield from until(lambda: abs(ball_x() - 0.6) < 1e-6)
    with override():
        bpy.ops.ed.undo()
    yield from until(lambda: abs(ball_x() + 0.1) < 1e-6)
    yield from until_drawn()
    tell("undone", x=ball_x())


def edit():
    """A mesh in edit mode and back."""
    bpy.context.view_layer.objects.active = bpy.data.objects["Ball"]
    before = ball_triangles()
    with override():
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.mesh.subdivide()
    yield from until(lambda: ball_triangles() > before)
    with override():
        bpy.ops.object.mode_set(mode="OBJECT")
    yield from until_drawn()
    tell("edited", before=before, after=ball_triangles())


def look():
    view = space().region_3d

    def leave_camera():
        view.view_perspective = "PERSP"

    yield from restart("perspective", leave_camera)
    yield from until_drawn()
    yield from navigate(view)
    yield from until(lambda: drawn().job is views()[0]._job)
    yield from restart("orthographic", lambda: setattr(view, "view_perspective", "ORTHO"),
                       projection=lambda: drawn().job.camera.projection.name)
    yield from until_drawn(4)
    with override():
        bpy.ops.screen.screenshot_area(filepath=str(FOLDER / "orthographic.png"))

    def border():
        space().use_render_border = True
        space().render_border_min_x, space().render_border_max_x = 0.25, 0.75
        space().render_border_min_y, space().render_border_max_y = 0.0, 0.5

    yield from restart("border", border, full=lambda: [drawn().job.camera.height, drawn().job.camera.width],
                       region=lambda: [region().height, region().width])
    space().use_render_border = False
    yield from until_drawn()


def navigate(view):
    """Moves on at every step of the event loop, as the mouse does; tells which pictures were drawn meanwhile."""
    seen, steps = [], 0
    while len(seen) < 8:
        steps += 1
        view.view_distance = 6.0 + 0.01 * steps
        if not seen or seen[-1].job is not drawn().job:
            seen.append(drawn())
        if steps > 10_000:
            raise RuntimeError("no picture follows")
        yield
    tell("navigated", pictures=len(seen), steps=steps)


def fail():
    """A camera that the engine cannot look through, and back."""
    space().region_3d.view_perspective = "CAMERA"
    lens = bpy.context.scene.camera.data
    yield from until_drawn()
    lens.type = "PANO"
    yield from until(lambda: threads() == 0)
    tell("failed", message=views()[0]._error)
    lens.type = "PERSP"
    yield from until(lambda: not views()[0]._error)
    yield from until_drawn()


def stop():
    """In the middle of a picture that would take for ever."""
    bpy.context.scene.sppm.viewport_iterations = 1_000_000
    yield from until_drawn(2)
    yield from stopped("solid", lambda: setattr(space().shading, "type", "SOLID"))
    space().shading.type = "RENDERED"
    yield from until_drawn()
    path = str(FOLDER / "saved.blend")
    bpy.ops.wm.save_as_mainfile(filepath=path)
    yield from stopped("loaded", lambda: bpy.ops.wm.open_mainfile(filepath=path))
    space().shading.type = "RENDERED"  # Blender itself leaves it when it loads a file
    yield from until_drawn(2)
    tell("shown after loading", views=len(views()))
    yield from stopped("disabled", lambda: addon_utils.disable("sppm"))
    addon_utils.enable("sppm")
    space().shading.type = "SOLID"
    yield
    space().shading.type = "RENDERED"
    yield from until_drawn(2)
    tell("enabled", views=len(views()), engine=bpy.context.scene.render.engine)


def stopped(name, change):
    begin = time.monotonic()
    change()
    yield from until(lambda: threads() == 0)
    seconds = time.monotonic() - begin
    yield
    tell(name, seconds=seconds, views=len(views()))


def steps():
    prepare()
    yield
    for step in (preview, show, render, change, undo, edit, look, fail, stop):
        yield from step() or ()
    # Blender ends in the middle of a picture.
    bpy.ops.wm.quit_blender()


running = steps()


def tick():
    """From a timer, for Blender draws in between. An error here would leave the window open for ever."""
    try:
        return 0.005 if next(running, "end") is None else None
    except BaseException:
        traceback.print_exc()
        sys.stdout.flush()
        bpy.ops.wm.quit_blender()


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
