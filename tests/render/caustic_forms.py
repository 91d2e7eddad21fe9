"""Caustics that have closed forms, as the renderer finds them: a burning glass, and the cusps of curved mirrors.

Each measurement returns what was found, one value a seed, and what is expected.
"""

import numpy as np
from caustic_scenes import RHO, floor_irradiance, grid_mesh, ring
from scenes import DOWN, Scene, diffuse, floor, fresnel, glass, look_at
from sppm.scene_desc import LightType

IOR = 1.5

# ---------------------------------------------------------------- a burning glass

CURVATURE, APERTURE = 0.5, 0.08  # radii of its faces and of its rim
SAGITTA = CURVATURE - np.sqrt(CURVATURE**2 - APERTURE**2)


def focal_length():
    """Of the paraxial thick lens, and the height of its second principal plane above the lens's middle."""
    thick = 2 * SAGITTA
    focal = CURVATURE / ((IOR - 1) * (2 - (IOR - 1) * thick / (IOR * CURVATURE)))
    return focal, -SAGITTA + (IOR - 1) * thick * focal / (IOR * CURVATURE)


def unit_disk(cells=64):
    """A square grid pulled onto the unit disk, (cells + 1, cells + 1, 2)."""
    u, v = np.meshgrid(*[np.linspace(-1, 1, cells + 1)] * 2)
    pull = np.maximum(abs(u), abs(v)) / np.maximum(np.hypot(u, v), 1e-12)
    return np.stack([u * pull, v * pull], axis=-1)


def under_lens(distance, angle=0.0):
    """A floor `distance` below the second principal plane of a biconvex lens in the sun: two caps that meet in its rim."""
    scene = Scene().add(floor(0.06), diffuse(RHO)).light(LightType.SUN, DOWN, 3, angle=angle)
    flat = unit_disk() * APERTURE
    rise = np.sqrt(CURVATURE**2 - (flat**2).sum(-1))
    middle = distance - focal_length()[1]
    for side in (1, -1):
        z = middle + side * (rise - CURVATURE + SAGITTA)
        points, normals = (np.concatenate([flat, h[..., None]], axis=-1)[::side] for h in (z, side * rise))
        scene.add(grid_mesh(points), glass(IOR), normals=(normals / CURVATURE).reshape(-1, 3).astype(np.float32))
    return scene


def through_lens():
    """What two interfaces let through near normal incidence; light thrown back and forth inside is spread too wide to count."""
    return (1 - fresnel(1, IOR)) ** 2


def spot(distance, half, angle=0.0):
    """Mean irradiance, at irradiance 1 on the lens, in a window around the axis: (seeds,).

    One pass, all pixels with one radius, and many pixels in it: no light is counted more or less than it is.
    """
    scene = under_lens(distance, angle).above(0.1, half, size=64)
    return floor_irradiance(scene, 8, search=half / 2, iterations=1, photons_per_iteration=200_000).mean((1, 2)) / 3


def flux_in_focus():
    """Of a sun of 0.02 rad, in a window that holds its image: all that enters by the aperture."""
    half = 0.05
    return spot(focal_length()[0], half, angle=0.02) * (2 * half) ** 2, np.pi * APERTURE**2 * through_lens()


def flux_in_narrow_focus(iterations=64, **settings):
    """The same where the image is smaller than the first radius and each pixel has a radius of its own.

    Radii shrink fastest where the light is. Pixels around still reach it with wide kernels and count it as well, so that the sum
    is too large until they no longer reach it.
    """
    half = 0.05
    scene = under_lens(focal_length()[0], angle=0.02).above(0.1, half, size=32)
    settings = dict(search=half / 2, iterations=iterations, photons_per_iteration=5000, radius_rule="DENSITY") | settings
    found = floor_irradiance(scene, 4, **settings).mean((1, 2)) / 3
    return found * (2 * half) ** 2, np.pi * APERTURE**2 * through_lens()


def halfway_to_focus():
    """The beam is half as wide as the lens."""
    return spot(focal_length()[0] / 2, half=0.01), 4 * through_lens()


def image_of_the_sun(angle=0.1):
    """In the focus each point sees the sun all over the lens: the sun's radiance times the aperture's solid angle."""
    focal = focal_length()[0]
    solid_angle = np.pi * np.sin(np.arctan(APERTURE / focal)) ** 2
    return spot(focal, 0.012, angle), solid_angle * through_lens() / (np.pi * np.sin(angle / 2) ** 2)


# ---------------------------------------------------------------- cusps

RADIUS = 0.5  # of the mirror, which stands on the floor around the z axis
REFLECTANCE = 0.9


def before_mirror():
    """A floor and a piece of a cylinder, so small that no light meets it twice."""
    scene = Scene().add(floor(0.2), diffuse(RHO))
    ring(RADIUS, 0.25, half_angle=0.4, reflectance=REFLECTANCE).add_to(scene)
    return scene


def along_axis(scene, low, high, count):
    """Irradiance (seeds, count) by the mirror in a strip of the x axis, and the places x."""
    half = (high - low) / 2
    picture = floor_irradiance(scene.above(0.9, half, x=(low + high) / 2, size=count * 3), 8, search=half / 12,
                               iterations=8, photons_per_iteration=50_000)
    middle = picture.shape[1] // 2
    strip = picture[:, middle - 2:middle + 2].mean(1).reshape(len(picture), count, 3).mean(2)
    return strip, low + (np.arange(count) + 0.5) * (high - low) / count


def cusp(places, defocus):
    """Where a line through the defocus, linear along the axis and 0 at the cusp, is 0: one place a seed."""
    return np.array([np.roots(np.polyfit(places, row, 1))[0] for row in defocus])


def nephroid():
    """Parallel light along +x: on the x axis the mirror shows the sun's irradiance over |1 - u / (R / 2)|, u away from it.

    Returns:
        (cusps found, expected), (irradiance found relative to that, 1).
    """
    slope = 0.5
    toward = np.array([1, 0, -slope]) / np.hypot(1, slope)
    scene = before_mirror().light(LightType.SUN, look_at(-toward, (0, 0, 0)), 3)
    found, x = along_axis(scene, 0.03, 0.18, 15)
    relative = found / (REFLECTANCE * 3 * -toward[2])
    defocus = abs(1 - (RADIUS - x) / (RADIUS / 2))
    return (cusp(x, 1 / relative), RADIUS / 2), ((relative * defocus).mean(1), 1)


def cardioid():
    """A lamp above the circle's far side: 1 / s + 1 / s' = 2 / R puts its image at s' = 2 R / 3 from the mirror.

    A flat mirror would show intensity times height over distance^3; a curved one divides that by the beam's relative width.
    Returns what `nephroid` does.
    """
    height, intensity, s, image = 0.5, 5.0, 2 * RADIUS, 2 * RADIUS / 3
    lamp = look_at((-RADIUS, 0, height), (RADIUS, 0, 0.1))
    scene = before_mirror().light(LightType.SPOT, lamp, intensity, angle=0.7)
    found, x = along_axis(scene, -0.05, 0.10, 15)
    u = RADIUS - x
    flat = REFLECTANCE * intensity * height / ((s + u) ** 2 + height**2) ** 1.5
    relative = found / (flat * (s + u) / s)
    return (cusp(x, 1 / relative), RADIUS - image), ((relative * abs(1 - u / image)).mean(1), 1)
