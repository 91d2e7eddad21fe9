"""Runs inside Blender: enables the installed add-on and renders with it, after Cycles and beside Blender's own libraries.

    python render_installed.py -- MODULE FOLDER

Prints one line of JSON: the brightness below the lamp that Cycles and SPPM find, what was loaded, where from.
"""

import ctypes
import importlib
import json
import os
import sys
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[2]
for part in ("blend_scenes", "tests", "tests/addon"):
    sys.path.insert(0, str(ROOT / part))

LIBRARIES = ("libembree", "libtbb", "libOpenEXR", "libImath", "libIex", "libIlmThread")


def mapped_libraries():
    """The shared libraries of this process."""
    lines = Path("/proc/self/maps").read_text().splitlines()
    return {line.split(maxsplit=5)[5] for line in lines if ".so" in line}


def make_blenders_libraries_global():
    """The worst that another add-on could do: its symbols are now the first that any plainly loaded library finds."""
    own = sorted(path for path in mapped_libraries() if Path(path).name.startswith(LIBRARIES))
    for path in own:
        ctypes.CDLL(path, mode=os.RTLD_NOW | os.RTLD_GLOBAL)
    return own


def make_scene():
    """A white floor under a point lamp of 50 W, 1.3 m above its middle, seen from straight above."""
    import blender_scene
    import make_scenes

    scene = blender_scene.start(32, 32)
    make_scenes.add_floor(8.0, make_scenes.diffuse("White", (1.0, 1.0, 1.0)))
    make_scenes.add_lamp("POINT", (0, 0, 1.3), (0, 0, 0), 50.0, shadow_soft_size=0.0)
    make_scenes.add_camera((0, 0, 2.0), (0, 0, 0))
    return scene


def render(scene, engine, path):
    """Mean of the middle of the picture."""
    import blender_scene

    scene.render.engine = engine
    return float(blender_scene.render(path)[14:18, 14:18, :3].mean())


def main(module, folder):
    import addon_utils

    blenders = make_blenders_libraries_global()
    addon_utils.enable(module, default_set=True)
    scene = make_scene()
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.max_bounces = 16, False, 0
    cycles = render(scene, "CYCLES", folder / "cycles.exr")
    before = mapped_libraries()
    scene.sppm.write_interval = 2
    first = render(scene, "SPPM", folder / "first.exr")
    loaded = mapped_libraries() - before
    addon_utils.disable(module, default_set=True)
    addon_utils.enable(module, default_set=True)
    second = render(scene, "SPPM", folder / "second.exr")
    library = importlib.import_module(module + ".native_library")
    print(json.dumps({
        "blender": bpy.app.version_string, "cycles": cycles, "sppm": [first, second], "loaded": sorted(loaded),
        "blenders": blenders, "add-on": str(library.LIBRARY_PATH.parent), "library": library.version(),
    }), flush=True)


if __name__ == "__main__":
    main(sys.argv[-2], Path(sys.argv[-1]))
