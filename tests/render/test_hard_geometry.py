"""Geometry that renderers go wrong on: far, tiny and huge scenes, nested glass, coincident, degenerate, very many triangles."""

import time

import numpy as np
import pytest
from scenes import (DOWN, Scene, at, box, check, diffuse, emission, floor, glass, look_at, means, quad, render, render_all,
                    sphere, sun_frame)
from sppm import native
from sppm.scene_desc import LightType
from sppm.scene_validation import SceneError

RHO = 0.5
DEEP = 1024  # vertices of a path: as good as endless
LENGTHS = ("Depth", "Radius", "Position")  # passes in metres


def placed(shape, scale, move):
    """The shape times `scale`, moved, rounded once."""
    return (shape[0].astype(np.float64) * scale + move).astype(np.float32), shape[1]


def room(scale=1.0, move=(0.0, 0.0, 0.0)):
    """Direct light, indirect light and a caustic; the picture does not depend on `scale` and `move`."""
    scene = Scene().add(placed(box((-1, -1, -1), (1, 1, 1)), scale, move), diffuse(0.6))
    scene.add(placed(sphere(0.35, (0.1, 0.2, -0.5), divisions=3), scale, move), glass())
    lamp, view = at(0, 0, 0.95), look_at((0, -0.95, 0.1), (0, 0.4, -0.4))
    for frame in (lamp, view):
        frame[:, 3] = frame[:, 3] * scale + move
    scene.light(LightType.RECTANGLE, lamp, 3, size_x=0.4 * scale, size_y=0.4 * scale)
    return scene.camera(view, 0.8, 24, clip_near=1e-4 * scale, clip_far=1e3 * scale)


def render_room(radius_rule="DENSITY", **where):
    return render_all(room(**where), photons_per_iteration=4000, radius_rule=radius_rule)


def inward(shape):
    """The inner surface of something hollow."""
    return shape[0], shape[1][:, ::-1].copy()


# ---------------------------------------------------------------- scale and place


@pytest.mark.parametrize("exponent", [-14, -7, 7, 14, 30])
def test_scale_by_a_power_of_two_changes_no_bit(exponent):
    """From 6e-5 to 1e9: nothing anywhere depends on the unit of length."""
    wanted, found = render_room(), render_room(scale=2.0**exponent)
    for name, picture in found.items():
        assert np.array_equal(picture / (2.0**exponent if name in LENGTHS else 1.0), wanted[name]), name


@pytest.mark.parametrize("scale", [1e-4, 1e-2, 1e2, 1e4])
def test_scale_changes_only_roundings(scale):
    """A rounding sends a path elsewhere now and then, no more: of a picture 0.1 %.

    With radii that depend on what was found around, a photon elsewhere would move those of half the picture.
    """
    wanted, found = render_room("PASS_INDEXED"), render_room("PASS_INDEXED", scale=scale)
    for name, picture in found.items():
        picture = picture / (scale if name in LENGTHS else 1.0)
        assert np.abs(picture - wanted[name]).mean() <= 1e-3 * np.abs(wanted[name]).mean(), name


@pytest.mark.parametrize("scale", [1e-4, 1e-2, 1e2, 1e4])
def test_scale_keeps_the_means(scale):
    wanted, found = render_room(), render_room(scale=scale)
    for name in ("Combined", "Direct", "Indirect", "Caustics"):
        assert found[name].mean() == pytest.approx(wanted[name].mean(), rel=2e-3), name


@pytest.mark.parametrize(("distance", "bound"), [(10, 1e-3), (1e2, 5e-3), (1e3, 0.02), (1e4, 0.1)])
def test_far_from_the_origin(distance, bound):
    """A room of 2 m: at 1e4 m single precision knows places to a millimetre, and rays start 2 cm clear of surfaces."""
    wanted = render_room()["Combined"][..., :3]
    found = render_room(move=(distance, -distance / 2, distance / 3))["Combined"][..., :3]
    assert found.mean() == pytest.approx(wanted.mean(), rel=bound)


@pytest.mark.parametrize("distance", [1e5, 1e6])
def test_too_far_from_the_origin(distance):
    """Coordinates are off by 8 mm and 6 cm: no picture of the room, but an end without NaN. (The exporter moves such scenes.)"""
    render_room(move=(distance, -distance / 2, distance / 3))


@pytest.mark.parametrize("edge", [1e-12, 1e-6, 1e6, 1e10])
@pytest.mark.parametrize("kind", ["lit", "emitting"])
def test_one_triangle_of_any_size(edge, kind):
    """Squares and products of edges leave the range of floats long before the edges do."""
    shape = np.array([(-edge, -edge, 0), (edge, -edge, 0), (0, edge, 0)], np.float32), np.array([[0, 1, 2]], np.uint32)
    scene = Scene(world=1.0).add(shape, diffuse(RHO), *([emission(1)] if kind == "emitting" else []))
    scene.camera(at(0, 0, edge), 0.2, clip_near=edge * 1e-3, clip_far=edge * 10)
    found = render_all(scene, iterations=16)
    assert np.allclose(found["Normal"], (0, 0, 1), atol=1e-4)
    # An even sky: each sample has the same value but for the power heuristic between the two ways to take it.
    assert found["Combined"][..., :3].mean() == pytest.approx(RHO + (kind == "emitting"), rel=0.03)


def test_emitting_triangle_of_any_size_gives_light():
    """A lamp of side s at height s above the floor, for all s."""
    values = []
    for size in (1e-9, 1e-3, 1.0, 1e6):
        lamp = quad([(-size, -size, size), (size, -size, size), (size, size, size), (-size, size, size)])
        scene = Scene().add(floor(5 * size), diffuse(RHO)).add(lamp, emission(2))
        scene.camera(at(0, 0, size / 2), 1e-3, clip_near=size * 1e-3, clip_far=size * 9)
        values.append(means(scene, "Direct", iterations=16))
    assert values[2].mean() > 0.1
    for found in values:
        assert found.mean() == pytest.approx(values[2].mean(), rel=0.01)


# ---------------------------------------------------------------- glass in glass


def through(scene, max_depth=DEEP, **camera):
    """Radiance from above, in an even sky of radiance 1: what absorbs nothing shows nothing."""
    scene.camera(at(0, 0, 3), 0.3, 24, **camera)
    return render_all(scene, iterations=16, photons_per_iteration=100, max_depth=max_depth)["Combined"][..., :3]


def sky():
    return Scene(world=1)


def drink(radius, shape):
    """Ice in water in a hollow glass whose inner radius is 0.9."""
    scene = sky().add(shape(1.0), glass(1.5)).add(inward(shape(0.9)), glass(1.5)).add(shape(radius), glass(1.33))
    return scene.add(shape(0.4), glass(1.31))


def ball(radius):
    return sphere(radius, divisions=3)


def block(half):
    return box((-half,) * 3, (half,) * 3)


@pytest.mark.parametrize("shape", [ball, block])
@pytest.mark.parametrize("radius", [0.89, 0.9, 0.91], ids=["gap", "touching", "overlapping"])
def test_ice_in_water_in_glass(shape, radius):
    """Where water and glass touch, light that is reflected three times between the same two faces skips one: below 1 %.

    Of a path that is trapped inside for 1024 vertices the rest is lost: in the balls, 0.2 %.
    """
    picture = through(drink(radius, shape))
    assert abs(picture.mean() - 1) < 0.01
    assert picture.max() < 1.2


@pytest.mark.parametrize("gap", [-1e-3, 0.0, 1e-3], ids=["overlapping", "touching", "gap"])
@pytest.mark.parametrize("low_ior", [1.33, 1.5])
def test_stacked_blocks(gap, low_ior):
    scene = sky().add(box((-1, -1, -1), (1, 1, 0)), glass(low_ior)).add(box((-1, -1, gap), (1, 1, 1)), glass(1.5))
    assert abs(through(scene).mean() - 1) < 2e-3


@pytest.mark.parametrize("copies", [2, 3])
def test_glass_in_the_same_place_several_times(copies):
    scene = sky()
    for _ in range(copies):
        scene.add(box((-1, -1, -1), (1, 1, 0)), glass(1.5))
    assert abs(through(scene).mean() - 1) < 0.01 * copies


@pytest.mark.parametrize("gap", [-1e-3, 0.0, 1e-3], ids=["sunken", "standing", "hovering"])
def test_glass_block_on_a_floor_hides_no_floor(gap):
    """Nothing shines below the floor, and below it all is bright: no path through the block may miss the floor."""
    scene = Scene(world=1).add(floor(5), diffuse(0)).add(box((-1, -1, gap), (1, 1, 0.5)), glass(1.5)).camera(at(0, 0, 3), 0.2, 16)
    picture = render(scene, "Combined", iterations=64, photons_per_iteration=1)[..., :3]
    # What is left is the sky reflected by the block's top and seen through its sides.
    assert picture.max() < 0.3


def test_transparent_sheet_on_a_floor_hides_no_floor():
    sheet = floor(1)
    clear = glass(1.0)
    scene = Scene(world=1).add(floor(5), diffuse(0)).add(sheet, clear).camera(at(0, 0, 3), 0.2, 16)
    assert not render(scene, "Combined", iterations=16)[..., :3].any()


@pytest.mark.parametrize("z", [0.0, 0.9, 0.999999, 1.0])
def test_camera_in_glass(z):
    """At the centre, near and exactly on the surface of a block: inside, the sky is n^2 times as bright where it is seen."""
    scene = Scene(world=1).add(block(1.0), glass(1.5)).camera(at(0, 0, z), 0.2, clip_near=0)
    picture = render_all(scene, iterations=256, max_depth=DEEP)["Combined"][..., :3]
    inside, outside = 1.5**2, 1.0
    if z < 1:
        assert picture.mean() == pytest.approx(inside, rel=0.02)
    else:
        assert outside - 0.05 < picture.mean() < inside + 0.05


def test_lit_floor_in_glass_with_the_camera():
    """All within one medium: whatever its index, lamp, floor and camera see the same as without it."""
    def scene():
        return Scene().add(floor(1), diffuse(RHO)).light(LightType.SPOT, at(0, 0, 0.9), 3, angle=0.5)

    view = dict(x=0.0, size=8)
    wanted = means(scene().above(0.8, 0.1, **view), "Direct", iterations=8, photons_per_iteration=1)
    found = means(scene().add(box((-2, -2, -2), (2, 2, 2)), glass(1.5)).above(0.8, 0.1, **view), "Direct", iterations=8,
                  photons_per_iteration=1)
    check(found, wanted.mean())


@pytest.mark.parametrize("max_depth", [1, 2, 24, DEEP])
def test_total_reflection_to_the_last_vertex(max_depth):
    """Along its diagonal no light leaves a cube of glass, ever; photons of a lamp in it run as long."""
    scene = Scene(world=1).add(block(1.0), glass(1.5)).light(LightType.POINT, at(0.3, 0.2, 0.1), 1)
    scene.camera(look_at((0.1, 0.05, 0), (1.1, 1.05, 1)), 0.05)
    # Now and then a rounding in a corner of the cube lets one out.
    assert render_all(scene, max_depth=max_depth, photons_per_iteration=200)["Combined"][..., :3].mean() < 0.01


def test_light_guide():
    """Light runs down a thin rod of glass by total reflection, some forty times, and loses nothing: the sky comes out."""
    scene = Scene(world=1).add(box((-0.05, -0.05, -4), (0.05, 0.05, 0)), glass(1.5)).camera(at(0, 0, 0.06), 0.6, 24)
    assert render_all(scene, iterations=64, max_depth=DEEP)["Combined"][..., :3].mean() == pytest.approx(1, rel=1e-3)


# ---------------------------------------------------------------- grazing


@pytest.mark.parametrize("elevation", [1e-2, 1e-4, 1e-6])
def test_sun_at_the_horizon(elevation):
    scene = Scene().add(floor(5), diffuse(RHO)).above(1, 1e-4).light(LightType.SUN, sun_frame(np.pi / 2 - elevation), 3)
    # The direction itself is rounded to 6e-8.
    check(means(scene, "Direct", photons_per_iteration=1), 3 * elevation * RHO / np.pi, bias=1e-7 / elevation)


@pytest.mark.parametrize("height", [1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("closure", [diffuse(RHO), glass(1.5)], ids=["diffuse", "glass"])
def test_camera_along_a_floor(height, closure):
    """A view flat over the floor, in an even sky: half of it above the horizon."""
    scene = Scene(world=1).add(floor(1), closure).camera(look_at((-0.9, 0, height), (0, 0, height)), 0.2, 16, clip_near=1e-7)
    picture = render_all(scene, iterations=64, max_depth=DEEP)["Combined"][..., :3]
    assert 0.05 < picture.min() and picture.max() < 2.3  # an open sheet of glass: its other side is inside of it


# ---------------------------------------------------------------- bad triangles


@pytest.mark.parametrize("closure", [diffuse(0.6), glass(1.5), emission(3)], ids=["diffuse", "glass", "emitting"])
def test_triangles_without_area_are_nothing(closure):
    """A point, an edge there and back, and three vertices on a line, all within view."""
    positions = np.array([(0, 0, 0.5), (0.2, 0.1, 0.5), (-0.2, -0.1, 0.5)], np.float32)
    nothing = positions, np.array([[0, 0, 0], [0, 1, 0], [1, 2, 0], [1, 1, 2]], np.uint32)
    def scene():
        return Scene().add(floor(1), diffuse(RHO)).light(LightType.POINT, at(0, 0, 1), 1).above(0.9, 0.5)

    wanted, found = render_all(scene()), render_all(scene().add(nothing, closure))
    for name in ("Combined", "Depth", "Normal"):
        assert np.array_equal(found[name], wanted[name]), name


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_vertex_that_is_not_finite_is_refused_by_name(value):
    shape = floor(1)
    shape[0][2, 1] = value
    with pytest.raises(SceneError, match="mesh 1.*positions.*not finite"):
        native.Scene(Scene().add(shape, diffuse(RHO)).above(1, 0.5).desc)


@pytest.mark.parametrize("value", [1e17, 1e19, 1e30, 3e38])
@pytest.mark.parametrize("closure", [diffuse(0.6), emission(3)], ids=["diffuse", "emitting"])
def test_vertex_at_the_end_of_the_world(value, closure):
    """Finite, but its square is not: the rest of the scene is rendered."""
    shape = np.array([(2, 0, 0), (3, 0, 0), (2, value, 0)], np.float32), np.array([[0, 1, 2]], np.uint32)
    scene = Scene(world=1).add(floor(1), diffuse(RHO)).add(shape, closure).light(LightType.POINT, at(0, 0, 1), 1)
    scene.light(LightType.SUN, DOWN, 1)
    picture = render_all(scene.above(0.9, 0.5))["Combined"][..., :3]
    assert 0.4 < picture.mean() < 2


def test_coincident_diffuse_faces_are_one():
    """Twice the same floor, and two floors of other triangles in the same plane."""
    one = Scene().add(floor(1), diffuse(RHO)).light(LightType.POINT, at(0, 0, 1), 1).above(0.9, 0.5)
    wanted = render(one, "Combined", iterations=16)[..., :3]
    for second in (floor(1), floor(3)):
        scene = Scene().add(floor(1), diffuse(RHO)).add(second, diffuse(RHO))
        scene.light(LightType.POINT, at(0, 0, 1), 1).above(0.9, 0.5)
        assert np.allclose(render(scene, "Combined", iterations=16)[..., :3], wanted, rtol=1e-4)


def test_smooth_shading_leaves_no_black_rims():
    """Where a coarse ball's interpolated normals face away from the camera it is lit all the same: nearly evenly by the sky."""
    shape = sphere(1, divisions=1)
    scene = Scene(world=1.0).add(shape, diffuse(RHO), normals=shape[0]).camera(at(0, 0, 4), 0.3, 32)
    found = render_all(scene, iterations=32, indirect="PATHS", transparent_film=True, pixel_filter="BOX", filter_width=0.01)
    ball = found["Combined"][found["Combined"][..., 3] == 1][:, :3]
    assert len(ball) > 300
    assert ball.min() > 0.6 * RHO


@pytest.mark.slow
def test_ten_million_triangles():
    """Measured: 6 s on 2 cores and 139 bytes a triangle: 64 are its facet, 18 its corners and its share of the vertices; the
    rest is the BVH.
    """
    n = 2238
    x, y = np.meshgrid(np.linspace(-1, 1, n), np.linspace(-1, 1, n))
    positions = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    a, b, c, d = corner, corner + 1, corner + n + 1, corner + n
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.uint32)
    scene = Scene().add((positions, triangles), diffuse(RHO)).light(LightType.POINT, at(0, 0, 1), 1).above(0.9, 0.5, size=64)
    started = time.monotonic()
    with native.Scene(scene.desc) as built:
        info, seconds = built.info(), time.monotonic() - started
    print(f"{info['triangle_count']} triangles: {seconds:.1f} s, {info['memory_bytes'] / 2**20:.0f} MB")
    assert info["triangle_count"] == 2 * (n - 1) ** 2 > 1e7
    assert seconds < 90 and info["memory_bytes"] < 164 * info["triangle_count"]
    flat = Scene().add(floor(1), diffuse(RHO)).light(LightType.POINT, at(0, 0, 1), 1).above(0.9, 0.5, size=64)
    assert np.allclose(render(scene, "Direct"), render(flat, "Direct"), rtol=1e-3)
