"""A slow light tracer of the tests' own: analytic lamps, analytic mirrors and glass, a floor that counts what lands on it.

It shares nothing with the renderer, neither code nor triangles nor random numbers. Light is followed from a lamp through
specular surfaces only, one of reflection and refraction chosen by Fresnel's formulas, until it lands on the floor z = 0; what
landed after at least one such surface is a caustic. Lamps aim at a sphere around the specular surfaces, since nothing else makes
caustics.

Arrays: points and directions (n, 3) float64; weights (n,) in watts, whose sum is the flux.
"""

from dataclasses import dataclass
from typing import Callable

import numpy as np
from scenes import fresnel

NEAR = 1e-7  # a ray does not meet the surface that it has just left
MOST_HITS = 64  # what still is inside then is trapped at grazing angles

# ---------------------------------------------------------------- surfaces


@dataclass(frozen=True)
class Matter:
    """Glass of index `ior` on the side away from the normal, or, with ior 0, a mirror on both sides."""

    ior: float = 0.0
    reflectance: float = 1.0


@dataclass(frozen=True)
class Sphere:
    center: tuple
    radius: float
    matter: Matter

    def distance(self, origin, direction):
        to = origin - self.center
        b, c = (to * direction).sum(1), (to**2).sum(1) - self.radius**2
        root = np.sqrt(np.maximum(b * b - c, 0))
        near = np.where(-b - root > NEAR, -b - root, -b + root)
        return np.where((b * b >= c) & (near > NEAR), near, np.inf)

    def normal(self, point):
        return (point - self.center) / self.radius


@dataclass(frozen=True)
class Band:
    """A piece of a cylinder around the z axis, from z = 0 to `height`, within `half_angle` of +x."""

    radius: float
    height: float
    half_angle: float
    matter: Matter

    def distance(self, origin, direction):
        a = (direction[:, :2] ** 2).sum(1)
        b, c = (origin[:, :2] * direction[:, :2]).sum(1), (origin[:, :2] ** 2).sum(1) - self.radius**2
        root = np.sqrt(np.maximum(b * b - a * c, 0))
        found = np.full(len(origin), np.inf)
        for t in ((-b + root) / a, (-b - root) / a):  # the nearer one last: it wins
            point = origin + t[:, None] * direction
            on = (point[:, 2] >= 0) & (point[:, 2] <= self.height) & (b * b >= a * c) & (t > NEAR)
            on &= np.abs(np.arctan2(point[:, 1], point[:, 0])) <= self.half_angle
            found = np.where(on, t, found)
        return found

    def normal(self, point):
        return point * [1, 1, 0] / self.radius


@dataclass(frozen=True)
class Water:
    """A square sheet around the z axis with gentle waves, z = level + amplitude sin(kx x + ky y); the water is below."""

    level: float
    amplitude: float
    wave: tuple  # (kx, ky) [1/m]
    half: float
    matter: Matter

    def elevation(self, x, y):
        return self.level + self.amplitude * np.sin(self.wave[0] * x + self.wave[1] * y)

    def distance(self, origin, direction):
        """Newton's method from the mean level; the waves must be so gentle that no ray meets the sheet twice."""
        t = (self.level - origin[:, 2]) / direction[:, 2]
        for _ in range(8):
            point = origin + t[:, None] * direction
            phase = point[:, :2] @ self.wave
            value = point[:, 2] - self.level - self.amplitude * np.sin(phase)
            t = t - value / (direction[:, 2] - self.amplitude * np.cos(phase) * (direction[:, :2] @ self.wave))
        point = origin + t[:, None] * direction
        return np.where((t > NEAR) & (np.abs(point[:, :2]).max(1) <= self.half), t, np.inf)

    def normal(self, point):
        slope = self.amplitude * np.cos(point[:, :2] @ self.wave)[:, None] * np.array(self.wave)
        normal = np.concatenate([-slope, np.ones((len(point), 1))], axis=1)
        return normal / np.linalg.norm(normal, axis=1, keepdims=True)


# ---------------------------------------------------------------- lamps


def in_disk(rng, count):
    r, phi = np.sqrt(rng.random(count)), 2 * np.pi * rng.random(count)
    return np.stack([r * np.cos(phi), r * np.sin(phi)], axis=1)


def frame_around(axis):
    """Two unit vectors, (n, 3) each, that are perpendicular to the unit `axis` (n, 3) and to each other."""
    helper = np.where(np.abs(axis[:, :1]) > 0.7, [[0.0, 1.0, 0.0]], [[1.0, 0.0, 0.0]])
    x = np.cross(helper, axis)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return x, np.cross(axis, x)


def in_cone(rng, axis, cos_half):
    """Directions uniform in solid angle within a cone around each `axis`; `cos_half` (n,)."""
    cos = 1 - rng.random(len(axis)) * (1 - cos_half)
    sin, phi = np.sqrt(1 - cos**2), 2 * np.pi * rng.random(len(axis))
    x, y = frame_around(axis)
    return cos[:, None] * axis + (sin * np.cos(phi))[:, None] * x + (sin * np.sin(phi))[:, None] * y


def toward_ball(rng, origin, center, radius):
    """From outside a ball: directions uniform in the cone that just holds it, and its solid angle (n,)."""
    to = np.asarray(center) - origin
    distance = np.linalg.norm(to, axis=1)
    cos_half = np.sqrt(1 - (radius / distance) ** 2)
    return in_cone(rng, to / distance[:, None], cos_half), 2 * np.pi * (1 - cos_half)


@dataclass(frozen=True)
class PointLamp:
    position: tuple
    intensity: float

    def emit(self, rng, count, center, radius):
        origin = np.broadcast_to(np.array(self.position, float), (count, 3))
        direction, solid_angle = toward_ball(rng, origin, center, radius)
        return origin, direction, self.intensity * solid_angle / count


@dataclass(frozen=True)
class AreaLamp:
    """A horizontal rectangle that shines down."""

    position: tuple
    size: tuple
    radiance: float

    def emit(self, rng, count, center, radius):
        offset = (rng.random((count, 3)) - 0.5) * [*self.size, 0]
        origin = np.array(self.position, float) + offset
        direction, solid_angle = toward_ball(rng, origin, center, radius)
        cos = np.maximum(0, -direction[:, 2])
        return origin, direction, self.radiance * self.size[0] * self.size[1] * cos * solid_angle / count


@dataclass(frozen=True)
class Sun:
    """Irradiance on a plane that faces it; `toward` is the unit direction in which its light travels, `angle` the full cone."""

    toward: tuple
    irradiance: float
    angle: float = 0.0

    def emit(self, rng, count, center, radius):
        axis = np.broadcast_to(np.array(self.toward, float), (count, 3))
        direction = in_cone(rng, axis, np.full(count, np.cos(self.angle / 2)))
        return before_ball(rng, direction, center, radius), direction, np.full(count, self.irradiance * np.pi * radius**2 / count)


@dataclass(frozen=True)
class Sky:
    """`radiance(direction)` of what comes from a direction (n, 3), all of it above the horizon."""

    radiance: Callable

    def emit(self, rng, count, center, radius):
        up = np.broadcast_to([0.0, 0.0, 1.0], (count, 3))
        source = in_cone(rng, up, np.zeros(count))
        flux = self.radiance(source) * 2 * np.pi * np.pi * radius**2
        return before_ball(rng, -source, center, radius), -source, flux / count


def before_ball(rng, direction, center, radius):
    """Origins of parallel light that evenly fills the ball's cross section."""
    x, y = frame_around(direction)
    disk = in_disk(rng, len(direction)) * radius
    return np.asarray(center) - 2 * radius * direction + disk[:, :1] * x + disk[:, 1:] * y


# ---------------------------------------------------------------- tracing


def nearest(surfaces, origin, direction):
    """Distance to and number of the first surface met; the floor has the number -1, no surface at all is at inf."""
    with np.errstate(divide="ignore", invalid="ignore"):
        best = np.where((direction[:, 2] < 0) & (origin[:, 2] > 0), -origin[:, 2] / direction[:, 2], np.inf)
        which = np.full(len(origin), -1)
        for number, surface in enumerate(surfaces):
            t = surface.distance(origin, direction)
            closer = t < best
            best, which = np.where(closer, t, best), np.where(closer, number, which)
    return best, which


def scatter(rng, direction, normal, matter):
    """The direction in which light goes on."""
    cos = -(direction * normal).sum(1, keepdims=True)
    n = np.where(cos < 0, -normal, normal)
    mirrored = direction + 2 * np.abs(cos) * n
    if not matter.ior:
        return mirrored
    eta = np.where(cos < 0, 1 / matter.ior, matter.ior)  # far over near
    cos_t = np.sqrt(np.maximum(0, 1 - (1 - cos**2) / eta**2))
    refracted = direction / eta + (np.abs(cos) / eta - cos_t) * n
    return np.where(rng.random((len(direction), 1)) < fresnel(np.abs(cos), eta), mirrored, refracted)


def trace(rng, surfaces, origin, direction, weight):
    """What lands on the floor after at least one surface: places (n, 2) and watts (n,)."""
    places, watts = [], []
    for hits in range(MOST_HITS):
        t, which = nearest(surfaces, origin, direction)
        landed = np.isfinite(t) & (which < 0)
        if hits:
            places.append(origin[landed, :2] + t[landed, None] * direction[landed, :2])
            watts.append(weight[landed])
        going = which >= 0
        if not going.any():
            break
        t, which, weight = t[going], which[going], weight[going]
        point, direction = origin[going] + t[:, None] * direction[going], direction[going].copy()
        for number, surface in enumerate(surfaces):
            here = which == number
            direction[here] = scatter(rng, direction[here], surface.normal(point[here]), surface.matter)
            weight = np.where(here, weight * surface.matter.reflectance, weight)
        origin = point
    return np.concatenate(places), np.concatenate(watts)


def caustic(lamp, surfaces, center, radius, count, seed=0, chunk=500_000):
    """Traces `count` rays of a lamp towards the sphere around all surfaces: places (n, 2) and watts (n,) on the floor."""
    rng = np.random.default_rng(seed)
    parts = []
    for start in range(0, count, chunk):
        size = min(chunk, count - start)
        origin, direction, weight = lamp.emit(rng, size, center, radius)
        places, watts = trace(rng, surfaces, origin, direction, weight)
        parts.append((places, watts * size / count))
    return tuple(np.concatenate(part) for part in zip(*parts))
