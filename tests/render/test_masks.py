"""Regions of pictures, on scenes where they are plain to see."""

import consistency
import numpy as np
from scenes import Scene, box, diffuse, floor, look_at, sphere

SIZE = 48
BLACK = np.zeros((SIZE, SIZE, 3))


def regions(scene, caustics=BLACK):
    return consistency.regions_of(scene.camera(look_at((0, -3, 2), (0, 0, 0)), 0.4, SIZE).desc, BLACK + 1, caustics)


def test_a_plane_seen_at_an_angle_is_flat_all_over():
    found = regions(Scene().add(floor(20), diffuse(0.5)))
    assert set(found) == {"all", "flat"}
    assert found["flat"].all()


def test_a_ball_is_curved_within_its_silhouette():
    radius = 0.5
    ball = sphere(radius, divisions=5)
    found = regions(Scene().add(floor(20, -0.5), diffuse(0.5)).add(ball, diffuse(0.5), normals=ball[0] / np.float32(radius)))
    y, x = np.mgrid[:SIZE, :SIZE] - (SIZE - 1) / 2
    pixels = np.hypot(x, y) / (radius / np.sqrt(13 - radius**2) / 0.8 * SIZE)  # 1 at the silhouette
    assert found["curved"][pixels < 0.85].all()
    assert not found["curved"][pixels > 1.2].any()
    assert found["edges"][abs(pixels - 1) < 0.05].mean() > 0.5
    assert not found["edges"][(pixels < 0.75) | (pixels > 1.25)].any()


def test_creases_of_a_room_are_corners():
    found = regions(Scene().add(box((-5, -5, -1), (5, 2, 4)), diffuse(0.5)))
    assert 20 < found["corners"].sum() < 4 * SIZE
    assert "edges" not in found and "curved" not in found


def test_a_caustic_is_taken_out_of_the_others():
    light = BLACK.copy()
    light[10:20, 10:20] = 0.5
    found = regions(Scene().add(floor(20), diffuse(0.5)), light)
    assert found["caustic"].sum() == 100
    assert found["flat"].sum() == SIZE**2 - 100
