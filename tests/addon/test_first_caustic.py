"""The steps of docs/guide.md, one operator each, from Blender's own default scene."""

import bpy
import pytest
from sppm import statistics


@pytest.fixture
def default_scene():
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    return bpy.context.scene


def test_the_guides_steps_show_a_caustic_and_no_message(default_scene):
    bpy.data.objects["Cube"].select_set(True)
    bpy.ops.object.delete()
    bpy.ops.mesh.primitive_plane_add(size=20)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=1, location=(0, 0, 1))
    bpy.ops.object.shade_smooth()
    choose_glass(bpy.context.object)
    default_scene.render.engine = "SPPM"
    default_scene.render.resolution_percentage = 5
    assert default_scene.sppm.quality == "GOOD"
    default_scene.sppm.quality = "DRAFT"
    bpy.ops.render.render()
    ((_, report),) = statistics.reports("Scene", ["ViewLayer"])
    assert report.messages == []
    assert 0.02 < report.shares["Caustics"] < 0.04  # 2.8 % as the guide renders it


def choose_glass(thing):
    """What *New*, and then *Glass BSDF* in the list of surfaces, do."""
    material = bpy.data.materials.new("Material")
    material.use_nodes = True
    thing.data.materials.append(material)
    tree = material.node_tree
    tree.nodes.remove(tree.nodes["Principled BSDF"])
    tree.links.new(tree.nodes.new("ShaderNodeBsdfGlass").outputs[0], tree.nodes["Material Output"].inputs["Surface"])
