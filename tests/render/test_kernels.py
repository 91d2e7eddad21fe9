"""The region in which a pixel gathers photons: where its surface ends, and where it is the pixel's own filter."""

import numpy as np
import pytest
from scenes import Scene, at, box, diffuse, emission, floor, glass, grey, look_at, quad, render, sphere
from sppm.scene_desc import ClosureDesc, ClosureType, LightType, Param, Projection


def blocks(picture, size):
    """Means of squares of size x size pixels."""
    n = len(picture) // size
    return picture.reshape(n, size, n, size).mean((1, 3))


@pytest.mark.parametrize("inner", [False, True], ids=["room", "block in it"])
def test_creases_take_no_light(inner):
    """In a furnace all indirect light is alike, also where a disk reaches over an inner or an outer edge."""
    albedo = 0.5
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(albedo), emission(1))
    if inner:
        scene.add(box((-0.4, 0.1, -0.4), (0.4, 0.7, 0.4)), diffuse(albedo), emission(1))
    # Three walls' corner, or three faces of the block before two walls.
    scene.camera(look_at((0.9, -0.9, 0.9), (-0.2, 0.3, -0.2)), 0.6 if inner else 0.9, 48)
    pictures = [render(scene, "Indirect", iterations=24, photons_per_iteration=8000, indirect="PHOTONS", seed=seed)[..., 0]
                for seed in range(4)]
    ratio = blocks(np.mean(pictures, 0), 4) / (albedo**2 / (1 - albedo))
    assert abs(ratio.mean() - 1) < 0.02  # it is 0.95 and 0.96 where disks count all of their area
    assert 0.85 < ratio.min() and ratio.max() < 1.1  # 0.67 and 0.75


def test_a_crease_within_pixels():
    """Pixels that see both walls of a corner have their light too: half of their points lie on the wall that a neighbour has."""
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(0.5), emission(1)).camera(look_at((0.9, -0.9, 0), (-0.2, 1, 0)), 0.9, 48)
    pictures = [render(scene, "Indirect", iterations=16, photons_per_iteration=6000, indirect="PHOTONS", seed=seed)[..., 0]
                for seed in range(2)]
    columns = np.mean(pictures, 0)[10:38].mean(0) / 0.5
    assert columns.min() > 0.92  # 0.81 where such points know of no crease


@pytest.mark.parametrize("opacity", [1, 0.5])
def test_sheets_that_end_before_a_wall(opacity):
    """Sheets 1.6 pixels wide in the middle of a closed room of even light, which they have as well; a ball has no brighter rim."""
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(0.5), emission(1))
    half = 0.8 * 0.8 * 2 * 0.9 / 48
    materials = [diffuse(0.5 * opacity), emission(opacity), ClosureDesc(ClosureType.TRANSPARENT, color=Param(grey(1 - opacity)))]
    for x in np.arange(-0.4, 0.41, 0.16):
        sheet = quad(((x - half, -0.1, 0), (x + half, -0.1, 0), (x + half, -0.1, 0.6), (x - half, -0.1, 0.6)))
        scene.add(sheet, *materials)
    ball = sphere(0.2, (0, -0.1, -0.3), divisions=4)
    normals = ((ball[0] - (0, -0.1, -0.3)) / 0.2).astype(np.float32)
    scene.add(ball, diffuse(0.5), emission(1), normals=normals).camera(look_at((0, -0.9, 0), (0, 0, 0)), 0.9, 48)
    pictures = [render(scene, "Indirect", iterations=24, photons_per_iteration=8000, indirect="PHOTONS", seed=seed)[..., 0]
                for seed in range(4)]
    ratio = np.mean(pictures, 0) / 0.5
    sheets = ratio[28:38].mean(0)  # a column of pixels sees the same part of a sheet; 0.59 to 0.75 where all of the disk counts
    assert abs(sheets.mean() - 1) < 0.02 and 0.85 < sheets.min() and sheets.max() < 1.15
    below = ratio[:20, 4:44]
    assert abs(below.mean() - 1) < 0.015 and below.reshape(5, 4, 10, 4).mean((1, 3)).max() < 1.12


def test_a_wall_that_ends_before_nothing():
    """Of its last whole row of pixels photons find as much as paths, but for what the row beyond, seen in part, takes."""
    scene = Scene().add(floor(1000), diffuse(0.8)).add(box((-2, 8, 0), (2, 9, 3)), diffuse(0.8)).light(LightType.POINT, at(0, 4, 3), 1000)
    scene.camera(look_at((0, 0, 0.001), (0, 10, 0.001)), 3, 24, projection=Projection.ORTHOGRAPHIC)
    photons, paths = (render(scene, "Indirect", iterations=iterations, photons_per_iteration=40000, indirect=indirect)[11:15, 6:18, 0]
                      for indirect, iterations in (("PHOTONS", 32), ("PATHS", 256)))
    found = photons.mean(1) / paths.mean(1)
    assert found[1] > 0.85 and found[0] > 0.8  # 0.73 and 0.69 where only what lies behind tells of the end
    assert found.max() < 1.05


def test_a_sheet_on_a_floor_that_goes_on_behind_it():
    """What lies beyond a crease counts neither as area nor as photons: the floor behind a thin wall is the same plane."""
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(0.5), emission(1))
    sheet = quad(((-0.6, 0.2, -1), (0.6, 0.2, -1), (0.6, 0.2, -0.2), (-0.6, 0.2, -0.2)))
    scene.add(sheet, diffuse(0.5), emission(1)).camera(look_at((0, -0.6, -0.4), (0, 0.2, -0.95)), 0.4, 32)
    pictures = [render(scene, "Indirect", iterations=24, photons_per_iteration=8000, indirect="PHOTONS", seed=seed)[..., 0]
                for seed in range(12)]
    ratio = np.mean(pictures, 0).mean(1) / 0.5  # a row of pixels sees the same distance from the foot
    assert 0.93 < ratio.min() and ratio.max() < 1.08  # 0.76 where the area counts, 1.18 where only photons do


def lit_through_a_pane(tilt):
    """A floor that a lamp above a pane of glass lights: all of its light counts as caustic, and none of it has an edge."""
    scene = Scene().add(floor(3), diffuse(0.6)).add(box((-0.2, -0.2, 1), (0.2, 0.2, 1.01)), glass())
    return scene.light(LightType.POINT, at(0, 0, 1.5), 10).camera(look_at((0, -tilt, 0.8), (0, 0, 0)), 0.1, 16)


@pytest.mark.parametrize("tilt", [0.01, 1.5])
def test_noise_falls_as_one_over_photons(tilt):
    """A kernel that is the pixel's filter does not shrink: four times the iterations leave a quarter of the variance, or less.

    The first radius is less than half a pixel, so that disks are narrower than it. With disks that shrink by N^-0.3 it is 0.39.
    """
    scene = lit_through_a_pane(tilt)
    variances = {}
    for iterations in (16, 64):
        pictures = [render(scene, "Caustics", iterations=iterations, photons_per_iteration=64 * 256, initial_radius=0.002,
                           seed=seed)[..., 1] for seed in range(8)]
        variances[iterations] = np.var(pictures, 0, ddof=1).mean() / np.mean(pictures) ** 2
    assert variances[64] / variances[16] < 0.34


def test_kernels_keep_the_mean():
    """Shrinking disks and kernels of the pixel's size find the same light."""
    scene = lit_through_a_pane(1.5)
    means = {rule: np.mean([render(scene, "Caustics", iterations=32, photons_per_iteration=64 * 256, radius_rule=rule, seed=seed)
                            for seed in range(6)]) for rule in ("DENSITY", "PASS_INDEXED")}
    assert means["DENSITY"] == pytest.approx(means["PASS_INDEXED"], rel=0.005)


def test_radii_follow_the_curvature_of_the_light():
    """Even light keeps disks of the first radius; where light ends they are narrower by half."""
    even = lit_through_a_pane(0.01)
    ending = Scene().add(floor(3), diffuse(0.6)).add(box((0, -0.2, 1), (0.2, 0.2, 1.01)), glass())
    ending.light(LightType.POINT, at(0, 0, 1.5), 10).camera(look_at((0, -0.01, 0.8), (0, 0, 0)), 0.1, 16)
    even, ending = (render(scene, "Radius", iterations=32, photons_per_iteration=4 * 256)[..., 0] for scene in (even, ending))
    assert even.min() > 0.95 * 3 * 0.8 * 2 * 0.1 / 16
    assert ending[:, 7].mean() < 0.6 * even.mean() and ending[:, 15].mean() > 0.75 * even.mean()
