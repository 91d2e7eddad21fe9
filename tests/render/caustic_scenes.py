"""Caustics on a floor, each told twice: to the renderer as triangles and lamps, to `light_tracer` as formulas.

Every source shines on every caster from the same side; `compare` renders and traces one pair.
"""

from dataclasses import dataclass
from typing import Callable

import light_tracer as tracer
import numpy as np
from scenes import Scene, at, diffuse, emission, floor, glass, grey, look_at, mirror, quad, render, sphere
from sppm.scene_desc import ImageDesc, LightType, WorldDesc

RHO = 0.5
FLOOR = 0.62  # half width: hardly more than is looked at, so that little light is wasted
FROM = np.array([-0.4, 0.2, 1.0]) / np.linalg.norm([-0.4, 0.2, 1.0])  # where distant light comes from

# ---------------------------------------------------------------- sources


@dataclass(frozen=True)
class Source:
    lamp: object  # of light_tracer
    add_to: Callable  # adds the same to a Scene


def point_lamp(position=(-0.3, 0.15, 1.6), intensity=5.0):
    return Source(tracer.PointLamp(position, intensity), lambda scene: scene.light(LightType.POINT, at(*position), intensity))


def sun(angle=0.1):
    frame = look_at(FROM, (0, 0, 0))
    return Source(tracer.Sun(tuple(-FROM), 3.0, angle), lambda scene: scene.light(LightType.SUN, frame, 3, angle=angle))


AREA = tracer.AreaLamp((-0.4, 0.2, 1.6), (0.3, 0.2), 10.0)


def area_lamp():
    size = dict(size_x=AREA.size[0], size_y=AREA.size[1])
    return Source(AREA, lambda scene: scene.light(LightType.RECTANGLE, at(*AREA.position), AREA.radiance, **size))


def emitting_mesh():
    """Shines up as well, where nothing is."""
    (x, y, z), (a, b) = AREA.position, (AREA.size[0] / 2, AREA.size[1] / 2)
    shape = quad([(x - a, y - b, z), (x - a, y + b, z), (x + a, y + b, z), (x + a, y - b, z)])
    return Source(AREA, lambda scene: scene.add(shape, emission(AREA.radiance)))


def glow(direction):
    """Radiance of a soft patch of sky around FROM, a few tenths of a radian wide."""
    return 20 * np.exp(30 * (direction @ FROM - 1)) * (direction[:, 2] > 0)


def sky_image(width=256, height=128):
    """The glow as an equirectangular image: u = 1/2 - atan2(y, x) / 2 pi, v = 1/2 + asin(z) / pi."""
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    azimuth, elevation = (0.5 - u) * 2 * np.pi, (v - 0.5) * np.pi
    direction = np.stack([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)], axis=-1)
    pixels = np.ones((height, width, 4), np.float32)
    pixels[..., :3] = glow(direction.reshape(-1, 3)).reshape(height, width, 1)
    return pixels


def sky():
    def add_to(scene):
        scene.desc.images.append(ImageDesc("", sky_image()))
        scene.desc.world = WorldDesc(grey(1), image=len(scene.desc.images))

    return Source(tracer.Sky(glow), add_to)


SOURCES = {"point lamp": point_lamp(), "sun": sun(), "area lamp": area_lamp(), "emitting mesh": emitting_mesh(), "sky": sky()}

# ---------------------------------------------------------------- casters


@dataclass(frozen=True)
class Caster:
    surface: object  # of light_tracer
    center: tuple  # of a sphere around it
    radius: float
    shape: tuple  # positions, triangles
    material: object
    camera_height: float  # of an orthographic camera that sees the floor and nothing else

    def add_to(self, scene):
        normals = self.surface.normal(self.shape[0].astype(float)).astype(np.float32)
        scene.add(self.shape, self.material, normals=normals)


def ball(radius=0.5, center=(0.0, 0.0, 0.6), ior=1.5):
    surface = tracer.Sphere(center, radius, tracer.Matter(ior))
    return Caster(surface, center, radius, sphere(radius, center, divisions=6), glass(ior), 0.09)


def grid_mesh(points):
    """Triangles over a (rows, columns, 3) grid of points; their fronts are to the left of rows x columns."""
    rows, columns, _ = points.shape
    a = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    triangles = np.stack([a, a + 1, a + columns + 1, a, a + columns + 1, a + columns], axis=1).reshape(-1, 3)
    return points.reshape(-1, 3).astype(np.float32), triangles.astype(np.uint32)


def band_mesh(radius, height, half_angle, segments=512):
    angles = np.linspace(-half_angle, half_angle, segments + 1)
    x, y = radius * np.cos(angles), radius * np.sin(angles)
    return grid_mesh(np.stack([np.stack([x, y, np.full_like(x, z)], axis=1) for z in (0.0, height)]))


def ring(radius=0.35, height=0.6, half_angle=np.pi, reflectance=0.9):
    surface = tracer.Band(radius, height, half_angle, tracer.Matter(reflectance=reflectance))
    center, around = (0.0, 0.0, height / 2), np.hypot(radius, height / 2)
    return Caster(surface, center, around, band_mesh(radius, height, half_angle), mirror(reflectance), 0.9)


def water(level=0.5, amplitude=0.012, wave=(14.0, 9.0), half=0.6, cells=160, ior=1.33):
    surface = tracer.Water(level, amplitude, wave, half, tracer.Matter(ior))
    x, y = np.meshgrid(*[np.linspace(-half, half, cells + 1)] * 2)
    shape = grid_mesh(np.stack([x, y, surface.elevation(x, y)], axis=-1))
    return Caster(surface, (0.0, 0.0, level), np.hypot(half * np.sqrt(2), amplitude), shape, glass(ior), 0.09)


CASTERS = {"glass ball": ball(), "mirror ring": ring(), "water sheet": water()}

# ---------------------------------------------------------------- comparing


@dataclass(frozen=True)
class Comparison:
    """Irradiance [W m^-2] on blocks of the floor: (seeds, blocks, blocks) found, (blocks, blocks) expected.

    `expected_error` is the standard error of the tracer's noise, `blur` how much a search radius can change a block.
    """

    found: np.ndarray
    expected: np.ndarray
    expected_error: np.ndarray
    blur: np.ndarray

    def error(self):
        return np.hypot(self.found.std(0, ddof=1) / np.sqrt(len(self.found)), self.expected_error)

    def ratio(self):
        """Of the whole flux, and its standard error."""
        totals = self.found.mean((1, 2)) / self.expected.mean()
        noise = np.sqrt((self.expected_error**2).sum()) / self.expected.sum()
        return totals.mean(), np.hypot(totals.std(ddof=1) / np.sqrt(len(totals)), noise)

    def deviations(self):
        """In standard errors, after the blur has been taken off: (blocks, blocks)."""
        beyond = np.maximum(0, abs(self.found.mean(0) - self.expected) - self.blur)
        return beyond / np.maximum(self.error(), 1e-3 * self.expected.mean())


def scene_of(source, caster, size, half):
    scene = Scene().add(floor(FLOOR), diffuse(RHO))
    caster.add_to(scene)
    source.add_to(scene)
    return scene.above(caster.camera_height, half, size=size)


def blocks_of(picture, blocks):
    size = len(picture) // blocks
    return picture.reshape(blocks, size, blocks, size).mean((1, 3))


def irradiance(places, watts, half, blocks):
    """Of places on the floor in blocks of a window around the origin, rows from bottom to top."""
    edges = np.linspace(-half, half, blocks + 1)
    return np.histogram2d(places[:, 1], places[:, 0], (edges, edges), weights=watts)[0] / (2 * half / blocks) ** 2


def traced(source, caster, half, blocks, search, rays):
    """Irradiance in blocks, its standard error, and what a kernel of a radius up to `search` changes."""
    places, watts = tracer.caustic(source.lamp, (caster.surface,), caster.center, caster.radius, rays)
    exact = irradiance(places, watts, half, blocks)
    error = np.sqrt(irradiance(places, watts**2, half, blocks) / (2 * half / blocks) ** 2)
    shift = tracer.in_disk(np.random.default_rng(1), len(places))
    blurred = [irradiance(places + r * shift, watts, half, blocks) for r in (search / 2, search)]
    return exact, error, np.max([abs(b - exact) for b in blurred], axis=0)


def floor_irradiance(scene, seeds, search, **settings):
    """What the Caustics pass tells of the floor, sharp pixels: (seeds, height, width) [W m^-2].

    All pixels have one radius, so that what a kernel blurs is known and the flux is kept.
    """
    settings = dict(pixel_filter="BOX", filter_width=1.0, initial_radius=search, max_depth=64,
                    radius_rule="PASS_INDEXED") | settings
    return np.array([render(scene, "Caustics", seed=seed, **settings)[..., 0] for seed in range(seeds)]) * np.pi / RHO


# Many small renders rather than few large ones: their spread is well known. DETAILED has 13 times the light.
QUICK = dict(seeds=12, rays=300_000, iterations=2, photons_per_iteration=30_000)
DETAILED = dict(seeds=16, rays=2_000_000, iterations=6, photons_per_iteration=100_000, blocks=16, search=0.006)


def compare(source, caster, seeds=8, blocks=8, size=64, half=0.45, search=0.015, rays=1_000_000, **settings):
    """Renders and traces the caustic in a window of half width `half`; `search` is the first search radius."""
    settings = dict(iterations=6, photons_per_iteration=60000) | settings
    found = floor_irradiance(scene_of(source, caster, size, half), seeds, search, **settings)
    exact, error, blur = traced(source, caster, half, blocks, search, rays)
    return Comparison(np.array([blocks_of(f, blocks) for f in found]), exact, error, blur)
