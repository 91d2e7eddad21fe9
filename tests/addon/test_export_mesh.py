"""Normals, UVs and material slots of exported meshes; nothing is rendered."""

import math

import bpy
import make_scenes
import numpy as np
import pytest
from blender_scene import cube


def material_names(desc, instance):
    return [desc.materials[index - 1].name if index else None for index in instance.materials]


def corner_normals(desc):
    """(triangles, 3 corners, 3) normals and the same of the triangles' planes and of their corners' directions."""
    mesh = desc.meshes[0]
    points = mesh.positions[mesh.indices]
    planes = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    planes /= np.linalg.norm(planes, axis=1, keepdims=True)
    outward = points / np.linalg.norm(points, axis=2, keepdims=True)
    return mesh.corner_normals[mesh.corners], np.repeat(planes[:, None], 3, 1), outward


def make_normals_editable(mesh):
    if hasattr(mesh, "use_auto_smooth"):
        mesh.use_auto_smooth, mesh.auto_smooth_angle = True, math.pi


def test_flat_mesh_stores_no_normals(export):
    cube()
    mesh = export()[0].meshes[0]
    assert mesh.corner_normals is None and mesh.corners is None


def test_smooth_mesh_has_normals_of_its_vertices(export):
    cube(smooth=True)
    normals, _, outward = corner_normals(export()[0])
    assert np.allclose(normals, outward, atol=1e-4)


def test_partly_smooth_mesh_is_flat_where_it_is_flat(export):
    cube(smooth=True).data.polygons[0].use_smooth = False
    normals, planes, _ = corner_normals(export()[0])
    same = np.isclose(normals, planes, atol=1e-4).all((1, 2))
    assert same.tolist() == [True] * 2 + [False] * 10


def test_sharp_edges_split_the_normals(export):
    """The top is cut off all around."""
    mesh = cube(smooth=True).data
    make_normals_editable(mesh)
    top = set(mesh.polygons[1].vertices)
    for edge in mesh.edges:
        edge.use_edge_sharp = top.issuperset(edge.vertices)
    normals, planes, _ = corner_normals(export()[0])
    same = np.isclose(normals, planes, atol=1e-4).all((1, 2))
    assert same.tolist() == [False] * 2 + [True] * 2 + [False] * 8


def test_custom_normals(export):
    mesh = cube(smooth=True).data
    make_normals_editable(mesh)
    wanted = np.array((0.6, 0.0, 0.8))
    mesh.normals_split_custom_set([tuple(wanted)] * len(mesh.loops))
    normals, _, _ = corner_normals(export()[0])
    assert np.allclose(normals, wanted, atol=1e-3)


def textured(name="Textured"):
    image = make_scenes.pack_image(name, np.full((2, 2, 3), 0.5, np.float32))
    return make_scenes.use_image(make_scenes.diffuse(name, (1, 1, 1)), image)


@pytest.mark.parametrize("is_needed", [False, True])
def test_uvs_are_exported_where_a_material_reads_them(export, is_needed):
    material = textured() if is_needed else make_scenes.diffuse("Plain", (1, 1, 1))
    make_scenes.add_quad("Quad", (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), material, tiles=(3, 2))
    mesh = export()[0].meshes[0]
    if not is_needed:
        assert mesh.corner_uvs is None and mesh.corners is None
        return
    assert np.allclose(mesh.corner_uvs[mesh.corners], mesh.positions[mesh.indices][..., :2] * (3, 2))


def test_render_uv_map_is_used(export):
    quad = make_scenes.add_quad("Quad", (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), textured(), tiles=(1, 1))
    other = quad.data.uv_layers.new(name="Other")
    for loop in other.data:
        loop.uv = (0.25, 0.75)
    other.active_render = True
    assert np.allclose(export()[0].meshes[0].corner_uvs, (0.25, 0.75))


@pytest.mark.parametrize("order", [("A plain", "B textured"), ("A textured", "B plain")])
def test_shared_mesh_has_uvs_if_any_instance_reads_them(export, order):
    """The slots are linked to the objects: the mesh itself does not know."""
    quad = make_scenes.add_quad("Quad", (0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), make_scenes.diffuse("Own", (1, 1, 1)), (1, 1))
    mesh = quad.data
    bpy.data.objects.remove(quad)
    for name in order:
        slot = make_scenes.link(name, mesh).material_slots[0]
        slot.link = "OBJECT"
        slot.material = textured(name) if "textured" in name else make_scenes.diffuse(name, (1, 1, 1))
    desc, _ = export()
    assert len(desc.meshes) == 1
    assert desc.meshes[0].corner_uvs is not None
    assert {item.name: material_names(desc, item) for item in desc.instances} == {name: [name] for name in order}


def test_material_slots(export):
    box = cube(material=make_scenes.diffuse("Red", (1, 0, 0)))
    for name in ("Green", "Blue"):
        box.data.materials.append(make_scenes.diffuse(name, (0, 1, 0)))
    box.data.polygons[1].material_index, box.data.polygons[2].material_index = 1, 2
    box.material_slots[1].link = "OBJECT"
    box.material_slots[1].material = make_scenes.diffuse("Mine", (1, 1, 1))
    desc, _ = export()
    assert material_names(desc, desc.instances[0]) == ["Red", "Mine", "Blue"]
    assert np.bincount(desc.meshes[0].material_slots).tolist() == [8, 2, 2]


def test_one_slot_is_not_stored(export):
    cube(material=make_scenes.diffuse("Red", (1, 0, 0)))
    assert export()[0].meshes[0].material_slots is None


def test_material_is_exported_once(export):
    red = make_scenes.diffuse("Red", (1, 0, 0))
    cube("First", red)
    cube("Second", red)
    desc, _ = export()
    assert len(desc.materials) == 1 and len(desc.meshes) == 2
