"""Each path of light counts once, whatever estimator the settings give it to: closed rooms that hold a known radiance."""

import numpy as np
import pytest
from scenes import DOWN, SPLITS, Scene, area, at, box, check, diffuse, emission, glass, means, mirror, sphere
from sppm.scene_desc import LightType

DEEP = 1024  # vertices of a path: as good as endless


@pytest.mark.parametrize("split", SPLITS, ids=str)
@pytest.mark.parametrize("lamp_radius", [0.0, 0.1])
def test_lamp_in_a_glass_ball_in_a_room(split, lamp_radius):
    """A round room with a lamp in its middle, a glass ball around the lamp: nothing is lost, and all is even by symmetry.

    The lamp's own light is a caustic, and all that the wall reflects goes through the glass again: L S D, L S D D, L S D S D.
    Of the sphere's flat triangles no point is off by more than the corners are: (R / distance)^3 - 1 of the largest.
    """
    albedo, power, wall, ball = 0.6, 4 * np.pi * 5, sphere(2, divisions=5), sphere(0.5, divisions=5)
    a, b, c = wall[0][wall[1]].transpose(1, 0, 2)
    tessellation = (2 / np.linalg.norm((a + b + c) / 3, axis=1)).max() ** 3 - 1
    normals = (ball[0] / np.linalg.norm(ball[0], axis=1, keepdims=True)).astype(np.float32)
    scene = Scene().add(wall, diffuse(albedo)).add(ball, glass(1.5), normals=normals)
    scene.light(LightType.POINT, DOWN, power / (4 * np.pi), radius=lamp_radius).camera(at(0, 0, -1), 0.5)
    found = means(scene, "Combined", "Caustics", iterations=8, photons_per_iteration=10000, max_depth=DEEP, initial_radius=0.4,
                  **split)
    once = power * albedo / (np.pi * area(*wall))
    check(found[:, 0], once / (1 - albedo), bias=tessellation)
    check(found[:, 1], once, bias=tessellation)


@pytest.mark.parametrize("split", SPLITS, ids=str)
def test_furnace_with_glass_and_mirror(split):
    """Walls that emit 1 and reflect half of it show 2, straight, in a perfect mirror and through glass that absorbs nothing.

    Photons show a quarter of it, less by what their kernel finds missing beyond edges: as much as lands in 2 r / (3 pi) along
    each of the 24 edges of the walls, at r = 0.05 m 2 % of their area.
    """
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(0.5), emission(1))
    scene.add(sphere(0.4, (0.5, 0, 0), divisions=4), glass(1.5)).add(sphere(0.4, (-0.5, 0, 0), divisions=4), mirror(1))
    scene.camera(at(0, 0, 0.95), 1, 16)
    found = means(scene, "Combined", iterations=16, photons_per_iteration=20000, max_depth=DEEP, initial_radius=0.05, **split)
    check(found, 2, bias=0.01)
