"""Radiance and power against closed forms: furnaces, lamps, powers."""

import numpy as np
import pytest
from scenes import (DOWN, SIGMAS, Scene, area, at, box, check, diffuse, emission, floor, glass, grey, means, quad, render, sphere,
                    sun_frame)
from sppm import native, scene_desc
from sppm.scene_desc import LightFlags, LightType

RHO = 0.6
DEEP = 1024  # vertices of a path: as good as endless


# ---------------------------------------------------------------- furnaces


@pytest.mark.parametrize("albedo", [0.2, 0.5, 0.8])
def test_furnace(albedo):
    """A closed box of walls that emit 1 and reflect `albedo` holds 1 / (1 - albedo): emission, one and many reflections."""
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(albedo), emission(1)).camera(at(0, 0, 0), 0.3)
    found = means(scene, "Combined", "Direct", "Indirect", "Caustics", iterations=8, photons_per_iteration=30000, max_depth=DEEP,
                  initial_radius=0.3)
    check(found[:, 0], 1 / (1 - albedo))
    check(found[:, 1], 1 + albedo)
    check(found[:, 2], albedo**2 / (1 - albedo), precision=0.015)
    assert not found[:, 3].any()


def test_furnace_with_glass_ball():
    """Glass that absorbs nothing changes no radiance in a furnace, seen from the wall's side or through the ball."""
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(0.5), emission(1))
    ball = sphere(0.5, divisions=3)
    scene.add(ball, glass(1.5)).camera(at(0, 0, 0.9), 0.2)
    check(means(scene, "Combined", iterations=8, photons_per_iteration=5000, max_depth=DEEP, initial_radius=0.3), 2)


@pytest.mark.parametrize("albedo", [0.3, 0.7])
def test_sphere_lit_from_its_centre(albedo):
    """All power ends in the wall: its irradiance is 4 pi I / (area (1 - albedo)), the same at all points of a sphere.

    Of the sphere's 8192 flat triangles no point is off by more than the corners are: (R / distance)^3 - 1 of the largest.
    """
    shape = sphere(2, divisions=5)
    a, b, c = shape[0][shape[1]].transpose(1, 0, 2)
    tessellation = (2 / np.linalg.norm((a + b + c) / 3, axis=1)).max() ** 3 - 1
    scene = Scene().add(shape, diffuse(albedo)).light(LightType.POINT, DOWN, 7).camera(at(0.1, 0.2, 0.3), 0.5)
    found = means(scene, "Combined", iterations=8, photons_per_iteration=10000, max_depth=DEEP, initial_radius=0.5)
    check(found, 4 * 7 * albedo / (area(*shape) * (1 - albedo)), bias=tessellation)


# ---------------------------------------------------------------- lamps on a floor


def lit_floor(x=0.0):
    """A floor seen at the point (x, 0) alone."""
    return Scene().add(floor(5), diffuse(RHO)).above(1, 1e-4, x)


def direct(scene, iterations=64):
    return means(scene, "Direct", iterations=iterations, photons_per_iteration=1)


@pytest.mark.parametrize("radius", [0.0, 0.5])
@pytest.mark.parametrize("x", [0.0, 1.5])
def test_point_lamp(radius, x):
    """A sphere that shines evenly lights a floor that sees all of it as the point at its centre does."""
    d2 = x * x + 4
    found = direct(lit_floor(x).light(LightType.POINT, at(0, 0, 2), 10, radius=radius))
    check(found, 10 * RHO / np.pi * (2 / np.sqrt(d2)) / d2)


@pytest.mark.parametrize("radius", [0.0, 0.1])
def test_spot_inside_its_cone(radius):
    found = direct(lit_floor(0.5).light(LightType.SPOT, at(0, 0, 2), 10, angle=1.2, radius=radius))
    check(found, 10 * RHO / np.pi * 2 / 4.25**1.5)


@pytest.mark.parametrize("flags", [LightFlags.NONE, LightFlags.SPOT_COSINE])
def test_spot_in_its_soft_edge(flags):
    cosine, half = 2 / np.sqrt(4.25), np.cos(0.3)
    t = (cosine - half) / ((1 - half) * 0.9)
    factor = t * t * (3 - 2 * t) * (cosine if flags else 1)
    found = direct(lit_floor(0.5).light(LightType.SPOT, at(0, 0, 2), 10, angle=0.6, blend=0.9, flags=flags))
    check(found, 10 * RHO / np.pi * 2 / 4.25**1.5 * factor)


def test_spot_outside_its_cone():
    assert not direct(lit_floor(1.5).light(LightType.SPOT, at(0, 0, 2), 10, angle=1.2)).any()


@pytest.mark.parametrize("angle", [0.0, 0.01, 0.6])
@pytest.mark.parametrize("theta", [0.0, 1.0])
def test_sun(angle, theta):
    found = direct(lit_floor().light(LightType.SUN, sun_frame(theta), 3, angle=angle))
    check(found, 3 * np.cos(theta) * RHO / np.pi)


def irradiance_of_area_lamp(x, height, size_x, size_y, ellipse):
    """Of radiance 1 on the floor at (x, 0), the lamp parallel to it above the origin: midpoint rule, a million points."""
    n = 1000
    u, v = np.meshgrid(*[(np.arange(n) + 0.5) / n] * 2)
    if ellipse:
        r, phi = np.sqrt(u), 2 * np.pi * v
        px, py, whole = r * np.cos(phi) * size_x / 2, r * np.sin(phi) * size_y / 2, np.pi * size_x * size_y / 4
    else:
        px, py, whole = (u - 0.5) * size_x, (v - 0.5) * size_y, size_x * size_y
    return whole * np.mean(height**2 / ((px - x) ** 2 + py**2 + height**2) ** 2)


@pytest.mark.parametrize("x", [0.0, 1.0])
@pytest.mark.parametrize("kind", [LightType.RECTANGLE, LightType.ELLIPSE])
def test_area_lamp(kind, x):
    found = direct(lit_floor(x).light(kind, at(0, 0, 0.7), 2, size_x=1.5, size_y=0.4))
    check(found, 2 * RHO / np.pi * irradiance_of_area_lamp(x, 0.7, 1.5, 0.4, kind == LightType.ELLIPSE))


def test_area_lamp_is_dark_behind():
    up = at(0, 0, 0.7) * np.array([1, 1, -1, 1])
    assert not direct(lit_floor().light(LightType.RECTANGLE, up, 2, size_x=1, size_y=1)).any()


@pytest.mark.parametrize("x", [0.0, 1.0])
def test_emitting_mesh_is_the_area_lamp(x):
    corners = [(-0.75, -0.2, 0.7), (0.75, -0.2, 0.7), (0.75, 0.2, 0.7), (-0.75, 0.2, 0.7)]
    scene = Scene().add(floor(5), diffuse(RHO)).add(quad(corners), emission(2)).above(0.5, 1e-4, x)
    check(direct(scene), 2 * RHO / np.pi * irradiance_of_area_lamp(x, 0.7, 1.5, 0.4, False))


def test_constant_world():
    check(direct(lit_floor_under(Scene(world=1.7))), 1.7 * RHO)


def lit_floor_under(scene):
    return scene.add(floor(5), diffuse(RHO)).above(1, 1e-4)


def test_light_that_samples_seldom_find():
    """A pixel that found no light in 16 iterations takes fewer samples; the mean stays that of iterations that take all.

    A plate hides the lamp but for a strip, a 64th of it, so that a third of the pixels are dark after 16 iterations of four.
    """
    scene = Scene().add(floor(5), diffuse(RHO)).light(LightType.RECTANGLE, at(0, 0, 2), 10, size_x=1, size_y=1)
    scene.add(quad(((-0.5 + 1 / 64, -1, 1.999), (1, -1, 1.999), (1, 1, 1.999), (-0.5 + 1 / 64, 1, 1.999))), diffuse(0)).above(1, 1e-4)
    short, long = (means(scene, "Direct", seeds=256, iterations=n, photons_per_iteration=1) for n in (16, 24))
    check(long, short.mean(), precision=0.02, bias=SIGMAS * short.std(ddof=1) / np.sqrt(len(short)) / short.mean())


def test_many_lamps_add_up():
    """Strong and weak, near and far: whichever is chosen for a sample, the sum is that of all."""
    scene = lit_floor_under(Scene(world=0.1)).light(LightType.SUN, sun_frame(0.5), 0.5, angle=0.1)
    for i, intensity in enumerate((1, 10, 100)):
        scene.light(LightType.POINT, at(0, 0, 1 + i), intensity)
    expected = RHO / np.pi * (1 + 10 / 4 + 100 / 9 + 0.5 * np.cos(0.5) + 0.1 * np.pi)
    check(direct(scene, iterations=256), expected)


# ---------------------------------------------------------------- powers

COLOR = (2.0, 3.0, 5.0)
LUMINANCE = float(np.dot(COLOR, (0.2126, 0.7152, 0.0722)))
BOUNDS_RADIUS2 = 1.0 + 4.0 + 9.0  # of the box from (-1, -2, -3) to (1, 2, 3)


def power(scene):
    scene.camera(at(0, 0, 9), 1)
    with native.Scene(scene.desc) as built:
        return built.info()["light_power"]


def test_power_of_lamps():
    scaled = np.diag([2.0, 3.0, 1.0, 1.0])[:3]
    half = np.cos(0.3)
    # The smoothstep has mean 1/2 over its edge, which takes the share `blend` of the cone's 1 - cos.
    for kind, expected, rest in (
        (LightType.POINT, 4 * np.pi, {"radius": 0.3}),
        (LightType.SPOT, 2 * np.pi * (1 - half), {"angle": 0.6}),
        (LightType.SPOT, 2 * np.pi * (1 - half) * (1 - 0.4 / 2), {"angle": 0.6, "blend": 0.4}),
        (LightType.SPOT, np.pi * (1 - half**2), {"angle": 0.6, "flags": LightFlags.SPOT_COSINE}),
        (LightType.RECTANGLE, np.pi * 0.5 * 0.25 * 6, {"size_x": 0.5, "size_y": 0.25, "transform": scaled}),
        (LightType.ELLIPSE, np.pi * np.pi / 4 * 0.5 * 0.25 * 6, {"size_x": 0.5, "size_y": 0.25, "transform": scaled}),
    ):
        transform = rest.pop("transform", DOWN)
        assert power(Scene().light(kind, transform, COLOR, **rest)) == pytest.approx(expected * LUMINANCE, rel=1e-5), (kind, rest)


def test_power_of_emitting_mesh():
    """Both sides of every triangle."""
    scene = Scene().add(box((-1, -2, -3), (1, 2, 3)), emission(4))
    assert power(scene) == pytest.approx(2 * np.pi * 4 * 2 * (8 + 12 + 24), rel=1e-5)


@pytest.mark.parametrize("angle", [0.0, 0.2])
def test_power_of_sun(angle):
    """What passes the bounding sphere, which the library makes 0.1 % larger than the box's.

    The strength is the irradiance of a plane that faces the sun; the light of a wide sun comes aslant to that plane, so more of
    it comes.
    """
    scene = Scene().add(box((-1, -2, -3), (1, 2, 3)), diffuse(0.5)).light(LightType.SUN, sun_frame(0.3), COLOR, angle=angle)
    aslant = 2 / (1 + np.cos(angle / 2))
    assert power(scene) == pytest.approx(np.pi * BOUNDS_RADIUS2 * 1.001**2 * LUMINANCE * aslant, rel=1e-5)


def test_power_of_world():
    scene = Scene(world=4).add(box((-1, -2, -3), (1, 2, 3)), diffuse(0.5))
    assert power(scene) == pytest.approx(4 * np.pi * 4 * np.pi * BOUNDS_RADIUS2 * 1.001**2, rel=1e-5)


def test_photons_carry_the_power_of_every_lamp():
    """In a closed box of albedo a without glass the photons' part has the power P a^2 / (1 - a) per area, whatever the lamp.

    Six cameras look at the six walls, whole. Along the four rims of a wall of side 2, where search disks of radius r reach beyond
    it, a strip as wide as r, the share 2 r of the wall, lacks 2 / (3 pi) of its photons, the mean of the disks' segments.
    """
    a, size, radius = 0.5, 64, 0.02
    for kind, rest, watts in (
        (LightType.POINT, {}, 4 * np.pi), (LightType.SPOT, {"angle": 1.0, "blend": 0.5}, 2 * np.pi * (1 - np.cos(0.5)) * 0.75),
        (LightType.RECTANGLE, {"size_x": 0.5, "size_y": 0.3}, np.pi * 0.15), (LightType.POINT, {"radius": 0.2}, 4 * np.pi),
    ):
        scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(a)).light(kind, at(0.2, 0.1, 0.3), 1, **rest)
        rows = []
        for seed in range(4):
            walls = []
            for axis in range(3):
                for sign in (-1, 1):
                    back = np.roll([sign, 0, 0], axis).astype(float)
                    right = np.roll(np.eye(3)[1], axis)
                    frame = np.stack([right, np.cross(back, right), back, 0 * back], axis=1)
                    scene.camera(frame, 1, size)
                    picture = render(scene, "Indirect", iterations=2, photons_per_iteration=10000, initial_radius=radius,
                                     indirect="PHOTONS", radius_rule="PROGRESSIVE", seed=seed, max_depth=DEEP,
                                     pixel_filter="BOX", filter_width=1.0)
                    walls.append(picture.mean())
            rows.append(np.mean(walls))
        check(rows, watts * a**2 / (1 - a) / np.pi / 24, bias=2 * radius * 2 / (3 * np.pi))


# ---------------------------------------------------------------- the split of light

SPLITS = [dict(indirect=indirect, aim_photons=aim) for indirect in ("PHOTONS", "PATHS") for aim in (False, True)]


@pytest.mark.parametrize("split", SPLITS, ids=lambda split: "-".join(map(str, split.values())))
@pytest.mark.parametrize("roughness", [0.0, 0.3, 0.37, 0.8])
def test_every_path_is_counted_once(split, roughness):
    """A furnace with a metal ball that reflects all: 1 / (1 - albedo) everywhere, whoever finds which light.

    The ball's rough reflection is shared between photons and paths by its roughness. Its energy is given back (16 x 16 table).
    """
    metal = scene_desc.ClosureDesc(scene_desc.ClosureType.CONDUCTOR, scene_desc.ClosureFlags.PRESERVE_ENERGY,
                                   roughness=scene_desc.Param(grey(roughness)))
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(0.5), emission(1)).add(sphere(0.5, divisions=3), metal)
    scene.camera(at(0, 0, 0.95), 0.3)
    found = means(scene, "Combined", iterations=8, photons_per_iteration=20000, max_depth=DEEP, initial_radius=0.05, **split)
    check(found, 2, precision=0.015, bias=0.01)
