"""Run by test_ui.py in a Blender with a window: shows every tab of the properties editor and prints each panel that draws itself.

    blender ... -P draw_in_window.py -- FOLDER        # where a picture of each tab is left
"""

import sys
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / folder) for folder in ("blend_scenes", "tests", "tests/addon")]
import blender_scene  # noqa: E402

TABS = {"Ball": ("RENDER", "VIEW_LAYER", "WORLD", "OBJECT", "MATERIAL"), "Point": ("DATA",), "Camera": ("DATA",)}


def main():
    """From a timer, once the window is there."""
    from sppm import engine, ui

    without_previews(engine.SppmRenderEngine)
    for cls in ui._CLASSES:
        if hasattr(cls, "draw_properties"):
            keep_when_drawn(cls)
    folder = Path(sys.argv[-1])
    folder.mkdir(parents=True, exist_ok=True)
    area = next(area for area in bpy.context.window_manager.windows[0].screen.areas if area.type == "PROPERTIES")
    window = bpy.context.window_manager.windows[0]
    make_scene()
    for name, tabs in TABS.items():
        select(name)
        for tab in tabs:
            with bpy.context.temp_override(window=window):
                bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=1)
                area.spaces[0].context = tab
                bpy.ops.wm.redraw_timer(type="DRAW_WIN_SWAP", iterations=2)
            with bpy.context.temp_override(window=window, screen=window.screen, area=area):
                bpy.ops.screen.screenshot_area(filepath=str(folder / f"{name}_{tab}.png".lower()))
    for name in drawn_panels:
        print("DRAWN", name)
    sys.stdout.flush()
    bpy.ops.wm.quit_blender()


def without_previews(engine):
    """An operator that Python calls with a context of its own reads it without the interpreter's lock wherever another thread runs
    Python, and the small picture of the material tab does: Blender then crashes by chance, in what only this script does.
    """
    bpy.utils.unregister_class(engine)
    engine.bl_use_preview = False
    bpy.utils.register_class(engine)


drawn_panels = set()


def keep_when_drawn(cls):
    """Opens the panel, too: closed ones are not drawn. Nothing is printed here, for that lets other threads in: see in_window."""
    bpy.utils.unregister_class(cls)
    cls.bl_options = set()
    draw = cls.draw_properties

    def drawn(self, layout, context):
        draw(self, layout, context)
        drawn_panels.add(cls.__name__)

    cls.draw_properties = drawn
    bpy.utils.register_class(cls)


def make_scene():
    """Rendered, with something to tell: the ball's normals are flipped."""
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    scene = bpy.context.scene
    scene.render.engine = "SPPM"
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.sppm.iterations = 2
    blender_scene.add_ball_on_floor().data.flip_normals()
    bpy.ops.render.render()


def select(name):
    bpy.context.view_layer.objects.active = bpy.data.objects[name]
    bpy.data.objects[name].select_set(True)


def guarded():
    """A timer's error would leave the window open for ever."""
    try:
        main()
    except BaseException:
        import traceback

        traceback.print_exc()
        sys.stdout.flush()
        bpy.ops.wm.quit_blender()


bpy.app.timers.register(guarded, first_interval=1.0)
