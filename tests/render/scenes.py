"""Scenes by hand and what is measured in them; nothing here comes from the renderer but its interface.

A closed form is compared with the mean over several seeds. The tolerance is four standard errors of that mean, which the spread
over the seeds tells, plus what a test states and gives reasons for; `precision` is the largest standard error that still tests
something.
"""

import numpy as np
import pictures
from sppm import native, scene_desc
from sppm.scene_desc import ClosureDesc, ClosureType, LightFlags, LightType, Param

SIGMAS = 4
FLOAT_ROUNDING = 2e-5  # of float32 along a path
SPLITS = [dict(indirect=kind) for kind in ("PHOTONS", "PATHS", "AUTO")]  # all must show the same

IDENTITY = np.eye(3, 4)
DOWN = IDENTITY  # a light at the origin that shines along -z


# ---------------------------------------------------------------- frames


def at(x, y, z):
    """A light or camera at a place, looking down."""
    frame = IDENTITY.copy()
    frame[:, 3] = x, y, z
    return frame


def look_at(position, target, up=(0.0, 0.0, 1.0)):
    """Camera to world; the camera looks along its -z."""
    position = np.asarray(position, float)
    back = position - np.asarray(target, float)
    back /= np.linalg.norm(back)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back, position], axis=1)


def sun_frame(theta):
    """A sun that comes from `theta` off the zenith, towards +x."""
    return look_at((np.sin(theta), 0, np.cos(theta)), (0, 0, 0), up=(0, 1, 0))


# ---------------------------------------------------------------- shapes: positions and triangles, outward by the right-hand rule


def quad(corners):
    return np.array(corners, np.float32), np.array([[0, 1, 2], [0, 2, 3]], np.uint32)


def floor(half, z=0.0):
    return quad([(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)])


def box(low, high):
    (x0, y0, z0), (x1, y1, z1) = low, high
    positions = np.array([(x, y, z) for z in (z0, z1) for y in (y0, y1) for x in (x0, x1)], np.float32)
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return positions, np.array([t for a, b, c, d in faces for t in ((a, b, c), (a, c, d))], np.uint32)


def sphere(radius, center=(0.0, 0.0, 0.0), divisions=4):
    """An octahedron, each triangle cut in four `divisions` times and its corners pushed onto the sphere."""
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    triangles = []
    for x in (0, 3):
        for y in (1, 4):
            for z in (2, 5):
                outward = np.linalg.det(axes[[x, y, z]]) > 0
                triangles.append(axes[[x, y, z] if outward else [x, z, y]])
    triangles = np.array(triangles)
    for _ in range(divisions):
        a, b, c = triangles.transpose(1, 0, 2)
        ab, bc, ca = ((p + q) / np.linalg.norm(p + q, axis=1, keepdims=True) for p, q in ((a, b), (b, c), (c, a)))
        triangles = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    unit, index = np.unique(triangles.reshape(-1, 3).round(12), axis=0, return_inverse=True)
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    return (unit * radius + center).astype(np.float32), index.reshape(-1, 3).astype(np.uint32)


def area(positions, indices):
    a, b, c = positions[indices].astype(float).transpose(1, 0, 2)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


# ---------------------------------------------------------------- closures


def grey(value):
    return (float(value),) * 3


def diffuse(albedo):
    return ClosureDesc(ClosureType.DIFFUSE, color=Param(grey(albedo)))


def emission(radiance):
    return ClosureDesc(ClosureType.EMISSION, color=Param(grey(radiance)))


def glass(ior=1.5, roughness=0.0, flags=scene_desc.ClosureFlags.NONE):
    return ClosureDesc(ClosureType.DIELECTRIC, flags=flags, roughness=Param(grey(roughness)), ior=ior)


def mirror(reflectance):
    """The same from all directions."""
    return ClosureDesc(ClosureType.CONDUCTOR, color=Param(grey(reflectance)), color2=Param(grey(reflectance)))


# ---------------------------------------------------------------- scenes


class Scene:
    """Collects a `SceneDesc`; the methods return self so that a scene reads as one expression."""

    def __init__(self, world=None):
        self.desc = scene_desc.SceneDesc(world=None if world is None else scene_desc.WorldDesc(grey(world)))

    def add(self, shape, *closures, normals=None):
        """A mesh with its own material. `normals` are unit, one a vertex: smooth shading."""
        positions, indices = shape
        self.desc.materials.append(scene_desc.MaterialDesc("", tuple(closures)))
        corners = None if normals is None else indices
        self.desc.meshes.append(scene_desc.MeshDesc("", positions, indices, corners, normals))
        number = len(self.desc.meshes)
        self.desc.instances.append(scene_desc.InstanceDesc("", number, (number,), IDENTITY))
        return self

    def light(self, kind: LightType, transform, value, **rest):
        color = value if isinstance(value, tuple) else grey(value)
        self.desc.lights.append(scene_desc.LightDesc("", kind, transform, color, **rest))
        return self

    def camera(self, transform, half, size=8, **rest):
        """A square picture; `half` is the half width of its window."""
        rest.setdefault("clip_near", 1e-4)
        self.desc.camera = scene_desc.CameraDesc(transform, (-half, half, -half, half), size, size, **rest)
        return self

    def above(self, z, half, x=0.0, size=8):
        """Sees the square of half width `half` around (x, 0) of the floor, all pixels straight from above."""
        return self.camera(at(x, 0, z), half, size, projection=scene_desc.Projection.ORTHOGRAPHIC)


def furnished_room():
    """Walls, a ball and a block of diffuse white, a ball of glass with its caustic, an area lamp.

    The lamp's rare glints in the glass, which no short render meets, would hide all else: it is hidden from specular rays.
    """
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(0.6))
    for center, material in (((0.4, 0.2, -0.5), glass()), ((-0.5, 0.3, -0.6), diffuse(0.7))):
        shape = sphere(0.35, center, divisions=4)
        scene.add(shape, material, normals=((shape[0] - center) / 0.35).astype(np.float32))
    scene.add(box((-0.3, -0.3, -1), (0.1, 0, -0.7)), diffuse(0.7))
    scene.light(LightType.RECTANGLE, at(-0.2, 0, 0.95), 50, size_x=0.1, size_y=0.1, flags=LightFlags.HIDDEN_FROM_SPECULAR)
    return scene.camera(look_at((0, -0.95, 0.1), (0, 0.4, -0.4)), 0.8, 32)


def render(scene, *passes, iterations=4, threads=0, **settings):
    """The passes after `iterations`, as float64; a tuple if there are several."""
    settings = native.Settings(iterations=iterations, threads=threads, passes=frozenset(passes), **settings)
    with native.Scene(scene.desc) as built, native.Session(built, settings) as session:
        for _ in range(iterations):
            session.step()
        dropped = session.progress().dropped_samples
        found = tuple(session.read_pass(name).astype(np.float64) for name in passes)
    pictures.keep(found[0])
    assert dropped == 0, f"{dropped} samples were dropped"
    assert all(np.isfinite(p).all() for p in found)
    return found[0] if len(found) == 1 else found


def render_all(scene, **settings):
    """Every pass by its name."""
    return dict(zip(native.PASS_NAMES, render(scene, *native.PASS_NAMES, **settings)))


def means(scene, *passes, seeds=8, **settings):
    """Mean over pixels and colours for each seed: (seeds, passes); for one pass (seeds,). The Combined pass loses its alpha."""
    rows = []
    for seed in range(seeds):
        found = render(scene, *passes, seed=1000 + seed, **settings)
        rows.append([p[..., :3].mean() for p in (found if len(passes) > 1 else (found,))])
    rows = np.array(rows)
    return rows if len(passes) > 1 else rows[:, 0]


def check(values, expected, precision=0.01, bias=0.0):
    """The mean of `values`, one a seed, is `expected` (> 0).

    Args:
        precision: largest standard error, as a share of `expected`.
        bias: what the model of the test itself may be off by, as a share of `expected`.
    """
    values = np.asarray(values)
    error = values.std(ddof=1) / np.sqrt(len(values))
    assert error <= precision * expected, f"the standard error {error:.3g} is too large to test {expected:.6g}"
    tolerance = SIGMAS * error + (bias + FLOAT_ROUNDING) * expected
    assert abs(values.mean() - expected) <= tolerance, f"{values.mean():.6g}, expected {expected:.6g} within {tolerance:.2g}"


def student_limit(count, dof, false_alarm=1e-3):
    """What none of `count` deviations exceeds but with the probability given, in standard errors of a mean of dof + 1 values.

    The quantile of Student's distribution, by the midpoint rule in angle: t = sqrt(dof) tan(a) has the density cos(a)^(dof - 1).
    """
    angle = (np.arange(1_000_000) + 0.5) / 1_000_000 * np.pi / 2
    tail = np.cumsum(np.cos(angle[::-1]) ** (dof - 1))
    tail /= tail[-1]
    return np.sqrt(dof) * np.tan(angle[::-1][np.searchsorted(tail, false_alarm / count)])


# ---------------------------------------------------------------- optics


def fresnel(cos_i, ior):
    """Reflectance for unpolarised light; `ior` of the far side over the near side."""
    cos_i = np.maximum(cos_i, 1e-12)
    sin2_t = (1 - cos_i**2) / ior**2
    cos_t = np.sqrt(np.maximum(0, 1 - sin2_t))
    s = (cos_i - ior * cos_t) / (cos_i + ior * cos_t)
    p = (ior * cos_i - cos_t) / (ior * cos_i + cos_t)
    return np.where(sin2_t >= 1, 1.0, (s**2 + p**2) / 2)


def slab_transmittance(cos_i, ior):
    """Of a plate: (1 - R)^2 sum of R^(2k), the light of each interface unpolarised again as the renderer has it."""
    r = fresnel(cos_i, ior)
    return (1 - r) / (1 + r)
