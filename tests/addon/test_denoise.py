"""Blender's Denoise node on our picture and its denoising passes."""

import blender_scene
import bpy
import make_scenes
import numpy as np
import pytest
from cycles_reference import PICTURES
from sppm import compat

SIZE = 96


def has_denoiser():
    """Whether this Blender was built with OpenImageDenoise, as Cycles tells."""
    import _cycles

    return _cycles.with_openimagedenoise


@pytest.fixture
def board(empty_scene):
    """A floor of tiles with a glass ball, a mirror ball and a lamp: edges, texture, reflections of both, and little light."""
    scene = blender_scene.start(SIZE, SIZE, iterations=1, world=(0.02, 0.02, 0.03))
    tiles = make_scenes.diffuse("Tiles", (0.5, 0.5, 0.5))
    make_scenes.use_image(tiles, make_scenes.tile_image(64, 4))
    make_scenes.add_quad("Floor", (-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0), tiles, tiles=(3, 3))
    make_scenes.add_sphere("Mirror", (0.6, 0.2, 0.5), 0.5, make_scenes.metal("Silver", (0.9, 0.9, 0.9)))
    make_scenes.add_sphere("Ball", (-0.6, 0, 0.5), 0.5, make_scenes.glass("Glass"))
    make_scenes.add_lamp("AREA", (-0.5, -1.5, 2.5), (0, 0, 0), 60.0, size=1.0)
    make_scenes.add_camera((0, -3.4, 2.2), (0, 0, 0.3))
    setattr(*compat.denoising_switch(bpy.context.view_layer), True)
    return scene


def new_tree(scene):
    """(compositing tree, socket of the picture that it makes)"""
    if hasattr(scene, "compositing_node_group"):
        tree = scene.compositing_node_group = bpy.data.node_groups.new("Compositing", "CompositorNodeTree")
        tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
        return tree, tree.nodes.new("NodeGroupOutput").inputs[0]
    scene.use_nodes = True
    tree = scene.node_tree
    tree.nodes.clear()
    return tree, tree.nodes.new("CompositorNodeComposite").inputs["Image"]


def denoise(scene, with_features):
    """Puts the node between our render and the picture."""
    tree, picture = new_tree(scene)
    layers, node = tree.nodes.new("CompositorNodeRLayers"), tree.nodes.new("CompositorNodeDenoise")
    tree.links.new(layers.outputs["Image"], node.inputs["Image"])
    for name in ("Normal", "Albedo") if with_features else ():
        tree.links.new(layers.outputs[f"Denoising {name}"], node.inputs[name])
    tree.links.new(node.outputs["Image"], picture)


def error(pixels, reference):
    """Mean of what is seen on the floor and in the mirror ball, in the right half: glints in glass need more paths than this."""
    difference = np.clip(pixels, 0, 1) - np.clip(reference, 0, 1)
    return float(np.abs(difference[:, SIZE // 2:, :3]).mean())


@pytest.mark.skipif(not has_denoiser(), reason="this Blender has no OpenImageDenoise")
def test_denoise_node_with_our_features(board, tmp_path):
    """It takes most of the noise out, and more with the features than without: tiles and what balls show stay sharp."""
    noisy = blender_scene.render(tmp_path / "noisy.exr")
    board.sppm.iterations = 128
    reference = blender_scene.render(tmp_path / "reference.exr")
    board.sppm.iterations = 1
    found = {}
    for with_features in (False, True):
        denoise(board, with_features)
        found[with_features] = blender_scene.render(tmp_path / "denoised.exr")
    plain, guided = found[False], found[True]
    errors = [error(pixels, reference) for pixels in (noisy, plain, guided)]
    print("noisy, denoised, denoised with features:", errors)
    PICTURES.mkdir(parents=True, exist_ok=True)
    rows = [np.concatenate([a, b], 1)[..., :3] for a, b in ((noisy, reference), (plain, guided))]
    blender_scene.save_side_by_side(PICTURES / f"denoise-{bpy.app.version_string}.png", *rows, zoom=2)
    assert errors[2] < 0.5 * errors[0] and errors[2] < 0.8 * errors[1]
