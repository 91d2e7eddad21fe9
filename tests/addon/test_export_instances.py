"""Instances of every kind that Blender knows: one mesh, many transforms; nothing is rendered."""

import bpy
import make_scenes
import numpy as np
import pytest
from blender_scene import add_curve, add_surface, add_text, cube, make_dupli_verts, new_collection
from exported import names, places


def test_linked_meshes_are_one_mesh(export):
    first = cube("First")
    make_scenes.link("Second", first.data).location = (2, 0, 0)
    desc, _ = export()
    assert names(desc) == ["First", "Second"]
    assert len(desc.meshes) == 1
    assert {item.mesh for item in desc.instances} == {1}


def test_collection_instances(export):
    """With a lamp in the collection: that is instanced as well."""
    source = new_collection("Source", is_linked=False)
    cube("Part", collection=source).location = (0, 0, 1)
    lamp = make_scenes.link("Lamp", bpy.data.lights.new("Lamp", "POINT"), source)
    lamp.data.energy = 10
    for x in (-2, 2, 4):
        empty = make_scenes.link(f"Empty{x}", None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", source, (x, 0, 0)
    desc, warnings = export()
    assert len(desc.meshes) == 1
    assert places(desc) == [(-2, 0, 1), (2, 0, 1), (4, 0, 1)]
    assert sorted(round(light.transform[0, 3]) for light in desc.lights) == [-2, 2, 4]
    assert warnings == []


@pytest.mark.parametrize("show_instancer", [False, True])
def test_instances_on_vertices(export, show_instancer):
    make_dupli_verts(show_instancer)
    desc, _ = export()
    assert places(desc, "Child") == [(-2, -2, 0), (-2, 2, 0), (2, -2, 0), (2, 2, 0)]
    assert len({item.mesh for item in desc.instances if item.name == "Child"}) == 1
    assert names(desc).count("Floor") == show_instancer
    assert len(desc.meshes) == 1 + show_instancer


@pytest.mark.parametrize("show_instancer", [False, True])
def test_instances_on_particles(export, show_instancer):
    bead = cube("Bead")
    bead.location = (20, 0, 0)
    emitter = make_scenes.add_floor(4.0, None)
    emitter.modifiers.new("Beads", "PARTICLE_SYSTEM")
    emitter.show_instancer_for_render = show_instancer
    settings = emitter.particle_systems[0].settings
    settings.count, settings.frame_start, settings.frame_end, settings.lifetime = 7, 0, 0, 100
    settings.render_type, settings.instance_object, settings.physics_type = "OBJECT", bead, "NO"
    bpy.context.scene.frame_set(2)
    desc, warnings = export()
    assert names(desc).count("Bead") == 8, "seven particles and the object itself"
    assert len({item.mesh for item in desc.instances if item.name == "Bead"}) == 1
    assert names(desc).count("Floor") == show_instancer
    assert warnings == []


def add_scatter(floor, source_type, **source_inputs):
    """A geometry node tree that puts what the source node makes on every vertex of the floor, and shows only that."""
    tree = bpy.data.node_groups.new("Scatter", "GeometryNodeTree")
    if hasattr(tree, "interface"):
        for direction in ("INPUT", "OUTPUT"):
            tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    else:
        tree.inputs.new("NodeSocketGeometry", "Geometry")
        tree.outputs.new("NodeSocketGeometry", "Geometry")
    start, end = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    source, scatter = tree.nodes.new(source_type), tree.nodes.new("GeometryNodeInstanceOnPoints")
    for name, value in source_inputs.items():
        source.inputs[name].default_value = value
    made = next(socket for socket in source.outputs if socket.type == "GEOMETRY")
    tree.links.new(start.outputs[0], scatter.inputs["Points"])
    tree.links.new(made, scatter.inputs["Instance"])
    tree.links.new(scatter.outputs["Instances"], end.inputs[0])
    floor.modifiers.new("Scatter", "NODES").node_group = tree


def test_geometry_nodes_instance_an_object(export):
    bead = cube("Bead")
    bead.location = (20, 0, 0)
    add_scatter(make_scenes.add_floor(4.0, None), "GeometryNodeObjectInfo", **{"Object": bead, "As Instance": True})
    desc, warnings = export()
    assert places(desc) == [(-2, -2, 0), (-2, 2, 0), (2, -2, 0), (2, 2, 0), (20, 0, 0)]
    assert len(desc.meshes) == 1
    assert warnings == []


def test_geometry_nodes_instance_their_own_meshes(export):
    """Two trees, whose meshes no object owns and which must not be taken for each other."""
    add_scatter(make_scenes.add_floor(4.0, None), "GeometryNodeMeshCube")
    add_scatter(make_scenes.add_floor(6.0, None), "GeometryNodeMeshUVSphere")
    desc, _ = export()
    assert sorted(len(mesh.indices) for mesh in desc.meshes) == [12, 32 * 15 * 2]
    by_distance = sorted(desc.instances, key=lambda item: abs(item.transform[0, 3]))
    assert [len(desc.meshes[item.mesh - 1].indices) for item in by_distance] == [12] * 4 + [32 * 15 * 2] * 4


@pytest.mark.parametrize("add", [add_curve, add_text, add_surface], ids=lambda add: add.__name__)
def test_instances_of_what_is_no_mesh(export, add):
    """Without metaballs: of those Blender makes no mesh unless they stand in the scene itself."""
    source = new_collection("Source", is_linked=False)
    made = add()
    for collection in made.users_collection:
        collection.objects.unlink(made)
    source.objects.link(made)
    for x in (-2, 2):
        empty = make_scenes.link(f"Empty{x}", None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", source, (x, 0, 0)
    desc, warnings = export()
    assert places(desc) == [(-2, 0, 0), (2, 0, 0)]
    assert len(desc.meshes) == 1
    assert warnings == []


def test_instances_in_instances(export):
    inner, outer = new_collection("Inner", is_linked=False), new_collection("Outer", is_linked=False)
    cube(collection=inner)
    for name, collection, place, source in (("A", outer, (0, 1, 0), inner), ("B", outer, (0, 2, 0), inner),
                                            ("C", None, (3, 0, 0), outer), ("D", None, (4, 0, 0), outer)):
        empty = make_scenes.link(name, None, collection)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", source, place
    desc, _ = export()
    assert places(desc) == [(3, 1, 0), (3, 2, 0), (4, 1, 0), (4, 2, 0)]
    assert len(desc.meshes) == 1


def test_negative_scale_stays_in_the_transform(export):
    cube().scale = (-2, 1, 0.5)
    transform = export()[0].instances[0].transform
    assert np.allclose(transform[:, :3], np.diag((-2, 1, 0.5)))


def test_scaled_to_nothing_is_left_out(export):
    cube().scale = (0, 0, 0)
    assert export()[0].instances == []
