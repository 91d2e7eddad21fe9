"""Caustics against a light tracer that shares nothing with the renderer, and caustics that are seen in mirrors and through glass.

Blocks of the floor are compared one by one: the largest deviation is one that happens by chance in one of a thousand such tests.
"""

import caustic_scenes
import light_tracer as tracer
import numpy as np
import pytest
from caustic_scenes import (CASTERS, DETAILED, FLOOR, QUICK, RHO, SOURCES, compare, floor_irradiance, irradiance,
                            point_lamp)
from scenes import (Scene, box, check, diffuse, floor, fresnel, glass, look_at, mirror, quad, slab_transmittance,
                    student_limit)

EVERY = [(source, caster) for caster in CASTERS for source in SOURCES]
FAST = [(source, "glass ball") for source in SOURCES] + [("point lamp", "mirror ring"), ("sun", "water sheet")]


def assert_agrees(found, precision):
    """Block by block, and in the whole flux, whose standard error must be at most `precision`."""
    limit = student_limit(found.expected.size, len(found.found) - 1)
    assert found.deviations().max() < limit
    ratio, error = found.ratio()
    assert error < precision
    allowed = student_limit(1, len(found.found) - 1) * error + found.blur.sum() / found.expected.sum()
    assert abs(ratio - 1) < allowed, f"the flux is {ratio:.4f} of what was traced, allowed is 1 +- {allowed:.4f}"


@pytest.mark.parametrize("source, caster", FAST)
def test_caustic_is_where_light_lands(source, caster):
    found = compare(SOURCES[source], CASTERS[caster], **QUICK)
    assert_agrees(found, precision=0.015)


@pytest.mark.slow
@pytest.mark.parametrize("source, caster", EVERY)
def test_caustic_is_where_light_lands_in_detail(source, caster):
    """Finer blocks, a smaller radius, thirteen times the light; of a sky, which lights more than is looked at, twice that."""
    settings = DETAILED | (dict(iterations=2 * DETAILED["iterations"], rays=2 * DETAILED["rays"]) if source == "sky" else {})
    assert_agrees(compare(SOURCES[source], CASTERS[caster], **settings), precision=0.005)


def test_the_test_finds_a_wrong_index():
    """Glass of 1.5 is not glass of 1.47."""
    found = compare(point_lamp(), CASTERS["glass ball"], **QUICK)
    other = caustic_scenes.traced(point_lamp(), caustic_scenes.ball(ior=1.47), 0.45, 8, 0.015, 300_000)
    wrong = caustic_scenes.Comparison(found.found, *other)
    assert wrong.deviations().max() > 2 * student_limit(64, 11)


# ---------------------------------------------------------------- seen indirectly


def pictures_of(scene, seeds=12, **settings):
    return floor_irradiance(scene, seeds, search=0.02, **dict(iterations=3, photons_per_iteration=30_000) | settings)


def assert_same_picture(found, expected, blocks=4):
    """Two sets of pictures, one a seed, agree block by block and in the mean."""
    size = found.shape[1] // blocks
    differences = (found - expected).reshape(-1, blocks, size, blocks, size).mean((2, 4))
    error = differences.std(0, ddof=1) / np.sqrt(len(differences))
    assert (abs(differences.mean(0)) / error).max() < student_limit(blocks**2, len(differences) - 1)
    check(found.mean((1, 2)), expected.mean(), precision=0.01, bias=0.01)  # the bias: noise of `expected`


def ring_scene():
    """A ring so low that its floor is seen from all sides."""
    scene = Scene().add(floor(FLOOR), diffuse(RHO))
    caustic_scenes.ring(0.5, height=0.25).add_to(scene)
    point_lamp().add_to(scene)
    return scene


def test_caustic_seen_in_a_mirror():
    """As from the mirrored place, the mirror clipped away, times its reflectance; left and right are swapped.

    The mirror stays in the scene in both, for it throws light too.
    """
    wall, reflectance = 1.2, 0.8
    facing = quad([(-1, wall, 0.02), (-1, wall, 2), (1, wall, 2), (1, wall, 0.02)])
    scene = ring_scene().add(facing, mirror(reflectance))
    behind = np.array([0.0, 2.7, 2.5])
    straight = pictures_of(scene.camera(look_at(behind, (0, 0, 0)), 0.1, 32, clip_near=2.6))
    through = behind * [1, -1, 1] + [0, 2 * wall, 0]
    seen = pictures_of(scene.camera(look_at(through, (0, 2 * wall, 0)), 0.1, 32))
    assert_same_picture(seen[:, :, ::-1], straight * reflectance)


def test_caustic_seen_through_glass():
    """As from below the plate, times its transmittance."""
    scene = ring_scene().add(box((-0.6, -0.6, 0.6), (0.6, 0.6, 0.7)), glass())
    below = pictures_of(scene.above(0.55, 0.45, size=32))
    above = pictures_of(scene.above(0.75, 0.45, size=32))
    assert_same_picture(above, below * slab_transmittance(1, 1.5))


def seen_through(sheet, lamp, half, blocks, search, rays, eyes=200_000, cells=90):
    """Blocks of a picture that looks straight down through waves, as irradiance of an open floor, and what blur may change.

    Eye rays are bent at the sheet and look up what the tracer has found on the floor; L / n^2 is what an interface keeps.
    """
    places, watts = tracer.caustic(lamp, (sheet.surface,), sheet.center, sheet.radius, rays)
    rng = np.random.default_rng(2)
    eye = np.concatenate([(rng.random((eyes, 2)) - 0.5) * 2 * half, np.full((eyes, 1), 2.0)], axis=1)
    down = np.broadcast_to([0.0, 0.0, -1.0], eye.shape)
    point = eye + sheet.surface.distance(eye, down)[:, None] * down
    normal, ior = sheet.surface.normal(point), sheet.surface.matter.ior
    cos = normal[:, 2:]
    bent = down / ior + (cos / ior - np.sqrt(1 - (1 - cos**2) / ior**2)) * normal
    on_floor = (point - point[:, 2:] / bent[:, 2:] * bent)[:, :2]
    kept = (1 - fresnel(cos[:, 0], ior)) / ior**2

    def picture(shift):
        lit = irradiance(places + shift, watts, 1.5 * half, cells)
        column, row = ((on_floor / (3 * half) + 0.5) * cells).astype(int).T
        area_of_block = (2 * half / blocks) ** 2
        return irradiance(eye[:, :2], kept * lit[row, column], half, blocks) * area_of_block * blocks**2 / eyes

    exact = picture(0.0)
    wide = search + 3 * half / cells  # the cells of the look-up blur as well
    shift = tracer.in_disk(rng, len(places))
    return exact, np.max([abs(picture(r * shift) - exact) for r in (wide / 2, wide)], axis=0)


def test_caustic_of_waves_seen_through_them():
    """Light and eye pass the same sheet of water."""
    sheet, source, half, blocks = CASTERS["water sheet"], SOURCES["sun"], 0.4, 8
    scene = caustic_scenes.scene_of(source, sheet, 64, half).above(0.9, half, size=64)
    found = np.array([caustic_scenes.blocks_of(p, blocks) for p in pictures_of(scene, photons_per_iteration=120000)])
    exact, blur = seen_through(sheet, source.lamp, half, blocks, search=0.02, rays=600_000)
    error = np.full_like(exact, 0.02 * exact.mean())  # of the tracer: some 2,600 rays a block
    assert_agrees(caustic_scenes.Comparison(found, exact, error, blur), precision=0.01)
