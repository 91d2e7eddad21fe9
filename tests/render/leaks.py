"""How far light reaches where it should not: through thin walls, and how much is missing in corners.

Both are what a kernel of radius r does that knows nothing of edges: at a distance d from an edge the share `beyond(d / r)` of its
disk lies on the other side. Closed rooms, so that nothing but the kernel brings light there; r is that of the first pass.
"""

from dataclasses import replace

import numpy as np
from scenes import Scene, at, box, diffuse, emission, look_at, quad, render
from sppm.scene_desc import LightType

RADIUS = 0.04
ALBEDO = 0.5


def beyond(distance):
    """The share of a unit disk that lies beyond a line at `distance` from its centre."""
    x = np.clip(distance, 0, 1)
    return (np.arccos(x) - x * np.sqrt(1 - x**2)) / np.pi


def two_rooms(thickness):
    """A lit and a dark room side by side: a wall from x = 0 to `thickness` parts them; at 0 it is a single sheet."""
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(ALBEDO)).light(LightType.POINT, at(-0.5, 0, 0), 3)
    side = 1.1
    if thickness:
        return scene.add(box((0, -side, -side), (thickness, side, side)), diffuse(ALBEDO))
    return scene.add(quad([(0, -side, -side), (0, side, -side), (0, side, side), (0, -side, side)]), diffuse(ALBEDO))


def strip(scene, x, width, size=32):
    """The camera looks down from 0.5 m at a part of the floor, `width` wide from x on and 1.2 m long."""
    scene.camera(at(x + width / 2, 0, -0.5), 1, size)
    scene.desc.camera = replace(scene.desc.camera, window=(-width, width, -1.2, 1.2))
    return scene


def profile(scene, seeds=4, **settings):
    """Indirect radiance over the columns of the picture."""
    settings = dict(initial_radius=RADIUS, iterations=1, photons_per_iteration=200_000, pixel_filter="BOX",
                    filter_width=1, indirect="PHOTONS") | settings
    return np.mean([render(scene, "Indirect", seed=seed, **settings)[..., 0].mean(0) for seed in range(seeds)], axis=0)


def through_wall(thickness, reach=1.5, **settings):
    """Light on the dark floor as a share of that on the lit one, over distances from the wall; thickness and distances in radii.

    Returns:
        distances (n,), shares (n,).
    """
    scene = two_rooms(thickness * RADIUS)
    dark = profile(strip(scene, thickness * RADIUS, reach * RADIUS), **settings)
    lit = profile(strip(scene, -1.7 * RADIUS, 0.7 * RADIUS), **settings).mean()
    return (np.arange(len(dark)) + 0.5) / len(dark) * reach, dark / lit


def in_corner(reach=1.5, radius=0.1, **settings):
    """Light that reflected twice or more in a furnace, as a share of what it is far from edges; distances in radii."""
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(ALBEDO), emission(1))
    found = profile(strip(scene, 1 - reach * radius, reach * radius), initial_radius=radius, **settings)[::-1]
    return (np.arange(len(found)) + 0.5) / len(found) * reach, found / (ALBEDO**2 / (1 - ALBEDO))


def dark_face(thickness, **settings):
    """The Indirect and Photons passes of the middle of the wall's dark side, far from all edges."""
    scene = two_rooms(thickness * RADIUS)
    scene.camera(look_at((0.5, 0, 0), (0, 0, 0)), 0.5, 16)
    return render(scene, "Indirect", "Photons", initial_radius=RADIUS, iterations=4, photons_per_iteration=100_000,
                  indirect="PHOTONS", **settings)
