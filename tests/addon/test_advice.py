"""Each message of `advice` by a scene that provokes it, and none by scenes that are sound."""

from types import SimpleNamespace

import blender_scene
import bmesh
import bpy
import make_scenes
import numpy as np
import pytest
from sppm import advice
from sppm.export_scene import export_scene
from sppm.scene_desc import ClosureDesc, ClosureType, InstanceDesc, MaterialDesc, MeshDesc, Param, SceneDesc
from test_scenes import FILES


@pytest.fixture
def table(empty_scene):
    blender_scene.add_ball_on_floor()
    return empty_scene


def messages(max_depth=24):
    desc, warnings = export_scene(bpy.context.evaluated_depsgraph_get())
    assert warnings == []
    return advice.before_render(desc, max_depth)


def the_message(*parts, **settings):
    """There is one message, and it says this."""
    found = messages(**settings)
    assert len(found) == 1, found
    assert all(part in found[0] for part in parts), found
    assert "\n" not in found[0]


def remove(name):
    bpy.data.objects.remove(bpy.data.objects[name])


# ---------------------------------------------------------------- sound scenes


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_scenes_provoke_no_message(file):
    bpy.ops.wm.open_mainfile(filepath=str(file))
    assert messages(bpy.context.scene.sppm.max_depth) == []


def test_sound_glass_provokes_no_message(table):
    assert messages() == []


def test_nothing_but_a_camera_provokes_no_message(empty_scene):
    make_scenes.add_camera((0, -4, 1), (0, 0, 0.5))
    assert messages() == []


# ---------------------------------------------------------------- shells


def test_flipped_normals(table):
    bpy.data.objects["Ball"].data.flip_normals()
    the_message("'Ball'", "look inwards", "normals")


def test_mirrored_object_is_not_flipped(table):
    """A negative scale turns the order of corners, but not what is outside."""
    bpy.data.objects["Ball"].scale.x = -1
    assert messages() == []


def test_bubble_in_glass_may_look_inwards(table):
    bubble = make_scenes.add_sphere("Bubble", (0.05, 0, 0.5), 0.1, bpy.data.materials["Glass"], 32, 16)
    bubble.data.flip_normals()
    assert messages() == []
    bubble.location.x = 1.5
    the_message("'Bubble'", "look inwards")


def test_some_flipped_faces(table):
    for polygon in list(bpy.data.objects["Ball"].data.polygons)[:9]:
        polygon.flip()
    the_message("'Ball'", "some faces")


def test_flipped_metal_does_not_matter(table):
    ball = bpy.data.objects["Ball"].data
    ball.materials[0] = make_scenes.metal("Silver", (0.9, 0.9, 0.9))
    ball.flip_normals()
    assert messages() == []


def add_bowl(material):
    """Half a sphere without thickness."""
    angles = np.linspace(-np.pi / 2, 0, 9)
    profile = [(0.0, -0.4)] + [(0.4 * np.cos(t), 0.4 * np.sin(t)) for t in angles[1:]]
    bowl = make_scenes.add_lathe("Bowl", profile, material, 32)
    bowl.location = (0, 0, 0.5)
    return bowl


def test_open_shell(table):
    remove("Ball")
    bowl = add_bowl(bpy.data.materials["Glass"])
    the_message("'Bowl'", "open shell")
    bowl.modifiers.new("Solidify", "SOLIDIFY").thickness = 0.02
    assert messages() == []


def test_sheet_of_water_is_no_open_shell(table):
    remove("Ball")
    make_scenes.add_water(1.0, 16)
    assert messages() == []


def test_part_of_a_mesh_may_be_glass(table):
    """A body may be closed by what is not glass; and what is not glass may be open."""
    ball = bpy.data.objects["Ball"].data
    ball.materials.append(bpy.data.materials["White"])
    ball.polygons.foreach_set("material_index", np.arange(len(ball.polygons), dtype=np.int32) % 2)
    assert messages() == []
    remove("Ball")
    shade = bmesh.new()
    bmesh.ops.create_cube(shade, size=0.3)
    shade.faces.new([shade.verts.new(place) for place in ((0, 0, 1), (1, 0, 1), (0, 1, 1))]).material_index = 1
    mesh = bpy.data.meshes.new("Lantern")
    shade.to_mesh(mesh)
    mesh.materials.append(bpy.data.materials["Glass"])
    mesh.materials.append(bpy.data.materials["White"])
    make_scenes.link("Lantern", mesh)
    assert messages() == []


def test_split_seams_do_not_open_a_shell(table):
    """As importers leave them: every face has corners of its own."""
    ball = bpy.data.objects["Ball"]
    ball.modifiers.new("Split", "EDGE_SPLIT").split_angle = 0.0
    assert len(ball.evaluated_get(bpy.context.evaluated_depsgraph_get()).data.vertices) == len(ball.data.loops)
    assert messages() == []


def test_many_objects_make_one_message(table):
    ball = bpy.data.objects["Ball"].data
    ball.flip_normals()
    for index in range(5):
        make_scenes.link(f"Copy {index}", ball).location = (index, 2, 0.5)
    the_message("(and 5 more)", "look inwards")


# ---------------------------------------------------------------- lights


def test_lamp_without_size_behind_glass(table):
    lamp = bpy.data.objects["Point"]
    lamp.location = (0, 1, 0.37)
    lamp.data.shadow_soft_size = 0.0
    the_message("light 'Point'", "'Ball'", "no size")
    lamp.location = (0, -1, 0.37)
    assert messages() == [], "before the glass"
    lamp.location = (0, 0, 0.5)
    the_message("light 'Point'", "no size")


def test_lamp_without_size_out_of_view_does_not_matter(table):
    lamp = bpy.data.objects["Point"]
    lamp.location = (0, 0, 30)
    lamp.data.shadow_soft_size = 0.0
    assert messages() == []


def test_lamp_behind_glass_for_an_orthographic_camera(table):
    camera = bpy.data.objects["Camera"]
    camera.location, camera.rotation_euler = (0, -4, 0.5), (np.pi / 2, 0, 0)
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2.0
    lamp = bpy.data.objects["Point"]
    lamp.data.shadow_soft_size = 0.0
    lamp.location = (0.2, 1, 0.5)
    the_message("light 'Point'", "'Ball'")
    lamp.location = (0.6, 1, 0.5)
    assert messages() == []


def test_sun_without_specular_objects(table):
    make_scenes.add_lamp("SUN", (0, 0, 3), (0, 0, 0), 2.0)
    assert messages() == []
    bpy.data.objects["Ball"].data.materials[0] = bpy.data.materials["White"]
    the_message("'Sun'", "no object is made of glass")


# ---------------------------------------------------------------- depth


def test_depth_that_glass_needs(table):
    """A ball needs three vertices, two balls in a row five."""
    assert messages(max_depth=3) == []
    the_message("max depth 2", "'Ball'", "at least 3", max_depth=2)
    make_scenes.link("Second", bpy.data.objects["Ball"].data).location = (0, 1.2, 0.4)
    assert messages(max_depth=5) == []
    the_message("max depth 4", "(and 1 more)", "at least 5", max_depth=4)


# ---------------------------------------------------------------- after the render


def test_photons_that_never_arrive():
    dark = SimpleNamespace(photons_emitted=1000, photons_stored=0)
    assert "none of 1000 photons" in advice.after_render(dark, has_specular=True)[0]
    assert advice.after_render(dark, has_specular=False) == []
    assert advice.after_render(SimpleNamespace(photons_emitted=1000, photons_stored=1), has_specular=True) == []
    assert advice.after_render(SimpleNamespace(photons_emitted=0, photons_stored=0), has_specular=True) == []


# ---------------------------------------------------------------- by hand


def test_large_meshes_are_taken_to_be_sound(monkeypatch):
    """One triangle of glass is an open shell unless it is too much to look into."""
    glass = MaterialDesc("Glass", (ClosureDesc(ClosureType.DIELECTRIC, weight=Param((1.0, 1.0, 1.0))),))
    corners = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], np.float32)
    mesh = MeshDesc("Shard", corners, np.array([(0, 1, 2), (0, 2, 3)], np.uint32))
    desc = SceneDesc(materials=[glass], meshes=[mesh], instances=[InstanceDesc("Shard", 1, (1,), np.eye(3, 4))])
    assert len(advice._of_shells(advice._glass_objects(desc))) == 1
    monkeypatch.setattr(advice, "_MAX_TRIANGLES", 1)
    assert advice._of_shells(advice._glass_objects(desc)) == []
