"""Roughness from 0 to 1 in steps: against Cycles at each, and without a jump anywhere.

A ball, or a tilted plate, of a Principled material above a diffuse floor, before a red wall, under a sky and a lamp that is wide
enough for Cycles to meet it by chance: the material is seen by the camera, mirrors what is around it, and throws a caustic.

Glass has the sky alone, and Cycles may not sample it as a light. Where Cycles 3.4 to 4.5 connects a point of rough glass to a
light, it also counts pairs of directions that no microfacet refracts into each other: a ball of roughness 1 under a square lamp
is 2.0 times (4.5, multiple scattering), 2.5 times (4.5, GGX) or 1.2 times (3.4, GGX) as bright as the same ball by Cycles itself
when only its paths find the lamp. Ours is within a few percent, its noise, of the latter.
"""

import itertools

import blender_scene
import make_scenes
import numpy as np
import pytest
from block_comparison import compare
from cycles_reference import assert_agree, cycles_pictures, our_pictures
from sppm import compat_nodes

SIZE, SAMPLES = 32, 64
ROUGHNESSES = (0.0, 0.02, 0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
FAST = {("ball", "glass", 0.3)}

# What a block may differ by, noise apart: the bias of gathering at the foot of the subject.
ALLOWANCE = 0.005
PRECISION = 0.02

MATERIALS = {
    "metal": {"Base Color": (0.9, 0.7, 0.4), "Metallic": 1.0},
    "glass": {"Base Color": (1.0, 1.0, 1.0), "Transmission": 1.0, "IOR": 1.45},
    "plastic": {"Base Color": (0.6, 0.15, 0.1)},
}


def make_scene(shape, kind, roughness):
    scene = blender_scene.start(SIZE, SIZE, SAMPLES, world=(0.25, 0.3, 0.4))
    scene.sppm.photons_per_iteration = 8 * SIZE * SIZE
    scene.sppm.initial_radius = 0.02  # a third of a pixel: what a kernel loses at edges is below the noise
    make_scenes.add_floor(3.0, make_scenes.diffuse("Floor", (0.5, 0.5, 0.5)))
    material = make_scenes.principled("Subject", (1, 1, 1), Roughness=roughness)
    set_principled(material, MATERIALS[kind])
    if shape == "ball":
        make_scenes.add_sphere("Ball", (0, 0, 0.52), 0.5, material)
    else:
        plate = make_scenes.add_box("Plate", (0, 0, 0.55), (1.2, 1.2, 0.05), material, turn=20)
        plate.rotation_euler.x = 0.5
    wall = (-1.5, 1.2, 0), (1.5, 1.2, 0), (1.5, 1.2, 0.9), (-1.5, 1.2, 0.9)
    make_scenes.add_quad("Wall", *wall, make_scenes.diffuse("Wall", make_scenes.RED))
    if kind == "glass":
        scene.world.cycles.sampling_method = "NONE"
    else:
        make_scenes.add_lamp("AREA", (-1.2, -0.8, 1.9), (0, 0, 0.3), 60.0, size=0.9)
    make_scenes.add_camera((0.2, -3.2, 1.6), (0, 0, 0.4), lens=60)


def set_principled(material, inputs):
    node = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    for name, value in inputs.items():
        compat_nodes.principled_input(node, name).default_value = (*value, 1.0) if isinstance(value, tuple) else value


CASES = [pytest.param(*case, marks=() if case in FAST else pytest.mark.slow)
         for case in itertools.product(("ball", "plate"), MATERIALS, ROUGHNESSES)]


@pytest.mark.parametrize("shape, kind, roughness", CASES)
def test_like_cycles(shape, kind, roughness, tmp_path):
    ours = our_pictures_of(shape, kind, roughness, tmp_path)
    assert_agree(f"{shape}-{kind}-{roughness}", ours, cycles_pictures(tmp_path, 2 * SAMPLES), ALLOWANCE, PRECISION)


STEP = 0.002
# The microfacets of 0.01 and less are rendered as a mirror; the other places are ordinary.
PLACES = (0.009, 0.02, 0.049, 0.1, 0.25, 0.5, 0.75, 1.0 - STEP)


STEPS = [pytest.param(kind, place, marks=() if (kind, place) == ("metal", PLACES[0]) else pytest.mark.slow)
         for kind, place in itertools.product(MATERIALS, PLACES)]


@pytest.mark.parametrize("kind, roughness", STEPS)
def test_a_small_step_changes_little(kind, roughness, tmp_path):
    """No block changes by more than noise and a percent, the picture by 0.2 %; with equal random numbers most noise cancels."""
    before, after = (our_pictures_of("ball", kind, r, tmp_path) for r in (roughness, roughness + STEP))
    found = compare(after, before, allowance=0.01)
    print(f"step-{kind}-{roughness}: {found}")
    assert np.abs(found.z).max() < found.limit, f"{found}"
    assert found.ratio == pytest.approx(1, abs=0.002)


def our_pictures_of(shape, kind, roughness, folder):
    make_scene(shape, kind, roughness)
    return our_pictures(folder)
