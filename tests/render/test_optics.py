"""Light through glass and water against Fresnel's formulas."""

import numpy as np
import pytest
from scenes import (DOWN, Scene, at, box, check, diffuse, floor, fresnel, glass, grey, means, render, slab_transmittance,
                    sphere, sun_frame)
from sppm.scene_desc import ClosureDesc, ClosureFlags, ClosureType, LightType, Param

RHO = 0.5
IOR = 1.5


def under_plate(*closures, world=None):
    """A small floor under a wide closed plate, seen from between the two."""
    return Scene(world).add(floor(1), diffuse(RHO)).add(box((-2, -2, 0.5), (2, 2, 0.7)), *closures).above(0.4, 0.3)


# ---------------------------------------------------------------- plates


@pytest.mark.parametrize("theta", [0.0, 0.5, 1.0])
def test_sun_through_plate(theta):
    """What the plate lets through of a parallel beam, its inner reflections summed to the end."""
    scene = under_plate(glass(IOR)).light(LightType.SUN, sun_frame(theta), 3)
    found = means(scene, "Caustics", "Direct", iterations=8, photons_per_iteration=20000, initial_radius=0.1)
    check(found[:, 0], 3 * np.cos(theta) * RHO / np.pi * slab_transmittance(np.cos(theta), IOR))
    assert not found[:, 1].any()  # glass is not transparent for shadow rays


def transmitted_from_hemisphere():
    """The share of a constant environment's irradiance that a plate lets through: midpoint rule in cos^2."""
    return slab_transmittance(np.sqrt((np.arange(100000) + 0.5) / 100000), IOR).mean()


def test_sky_through_plate():
    """The floor near the origin sees the plate but for the directions below the plate's rim, at a distance of 2.7.

    Light that enters by the plate's rim meets its faces beyond the angle of total reflection, so none leaves through the lower
    face.
    """
    scene = Scene(world=1).add(floor(1), diffuse(RHO)).add(box((-3, -3, 0.02), (3, 3, 0.1)), glass(IOR)).above(0.015, 0.3)
    found = means(scene, "Caustics", iterations=16, photons_per_iteration=20000, initial_radius=0.1)
    check(found, RHO * transmitted_from_hemisphere(), bias=(0.02 / 2.7) ** 2 * 2)


def area_irradiance(height, half, transmittance=lambda cos: 1.0):
    """At the origin below a square lamp of radiance 1: midpoint rule."""
    x, y = np.meshgrid(*[(np.arange(400) + 0.5) / 400 * 2 * half - half] * 2)
    d2 = x**2 + y**2 + height**2
    return np.mean(height**2 / d2**2 * transmittance(height / np.sqrt(d2))) * (2 * half) ** 2


def test_a_lamp_mirrored_in_glass_has_no_noise():
    """By chance the path reflects once in 25 times; one path a pixel would scatter by five times the mean."""
    scene = Scene().add(box((-1, -1, -1), (1, 1, 0)), glass(IOR)).add(floor(0.9, z=-0.01), diffuse(0)).above(1, 0.01)
    scene.light(LightType.RECTANGLE, at(0, 0, 2), 10, size_x=2, size_y=2)
    picture = render(scene, "Combined", iterations=1)[..., :3]
    assert picture == pytest.approx(fresnel(1, IOR) * 10, rel=1e-3)


def test_a_lamp_mirrored_in_glass_that_lets_half_through():
    """Mixed with transparency glass mirrors half as much, whichever way the path goes on; beyond the depth limit it shows no lamp."""
    half = ClosureDesc(ClosureType.DIELECTRIC, color=Param(grey(0.5)), color2=Param(grey(0.5)), ior=IOR)
    clear = ClosureDesc(ClosureType.TRANSPARENT, color=Param(grey(0.5)))
    scene = Scene().add(box((-1, -1, -1), (1, 1, 0)), half, clear).add(floor(0.9, z=-0.01), diffuse(0)).above(1, 0.01)
    scene.light(LightType.RECTANGLE, at(0, 0, 2), 10, size_x=2, size_y=2)
    picture = render(scene, "Combined", iterations=1)[..., :3]
    assert picture == pytest.approx(0.5 * fresnel(1, IOR) * 10, rel=1e-3)
    assert not render(scene, "Combined", iterations=1, max_depth=1)[..., :3].any()


def test_camera_and_photons_see_the_same_plate():
    """A lit floor seen through a plate is dimmed as a floor lit through it: both by the transmittance at normal incidence."""
    t = slab_transmittance(1, IOR)
    lamp = dict(size_x=0.2, size_y=0.2)
    seen = Scene().add(floor(1), diffuse(RHO)).add(box((-2, -2, 0.5), (2, 2, 0.7)), glass(IOR)).above(0.9, 0.001)
    seen.light(LightType.RECTANGLE, at(0, 0, 0.4), 5, **lamp)
    check(means(seen, "Direct", iterations=64, photons_per_iteration=1), RHO / np.pi * 5 * area_irradiance(0.4, 0.1) * t)
    # A lamp far above, so that all its light comes at less than 0.01 from the normal and the plate's shift of the image is small:
    # the thickness d of glass brings the lamp nearer by d (1 - 1 / n).
    lit = under_plate(glass(IOR)).light(LightType.SPOT, at(0, 0, 30), 1000, angle=0.06)
    found = means(lit, "Caustics", iterations=4, photons_per_iteration=20000, initial_radius=0.1)
    check(found, RHO / np.pi * 1000 / (30 - 0.2 * (1 - 1 / IOR)) ** 2 * t, bias=2 * (0.3**2 * 2 / 3) / 30**2 + 1e-3)


@pytest.mark.parametrize("indirect", ["PHOTONS", "PATHS"])
@pytest.mark.parametrize(("roughness", "angle"), [(0.15, 0.0), (0.3, 0.0), (1.0, 0.0), (0.5, 0.02), (0.25, 0.17)])
def test_glossy_floor_sees_the_sun_through_a_plate(roughness, angle, indirect):
    """As it sees it without the plate, dimmed by what the plate lets through: by photons, by chance, or by both.

    Off by what the plate throws back of the floor's light, less than 0.08 of 0.05, and by how the transmittance changes over
    the sun.
    """
    color = Param(grey(0.05))
    satin = ClosureDesc(ClosureType.CONDUCTOR, color=color, color2=color, roughness=Param(grey(roughness)))
    settings = dict(iterations=32, photons_per_iteration=5000, initial_radius=0.1, indirect=indirect)
    open_air = Scene().add(floor(1), satin).light(LightType.SUN, DOWN, 3, angle=angle).above(0.4, 0.3)
    covered = Scene().add(floor(1), satin).add(box((-0.8, -0.8, 0.5), (0.8, 0.8, 0.6)), glass(IOR)).above(0.4, 0.3)
    covered.light(LightType.SUN, DOWN, 3, angle=angle)
    expected = means(open_air, "Combined", **settings).mean() * slab_transmittance(1, IOR)
    check(means(covered, "Combined", **settings), expected, precision=0.02, bias=0.006)


def test_refraction_only_loses_nothing():
    scene = under_plate(glass(IOR, flags=ClosureFlags.REFRACTION_ONLY)).light(LightType.SUN, DOWN, 3)
    check(means(scene, "Caustics", iterations=8, photons_per_iteration=20000, initial_radius=0.1), 3 * RHO / np.pi)


@pytest.mark.parametrize("ior", [1.0, 1.01])
@pytest.mark.parametrize("roughness", [0.3, 0.6, 1.0])
def test_glass_that_hardly_bends_lets_light_through_whoever_finds_it(ior, roughness):
    """However rough: what goes through is bent by facets in proportion to ior - 1, so no path would meet a lamp without size."""
    scene = under_plate(glass(ior, roughness)).light(LightType.POINT, at(0, 0, 2), 3)
    settings = dict(iterations=8, photons_per_iteration=20000, initial_radius=0.1)
    by_photons, by_paths = (means(scene, "Combined", indirect=indirect, **settings) for indirect in ("PHOTONS", "PATHS"))
    assert by_photons.mean() > 0.1
    check(by_paths, by_photons.mean(), bias=0.02)


@pytest.mark.parametrize("roughness", [0.02, 0.15])
def test_slightly_rough_plate_is_nearly_smooth(roughness):
    """Facets tilted by up to a few times alpha = roughness^2 <= 0.0225 change R, flat at normal incidence, by alpha^2."""
    scene = under_plate(glass(IOR, roughness)).light(LightType.SUN, DOWN, 3)
    found = means(scene, "Caustics", iterations=8, photons_per_iteration=20000, initial_radius=0.1)
    check(found, 3 * RHO / np.pi * slab_transmittance(1, IOR), bias=4 * roughness**4)


@pytest.mark.parametrize("roughness", [0.0, 0.1, 0.5, 1.0])
def test_nothing_is_gained_in_an_environment(roughness):
    """A glass ball in an even environment is invisible where it is smooth; where it is rough, single scattering loses a share."""
    scene = Scene(world=1).add(sphere(1, divisions=3), glass(IOR, roughness)).camera(at(0, 0, 3), 0.2)
    found = means(scene, "Combined", iterations=64, photons_per_iteration=1, max_depth=1024)
    if roughness < 0.3:
        check(found, 1, bias=roughness**2)
    else:
        assert 0 < found.mean() < 1


@pytest.mark.parametrize("roughness", [0.1, 0.3, 0.6, 1.0])
def test_rough_glass_gives_its_energy_back(roughness):
    """With PRESERVE_ENERGY a glass ball in an even environment is invisible at any roughness.

    The albedo is tabulated (16 cosines and roughnesses, 256 samples each); a path through the ball uses it some four times.
    """
    material = glass(IOR, roughness, ClosureFlags.PRESERVE_ENERGY)
    scene = Scene(world=1).add(sphere(1, divisions=3), material).camera(at(0, 0, 3), 0.2)
    found = means(scene, "Combined", iterations=64, photons_per_iteration=1, max_depth=1024)
    check(found, 1, bias=0.02)


# ---------------------------------------------------------------- water


def test_sun_in_a_pool():
    """One sheet of water over a floor: in with T, out with T / n^2; then what the sheet throws back of the floor's light.

    The sheet reflects the share F of diffuse light from below, so all photons after those of the sun itself make
    k / (1 - k), k = rho F, of it. Beyond the pool's edge light is lost: at most the share cos^2 of the directions that go there.
    """
    ior, rho, depth, half = 1.33, 0.3, 0.04, 1.2
    cos = np.sqrt((np.arange(100000) + 0.5) / 100000)
    k = rho * fresnel(cos, 1 / ior).mean()
    t = 1 - fresnel(1, ior)
    scene = Scene().add(floor(half), diffuse(rho)).add(floor(half, depth), glass(ior)).light(LightType.SUN, DOWN, 3)
    scene.above(0.5, 0.2)
    found = means(scene, "Caustics", "Indirect", iterations=16, photons_per_iteration=20000, initial_radius=0.1, max_depth=64)
    expected = 3 * t * rho / np.pi * t / ior**2
    lost = (2 * depth / np.hypot(2 * depth, half - 0.3)) ** 2 * rho / k
    check(found[:, 0], expected)
    check(found[:, 1], expected * k / (1 - k), precision=0.015, bias=2 * lost)
