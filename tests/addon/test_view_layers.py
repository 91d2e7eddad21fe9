"""View layers: each with its own objects, passes and overrides; and what of the scene its camera sees, beside Cycles."""

import blender_scene
import bpy
import make_scenes
import numpy as np
import pytest
from cycles_reference import render_with_cycles
from exr_layers import render_layers
from sppm import compat, statistics

SIZE = 24


@pytest.fixture
def stage(empty_scene):
    """A grey floor and a red box in a collection of its own, under a soft white sky."""
    scene = blender_scene.start(SIZE, SIZE, iterations=64, world=(0.5, 0.5, 0.5))
    collection = bpy.data.collections.new("Props")
    scene.collection.children.link(collection)
    make_scenes.add_floor(3.0, make_scenes.diffuse("Grey", (0.5, 0.5, 0.5)))
    make_scenes.add_box("Box", (0, 0, 0.5), (1, 1, 1), make_scenes.diffuse("Red", (0.8, 0.1, 0.1)), collection=collection)
    make_scenes.add_camera((0, -4, 3), (0, 0, 0.3))
    return scene


def props(layer=None):
    return (layer or bpy.context.view_layer).layer_collection.children["Props"]


def second_layer(scene):
    layer = scene.view_layers.new("Second")
    for one in scene.view_layers:
        one.use_pass_z = False
    return layer


def is_red(pixels):
    return (pixels[..., 0] > 3 * pixels[..., 1]) & (pixels[..., 0] > 0.05)


# ---------------------------------------------------------------- what is a layer's own


def test_layers_have_their_own_objects_and_passes(stage, tmp_path):
    second = second_layer(stage)
    props(second).exclude = True
    second.use_pass_mist = True
    second.sppm.use_pass_direct = True
    found = render_layers(tmp_path / "layers.exr")
    assert set(found) == {"ViewLayer.Combined", "Second.Combined", "Second.Mist", "Second.Direct"}
    assert is_red(found["ViewLayer.Combined"]).any() and not is_red(found["Second.Combined"]).any()


def test_layers_have_their_own_materials_world_and_iterations(stage, tmp_path, capsys):
    second = second_layer(stage)
    second.material_override = make_scenes.diffuse("Clay", (0.3, 0.3, 0.3))
    second.samples = 5
    second.use_pass_diffuse_color = second.use_pass_environment = True
    world = bpy.data.worlds["World"].copy() if "World" in bpy.data.worlds else stage.world.copy()
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.1, 0.2, 0.3, 1.0)
    if hasattr(second, "world_override"):
        second.world_override = world
    found = render_layers(tmp_path / "layers.exr")
    assert is_red(found["ViewLayer.Combined"]).any()
    color = found[f"Second.{compat.pass_name('Diffuse Color')}"]
    assert color.max() == pytest.approx(0.3, rel=1e-5) and np.ptp(color, axis=-1).max() < 1e-6
    sky = found[f"Second.{compat.pass_name('Environment')}"].max((0, 1))
    assert np.allclose(sky, (0.1, 0.2, 0.3) if hasattr(second, "world_override") else 0.5, rtol=1e-5)
    out = capsys.readouterr().out
    assert "rendered 64 iterations" in out and "rendered 5 iterations" in out


def test_what_all_layers_would_tell_is_told_once_a_render(stage, tmp_path, capsys):
    second_layer(stage)
    make_scenes.add_lamp("SUN", (1, 0, 4), (0, 0, 0), 2.0)
    make_scenes.link("Fur", bpy.data.hair_curves.new("Fur"))
    for _ in range(2):
        render_layers(tmp_path / "layers.exr")
        lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("SPPM: ")]
        assert sum("'Sun': no object is made of glass" in line for line in lines) == 1, lines
        assert sum("'Fur'" in line for line in lines) == 1, lines
    told = dict(statistics.reports(stage.name_full, ["ViewLayer", "Second"]))
    assert len(told) == 2 and all(any("'Sun'" in message for message in report.messages) for report in told.values())


@pytest.mark.parametrize("switch", ["use_sky", "use_solid"])
def test_a_layer_without_sky_or_surfaces(stage, tmp_path, switch):
    make_scenes.add_lamp("SUN", (1, 0, 4), (0, 0, 0), 2.0)
    setattr(bpy.context.view_layer, switch, False)
    ours = blender_scene.render(tmp_path / "sppm.exr")
    theirs = render_with_cycles(tmp_path / "cycles.exr", 64)
    np.testing.assert_allclose(blender_scene.region_means(ours, 2), blender_scene.region_means(theirs, 2), rtol=0.03, atol=1e-4)


def test_the_compositor_hears_of_our_switches(stage):
    """Its Render Layers node shows a socket as soon as a pass is switched on, and takes it back."""
    if hasattr(stage, "compositing_node_group"):
        tree = stage.compositing_node_group = bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
    else:
        stage.use_nodes = True
        tree = stage.node_tree
    node = tree.nodes.new("CompositorNodeRLayers")
    for is_on in (True, False):
        bpy.context.view_layer.sppm.use_pass_caustics = is_on
        sockets = {socket.name for socket in node.outputs if socket.enabled}
        assert ("Caustics" in sockets) == is_on


# ---------------------------------------------------------------- what the camera sees


def hold_out():
    bpy.data.objects["Box"].is_holdout = True


def hold_out_on_clear_film():
    hold_out()
    bpy.context.scene.render.film_transparent = True


def hold_out_collection():
    props().holdout = True


def hide_from_camera():
    bpy.data.objects["Box"].visible_camera = False


def indirect_only():
    props().indirect_only = True


@pytest.mark.parametrize("change", [hold_out, hold_out_on_clear_film, hold_out_collection, hide_from_camera, indirect_only],
                         ids=lambda change: change.__name__)
def test_like_cycles(stage, tmp_path, change):
    """The box shows nothing of itself, but darkens and reddens the floor around it, in alpha as in colour.

    4 x 4 regions of 36 pixels and 64 paths: noise is below 2 %.
    """
    plain = blender_scene.render(tmp_path / "plain.exr")
    change()
    ours = blender_scene.render(tmp_path / "sppm.exr")
    theirs = render_with_cycles(tmp_path / "cycles.exr", 256)
    blender_scene.save_side_by_side(tmp_path.parent / f"{change.__name__}.png", ours[..., :3], theirs[..., :3])
    assert is_red(plain).any() and not is_red(ours).any()
    beside = [np.concatenate([pixels[..., :3], pixels[..., 3:].repeat(3, 2)], 1) for pixels in (ours, theirs)]
    parts = [blender_scene.region_means(pixels.reshape(SIZE, 2 * SIZE, 3), 4) for pixels in beside]
    np.testing.assert_allclose(*parts, rtol=0.03, atol=3e-3)
