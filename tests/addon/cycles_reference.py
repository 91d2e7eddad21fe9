"""Pictures by Cycles of the Blender that runs, without anything that changes their mean, and ours beside them."""

from pathlib import Path

import block_comparison
import blender_scene
import bpy
import make_scenes
import numpy as np
from exr_layers import render_layers

SEEDS = 8
PICTURES = Path(make_scenes.__file__).parents[1] / "build" / "test" / "cycles"

UNBIASED = {
    "device": "CPU", "use_adaptive_sampling": False, "use_denoising": False,
    "sample_clamp_direct": 0.0, "sample_clamp_indirect": 0.0, "light_sampling_threshold": 0.0, "blur_glossy": 0.0,
    "max_bounces": 24, "diffuse_bounces": 24, "glossy_bounces": 24, "transmission_bounces": 24, "transparent_max_bounces": 64,
    "pixel_filter_type": "BLACKMAN_HARRIS", "filter_width": 1.5,
}


def render_with_cycles(path, samples, seed=1, **settings):
    """The same scene by Cycles: (height, width, 4); `settings` are Cycles' own."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    for name, value in {**UNBIASED, "samples": samples, "seed": seed, **settings}.items():
        setattr(scene.cycles, name, value)
    for thing in bpy.data.objects:  # by default shadow rays near the terminator of smooth meshes start off the surface
        thing.cycles.shadow_terminator_geometry_offset = 0.0
    try:
        return blender_scene.render(path)
    finally:
        scene.render.engine = "SPPM"


def cycles_pictures(folder, samples, **settings):
    """(SEEDS, height, width, 3)"""
    path = folder / "cycles.exr"
    return np.array([render_with_cycles(path, samples, 100 + seed, **settings)[..., :3] for seed in range(SEEDS)])


def our_pictures(folder, pass_name="Combined"):
    """(SEEDS, height, width, 3) of the scene as it is set."""
    bpy.context.view_layer.sppm.use_pass_direct = pass_name == "Direct"
    pictures = []
    for seed in range(SEEDS):
        bpy.context.scene.sppm.seed = seed
        layers = render_layers(folder / "sppm.exr")
        pictures.append(next(pixels for name, pixels in layers.items() if name.endswith(pass_name))[..., :3])
    return np.array(pictures)


def assert_agree(name, ours, theirs, allowance, precision):
    """No block differs by more than noise and `allowance`, a share of it; a picture of both and of their ratio is left behind.

    Args:
        precision: the median standard error of a block, as a share of it, that still tests something.
    """
    found = block_comparison.compare(ours, theirs, allowance)
    print(f"{name}: {found}")
    PICTURES.mkdir(parents=True, exist_ok=True)
    blender_scene.save_side_by_side(PICTURES / f"{name}-{bpy.app.version_string}.png", ours.mean(0), theirs.mean(0))
    assert found.precision < precision, f"{found}: too noisy to test anything"
    assert np.abs(found.z).max() < found.limit, f"{found}\nz of the worst colour, rows from above:\n{worst_of(found.z)}"


def worst_of(z):
    """(blocks, blocks): of the three colours the one that is farthest off."""
    index = np.abs(z).argmax(-1)[..., None]
    return np.round(np.take_along_axis(z, index, -1)[::-1, :, 0], 1)
