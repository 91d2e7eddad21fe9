"""Rendering again and again in one process: nothing stale, nothing leaks, whatever happened in between."""

import gc
import os
import re
import subprocess
import sys
from pathlib import Path

import addon_utils
import blender_scene
import bpy
import make_scenes
import numpy as np
import pytest

REFUSED = 3  # exit code of life_in_window.py: Blender does not let it go on


def make_room():
    """A floor with a picture on it, a glass ball and a lamp, 32x32 pixels."""
    scene = blender_scene.start(32, 32)
    floor = make_scenes.diffuse("Floor", (1.0, 1.0, 1.0))
    make_scenes.use_image(floor, make_scenes.pack_image("Grey", np.full((512, 512, 3), 0.5), is_float=True))
    make_scenes.add_quad("Floor", (-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0), floor, tiles=(1, 1))
    make_scenes.add_sphere("Ball", (0.35, 0, 0.4), 0.3, make_scenes.glass("Glass"), 32, 16)
    make_scenes.add_lamp("POINT", (0.4, -0.4, 1.8), (0, 0, 0), 50.0, shadow_soft_size=0.05)
    make_scenes.add_camera((0, -2.6, 1.6), (0, 0, 0.2))
    return scene


def change(scene):
    """One of each kind: an object moves; a material, a lamp, a mesh and the camera are edited."""
    ball = bpy.data.objects["Ball"]
    ball.location.x = -0.4
    for vertex in ball.data.vertices:
        vertex.co.z *= 1.2
    ball.data.update()
    bpy.data.materials["Glass"].node_tree.nodes["Glass BSDF"].inputs["Color"].default_value = (1.0, 0.4, 0.4, 1.0)
    bpy.data.lights["Point"].energy = 80.0
    scene.camera.data.lens = 40.0


def nothing(scene, folder):
    pass


def fail(scene, folder):
    scene.camera.data.type = "PANO"
    with pytest.raises(RuntimeError, match="panoramic"):
        blender_scene.render(folder / "failed.exr")
    scene.camera.data.type = "PERSP"


def render_with_cycles(scene, folder):
    scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 1, False
    blender_scene.render(folder / "cycles.exr")
    scene.render.engine = "SPPM"


def reload_addon(scene, folder):
    addon_utils.disable("sppm", default_set=True)
    addon_utils.enable("sppm", default_set=True)
    assert scene.render.engine == "SPPM"
    assert scene.sppm.iterations == 4, "the settings are those of the file"


@pytest.mark.parametrize("happen", [nothing, fail, render_with_cycles, reload_addon], ids=lambda happen: happen.__name__)
@pytest.mark.parametrize("is_persistent", [False, True], ids=["", "persistent data"])
def test_second_render_shows_what_changed(addon, tmp_path, is_persistent, happen):
    change(make_room())
    expected = blender_scene.render(tmp_path / "expected.exr")
    scene = make_room()
    scene.render.use_persistent_data = is_persistent
    first = blender_scene.render(tmp_path / "first.exr")
    happen(scene, tmp_path)
    change(scene)
    second = blender_scene.render(tmp_path / "second.exr")
    assert np.array_equal(second, expected)
    assert not np.allclose(first, second, rtol=0.1), "the change shows"


def test_reload_registers_everything_once(addon):
    scene = make_room()
    before = registered()
    reload_addon(scene, None)
    assert registered() == before


def registered():
    """The names of the engine's classes that Blender knows."""
    kinds = bpy.types.RenderEngine, bpy.types.Panel, bpy.types.PropertyGroup, bpy.types.Operator, bpy.types.Menu
    return sorted(f"{kind.__name__} {cls.__name__}" for kind in kinds for cls in kind.__subclasses__()
                  if cls.__module__.split(".")[0] == "sppm" and cls.is_registered)


def resident_megabytes():
    gc.collect()
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 2**20


def test_memory_after_fifty_renders_is_that_after_two(addon, tmp_path):
    """The scene holds a picture of 4 MB: kept once a render it were 200 MB. The tolerance is for what allocators keep."""
    scene = make_room()
    megabytes = []
    for index in range(50):
        (nothing, fail, reload_addon)[index % 3](scene, tmp_path)
        assert bpy.ops.render.render() == {"FINISHED"}
        megabytes.append(resident_megabytes())
    assert megabytes[-1] < megabytes[1] + 16, megabytes


@pytest.mark.skipif(bool(bpy.app.binary_path), reason="a Blender program tidies up by itself")
@pytest.mark.parametrize("more", ["", "; addon_utils.disable('sppm')"], ids=["enabled", "disabled"])
def test_python_ends_cleanly_where_blender_is_a_module(more):
    program = f"import bpy, addon_utils; addon_utils.enable('sppm'){more}"
    subprocess.run([sys.executable, "-c", program], check=True, timeout=60)


# ---------------------------------------------------------------- a real window


@pytest.mark.skipif(not bpy.app.binary_path, reason="the bpy wheel has no window")
def test_what_a_user_does_while_a_picture_renders(tmp_path):
    """Esc, undo, deleted objects, another file, a reloaded add-on: Blender lives, and the next picture is right."""
    lines = re.findall(r"^STEP (\S+) (\S+)$", story_in_window(tmp_path), re.MULTILINE)
    found = {name: float(value) for name, value in lines}
    assert set(found) == {"whole", "cancelled", "kept", "cancelled-in-step", "undone", "removed", "again", "reloaded"}
    assert found["cancelled"] < 0.5 and found["cancelled-in-step"] < 0.5, "seconds from the key to the end of the render"
    assert found["kept"] == pytest.approx(1.0, abs=0.02), "what was rendered before Esc, beside the whole picture; noise"
    assert (found["undone"], found["removed"]) == (0, 2), "Blender's own part"
    assert found["whole"] > 0 and found["again"] == found["reloaded"] == 0, "bit by bit the first picture"


def story_in_window(folder, tries=3):
    """What life_in_window.py prints."""
    command = ["timeout", "120", "xvfb-run", "-a", "-s", "-screen 0 640x480x24 +extension GLX", bpy.app.binary_path,
               "--factory-startup", "--window-geometry", "0", "0", "640", "480", "--addons", "sppm", "--python-exit-code", "1",
               "-P", str(Path(__file__).with_name("life_in_window.py"))]
    for _ in range(tries):
        done = subprocess.run(command, env={**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1", "BLENDER_USER_CONFIG": str(folder)},
                              capture_output=True, text=True, check=False)
        if done.returncode != REFUSED:
            break
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout
