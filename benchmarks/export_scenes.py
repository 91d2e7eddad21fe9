"""Blender files as plain scenes, so that what needs no Blender can measure them.

    BLENDER_USER_SCRIPTS=build/stage blender -b --factory-startup --python benchmarks/export_scenes.py \\
        -- FOLDER SIZE FILE.blend...

writes FOLDER/FILE.pickle, a SceneDesc of SIZE x SIZE pixels, for each file.
"""

import pickle
import sys
from pathlib import Path

import bpy


def exported(file, size):
    """The SceneDesc of a file's current frame at size x size pixels; the add-on must be enabled."""
    from sppm import export_scene

    bpy.ops.wm.open_mainfile(filepath=str(file))
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = size
    return export_scene.export_scene(bpy.context.evaluated_depsgraph_get())[0]


def main(folder, size, *files):
    import addon_utils

    if not addon_utils.enable("sppm"):
        sys.exit("Blender did not find the staged add-on: run ./dev stage")
    for file in files:
        Path(folder, Path(file).stem + ".pickle").write_bytes(pickle.dumps(exported(file, int(size))))


if __name__ == "__main__":
    main(*sys.argv[sys.argv.index("--") + 1 :])
