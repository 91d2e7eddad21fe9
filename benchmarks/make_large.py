"""Runs in Blender: saves a file with the large mesh of `scaling_scenes` and as many objects that share it as are asked for.

    blender -b --factory-startup --python make_large.py -- OUT.blend TRIANGLES OBJECTS
"""

import sys
from pathlib import Path

import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
import environment  # noqa: E402, F401  # makes the staged add-on importable
import scaling_scenes  # noqa: E402


def main(path, triangles, count):
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    mesh = _mesh(scaling_scenes.wavy_sheet(triangles))
    for i, place in enumerate(scaling_scenes.places(count)):
        thing = bpy.data.objects.new(f"sheet {i}", mesh)
        thing.location = place[:, 3]
        bpy.context.collection.objects.link(thing)
    bpy.ops.wm.save_as_mainfile(filepath=path)


def _mesh(desc):
    mesh, count = bpy.data.meshes.new(desc.name), len(desc.indices)
    mesh.vertices.add(len(desc.positions))
    mesh.vertices.foreach_set("co", desc.positions.ravel())
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", desc.indices.ravel().astype(np.int32))
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", 3 * np.arange(count, dtype=np.int32))
    if bpy.app.version < (4, 0):
        mesh.polygons.foreach_set("loop_total", np.full(count, 3, np.int32))
    mesh.update(calc_edges=True)
    return mesh


if __name__ == "__main__":
    path, triangles, count = sys.argv[sys.argv.index("--") + 1:]
    main(path, int(triangles), int(count))
