"""Which objects are exported, how the camera sees them, and where the scene is moved to; nothing is rendered."""

import bpy
import make_scenes
import numpy as np
import pytest
from blender_scene import add_curve, add_surface, add_text, cube, make_dupli_verts, new_collection
from exported import names, places
from sppm.scene_desc import InstanceFlags


# ---------------------------------------------------------------- objects that render


def add_metaball():
    ball = bpy.data.metaballs.new("Ball")
    ball.elements.new()
    return make_scenes.link("Ball", ball)


@pytest.mark.parametrize("add", [cube, add_curve, add_text, add_surface, add_metaball], ids=lambda add: add.__name__)
def test_object_becomes_triangles_once(export, add):
    made = add()
    name = made.name
    made.location = (1, 2, 3)
    desc, warnings = export()
    assert names(desc) == [name]
    assert len(desc.meshes) == 1
    assert len(desc.meshes[0].indices) >= 12
    assert places(desc) == [(1, 2, 3)]
    assert warnings == []


def test_mesh_without_faces_is_nothing(export):
    make_scenes.add_mesh("Points", [(0, 0, 0), (1, 0, 0)], [], None)
    desc, warnings = export()
    assert (desc.meshes, desc.instances, warnings) == ([], [], [])


def test_modifiers_have_their_render_level(export):
    modifier = cube().modifiers.new("Subdivision", "SUBSURF")
    modifier.subdivision_type, modifier.levels, modifier.render_levels = "SIMPLE", 0, 2
    assert len(export()[0].meshes[0].indices) == 6 * 16 * 2


def test_modifier_hidden_in_renders_is_not_applied(export):
    modifier = cube().modifiers.new("Array", "ARRAY")
    modifier.show_render = False
    assert len(export()[0].meshes[0].indices) == 12


@pytest.mark.parametrize("add, says", [
    (lambda: make_scenes.link("Cloud", bpy.data.volumes.new("Cloud")), "volume"),
    (lambda: make_scenes.link("Cloud", bpy.data.hair_curves.new("Cloud")), "hair"),
], ids=["volume", "hair curves"])
def test_what_cannot_be_rendered_is_named(export, add, says):
    add()
    desc, warnings = export()
    assert desc.instances == []
    assert len(warnings) == 1 and "'Cloud'" in warnings[0] and says in warnings[0]


def test_particle_hair_is_named_and_its_emitter_rendered(export):
    head = cube("Head")
    head.modifiers.new("Fur", "PARTICLE_SYSTEM")
    head.particle_systems[0].settings.type = "HAIR"
    desc, warnings = export()
    assert names(desc) == ["Head"]
    assert len(warnings) == 1 and "'Head'" in warnings[0] and "hair" in warnings[0]


# ---------------------------------------------------------------- what is hidden


def hide_object(scene, _collection):
    scene.objects["Hidden"].hide_render = True


def hide_collection(_scene, collection):
    collection.hide_render = True


def exclude_collection(scene, collection):
    scene.view_layers[0].layer_collection.children[collection.name].exclude = True


def hide_from_all_rays(scene, _collection):
    for ray in ("camera", "diffuse", "glossy", "transmission", "volume_scatter", "shadow"):
        setattr(scene.objects["Hidden"], f"visible_{ray}", False)


@pytest.mark.parametrize("hide", [hide_object, hide_collection, exclude_collection, hide_from_all_rays], ids=lambda f: f.__name__)
def test_hidden(export, hide):
    collection = new_collection("Collection")
    cube("Shown")
    cube("Hidden", collection=collection)
    assert names(export()[0]) == ["Hidden", "Shown"]
    hide(bpy.context.scene, collection)
    desc, warnings = export()
    assert names(desc) == ["Shown"]
    assert warnings == []


def test_hidden_only_in_the_viewport_is_exported(export):
    box = cube()
    box.hide_viewport = True
    assert names(export()[0]) == ["Cube"]


def test_what_rays_cannot_be_told_is_said_once(export):
    """However many objects and instances there are."""
    make_dupli_verts(show_instancer=False)
    bpy.data.objects["Child"].visible_shadow = False
    for name in ("Second", "Third"):
        cube(name).visible_diffuse = False
    cube("Catcher").is_shadow_catcher = True
    desc, warnings = export()
    assert names(desc) == ["Catcher"] + ["Child"] * 4 + ["Second", "Third"]
    assert sorted(warnings) == [
        "object 'Catcher': a shadow catcher is rendered as an ordinary object",
        f"object '{desc.instances[0].name}' (and 2 more): ray visibility counts for camera rays only, all other rays see it"]


def hide_from_camera(thing, _layer_collection):
    thing.visible_camera = False


def make_indirect_only(_thing, layer_collection):
    layer_collection.indirect_only = True


def hold_out(thing, _layer_collection):
    thing.is_holdout = True


def hold_out_collection(_thing, layer_collection):
    layer_collection.holdout = True


def hold_out_and_make_indirect_only(_thing, layer_collection):
    layer_collection.holdout = layer_collection.indirect_only = True


CAMERA_SIGHTS = {hide_from_camera: InstanceFlags.HIDDEN_FROM_CAMERA, make_indirect_only: InstanceFlags.HIDDEN_FROM_CAMERA,
                 hold_out: InstanceFlags.HOLDOUT, hold_out_collection: InstanceFlags.HOLDOUT,
                 hold_out_and_make_indirect_only: InstanceFlags.HOLDOUT}


@pytest.mark.parametrize(("change", "flags"), CAMERA_SIGHTS.items(), ids=lambda value: getattr(value, "__name__", ""))
def test_how_the_camera_sees(export, change, flags):
    collection = new_collection("Collection")
    changed = cube("Changed", collection=collection)
    cube("Ordinary")
    change(changed, bpy.context.view_layer.layer_collection.children["Collection"])
    desc, warnings = export()
    assert {item.name: item.flags for item in desc.instances} == {"Changed": flags, "Ordinary": InstanceFlags.NONE}
    assert warnings == []


def test_what_an_instancer_says_counts_for_its_instances(export):
    make_dupli_verts(show_instancer=True)
    bpy.data.objects["Floor"].is_holdout = True
    bpy.data.objects["Child"].visible_camera = False
    bpy.data.objects["Child"].pass_index, bpy.data.objects["Floor"].pass_index = 3, 4
    desc, _ = export()
    both = InstanceFlags.HOLDOUT | InstanceFlags.HIDDEN_FROM_CAMERA
    assert {(item.name, item.flags, item.index) for item in desc.instances} == {
        ("Floor", InstanceFlags.HOLDOUT, 4), ("Child", both, 3)}


# ---------------------------------------------------------------- views


def test_stereoscopy_is_a_warning(export):
    bpy.context.scene.render.use_multiview = True
    assert any("stereoscopy" in warning for warning in export()[1])


# ---------------------------------------------------------------- origin


def test_near_scene_stays_where_it_is(export):
    cube().location = (1, 0, 0)
    make_scenes.add_floor(4.0, None)
    assert export()[0].origin == (0, 0, 0)


def test_far_scene_moves_to_its_centre(export):
    far = np.array((1e6, -2e6, 3e5))
    cube().location = far
    lamp = make_scenes.add_lamp("POINT", far + (0, 0, 2), far, 10.0)
    make_scenes.aim(bpy.context.scene.camera, far + (0, -5, 0), far)
    assert lamp.name == "Point"
    desc, _ = export()
    assert np.allclose(desc.origin, far, atol=1.0)
    for transform, offset in ((desc.instances[0].transform, (0, 0, 0)), (desc.lights[0].transform, (0, 0, 2)),
                              (desc.camera.transform, (0, -5, 0))):
        assert np.allclose(transform[:, 3] + desc.origin, far + offset, atol=1e-6)


def test_object_that_reaches_beyond_what_rays_do_is_named(export):
    """Told once for all such objects, and measured from where the scene has been moved to."""
    ground = make_scenes.add_floor(3e11, None)
    assert ground.name == "Floor"
    make_scenes.link("Second", ground.data)
    cube()
    _, warnings = export()
    assert len(warnings) == 1 and "'Floor' (and 1 more)" in warnings[0] and "1e+11 m" in warnings[0]
    ground.scale = bpy.data.objects["Second"].scale = (0.4, 0.4, 1)
    assert export()[1] == []
    ground.location = bpy.data.objects["Second"].location = bpy.data.objects["Cube"].location = (3e11, 0, 0)
    assert export()[1] == []
