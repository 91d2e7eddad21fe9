"""Scenes of very different size and framing, which one renderer with one setting for all must do equally well.

Each has what is hard in it: a caustic or shadows, edges, a floor that runs into the distance. Lengths are metres.
"""

from dataclasses import dataclass

import consistency
import metrics
import numpy as np
from caustic_scenes import grid_mesh
from light_tracer import Band, Matter, Water
from scenes import Scene, at, box, diffuse, floor, glass, look_at, mirror, sphere
from sppm.scene_desc import LightFlags, LightType

SIZE = 32


def smooth(surface, points):
    """A grid mesh over points of a surface that knows its normals, and those."""
    shape = grid_mesh(points)
    return shape, surface.normal(shape[0].astype(float)).astype(np.float32)


def ring_on_a_desk(away=0.25):
    """A metal ring of 10 cm, seen from `away`."""
    surface = Band(0.05, 0.022, np.pi, Matter())
    angles = np.linspace(-np.pi, np.pi, 257)
    rows = [np.stack([0.05 * np.cos(angles), 0.05 * np.sin(angles), np.full_like(angles, z)], axis=1) for z in (0, 0.022)]
    shape, normals = smooth(surface, np.stack(rows))
    scene = Scene().add(floor(0.3), diffuse(0.7)).add(shape, mirror(0.8), normals=normals)
    scene.light(LightType.POINT, at(-0.16, 0.10, 0.13), 0.07, radius=0.002, flags=LightFlags.HIDDEN_FROM_SPECULAR)
    return scene.camera(look_at((0, -0.7 * away, 0.7 * away), (0, 0, 0)), 0.3, SIZE, clip_far=10)


def pool():
    """A basin of 4 m, seen through its waves."""
    surface = Water(0.0, 0.012, (5.0, 3.0), 2.02, Matter(ior=1.33))
    x, y = np.meshgrid(*[np.linspace(-2.02, 2.02, 161)] * 2)
    shape, normals = smooth(surface, np.stack([x, y, surface.elevation(x, y)], axis=-1))
    scene = Scene().add(box((-2, -2, -1.2), (2, 2, 4)), diffuse(0.6)).add(shape, glass(1.33), normals=normals)
    scene.light(LightType.POINT, at(0.7, 0.9, 2.6), 40, radius=0.02, flags=LightFlags.HIDDEN_FROM_SPECULAR)
    return scene.camera(look_at((0, -1.75, 2.3), (0, 0.1, -0.75)), 0.6, SIZE)


def room():
    """Walls of 5 m by 4 m, a ball of glass on the floor, a lamp under the ceiling."""
    center = (0.6, 0.3, -0.7)
    ball = sphere(0.6, center, divisions=5)
    normals = ((ball[0] - center) / 0.6).astype(np.float32)
    scene = Scene().add(box((-2.5, -2, -1.4), (2.5, 2, 1.4)), diffuse(0.6)).add(ball, glass(), normals=normals)
    scene.add(box((-1.2, 0, -1.4), (-0.4, 0.8, -0.4)), diffuse(0.7))
    scene.light(LightType.RECTANGLE, at(-0.5, 0, 1.3), 30, size_x=0.3, size_y=0.3, flags=LightFlags.HIDDEN_FROM_SPECULAR)
    return scene.camera(look_at((2.3, -1.6, 0.8), (0.3, 0.4, -0.9)), 0.7, SIZE)


def terrain(half=500.0):
    """Hills of a kilometre with a lake of 200 m between them, under the sun and a dim sky, seen from 60 m above ground."""
    x, y = np.meshgrid(*[np.linspace(-half, half, 201)] * 2)
    hills = 25 * np.sin(x / 90) * np.cos(y / 70) + 8 * np.sin(x / 23 + 1) * np.sin(y / 31)
    lake = (x[::10, ::10] * 0.2, y[::10, ::10] * 0.2)
    scene = Scene(world=0.3).add(grid_mesh(np.stack([x, y, hills], axis=-1)), diffuse(0.5))
    scene.add(grid_mesh(np.stack([*lake, np.full_like(lake[0], -2.0)], axis=-1)), glass(1.33))
    scene.light(LightType.SUN, look_at((1, 0.5, 1.2), (0, 0, 0)), 3, angle=0.0093)
    return scene.camera(look_at((0, -350, 90), (0, 0, -10)), 0.5, SIZE, clip_near=1, clip_far=5000)


FRAMINGS = {"ring on a desk": ring_on_a_desk, "the ring from afar": lambda: ring_on_a_desk(away=1.0), "pool": pool, "room": room,
            "terrain of 1 km": terrain}


@dataclass(frozen=True)
class Quality:
    """relMSE without the worst 0.1 %: of the picture and of its caustic, and of the picture for the best of several first radii.

    `radius` is the median first radius in pixels.
    """

    picture: float
    caustic: float
    best: float
    best_factor: float  # of the median first radius
    radius: float


def quality(scene, iterations=16, reference=16, seeds=2, factors=(0.25, 0.5, 1, 2, 4)):
    """With the settings as they come, and with first radii that are `factors` times the median of those, the same everywhere.

    The reference has `reference` times as many iterations and another seed.
    """
    final, caustics = consistency.render(scene.desc, iterations * reference, 999, "Combined", "Caustics")
    final = final[..., :3]
    where = consistency.regions_of(scene.desc, final, caustics)["caustic"]

    def errors(**settings):
        found = [consistency.render(scene.desc, iterations, seed, "Combined", **settings)[0][..., :3] for seed in range(seeds)]
        return [np.mean([metrics.trimmed_relmse(picture, final, mask) for picture in found]) for mask in (None, where)]

    radius, depth = (p.ravel() for p in consistency.render(scene.desc, 1, 0, "Radius", "Depth", photons_per_iteration=1))
    on = radius > 0
    fixed = {factor: errors(initial_radius=factor * np.median(radius[on]))[0] for factor in factors}
    best = min(fixed, key=fixed.get)
    footprint = depth * 2 * scene.desc.camera.window[1] / scene.desc.camera.width
    return Quality(*errors(), fixed[best], best, np.median(radius[on] / footprint[on]))
