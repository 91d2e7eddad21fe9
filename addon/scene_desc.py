"""A scene as plain values: what the exporters make and what `native` hands to the library.

Neither Blender nor ctypes is needed here, so a test can write a scene by hand. Fields have the names, units and frames of
`native/include/sppm/sppm.h`. Ids of images, textures, materials and meshes are positions in the lists of `SceneDesc`, counted
from 1; 0 means none.
"""

from dataclasses import dataclass, field
from enum import IntEnum, IntFlag
from typing import Optional

import numpy as np


class TextureType(IntEnum):
    CONSTANT = 0
    IMAGE = 1
    IMAGE_ALPHA = 2
    ATTRIBUTE = 3
    MIX = 4


class Interpolation(IntEnum):
    LINEAR = 0
    CLOSEST = 1


class Extension(IntEnum):
    REPEAT = 0
    EXTEND = 1
    CLIP = 2
    MIRROR = 3


class Blend(IntEnum):
    MIX = 0
    MULTIPLY = 1
    ADD = 2
    SUBTRACT = 3
    SCREEN = 4
    DIFFERENCE = 5
    DARKEN = 6
    LIGHTEN = 7


class ClosureType(IntEnum):
    DIFFUSE = 1
    DIELECTRIC = 2
    CONDUCTOR = 3
    COAT = 4
    TRANSPARENT = 5
    EMISSION = 6


class ClosureFlags(IntFlag):
    NONE = 0
    RETRO = 1
    PRESERVE_ENERGY = 2
    ATTENUATE = 4
    REFRACTION_ONLY = 8
    EDGE_BY_IOR = 16
    SEPARABLE = 32
    UNDER_COAT = 64
    CLEARCOAT = 128


class LightType(IntEnum):
    POINT = 1
    SPOT = 2
    SUN = 3
    RECTANGLE = 4
    ELLIPSE = 5


class LightFlags(IntFlag):
    NONE = 0
    NO_SHADOW = 1
    SPOT_COSINE = 2
    HIDDEN_FROM_SPECULAR = 4


class InstanceFlags(IntFlag):
    NONE = 0
    HOLDOUT = 1
    HIDDEN_FROM_CAMERA = 2


class Projection(IntEnum):
    PERSPECTIVE = 0
    ORTHOGRAPHIC = 1


@dataclass(frozen=True)
class ImageDesc:
    """`pixels` (height, width, 4) float32 or uint8, RGBA, straight alpha, bottom row first; `srgb`: decode the sRGB curve."""

    name: str
    pixels: np.ndarray
    srgb: bool = False


@dataclass(frozen=True)
class TextureDesc:
    """A colour over a surface; `image`, `a`, `b`, `factor` are ids of an image and of earlier textures."""

    type: TextureType
    value: tuple = (0.0, 0.0, 0.0)
    image: int = 0
    interpolation: Interpolation = Interpolation.LINEAR
    extension: Extension = Extension.REPEAT
    mapping: Optional[tuple] = None  # 12 floats, row-major 3x4 on (u, v, 0); None: identity
    blend: Blend = Blend.MIX
    a: int = 0
    b: int = 0
    factor: int = 0


@dataclass(frozen=True)
class Param:
    """`value` times texture, per channel; scalars use the first channel."""

    value: tuple = (1.0, 1.0, 1.0)
    texture: int = 0


@dataclass(frozen=True)
class ClosureDesc:
    type: ClosureType
    flags: ClosureFlags = ClosureFlags.NONE
    weight: Param = Param()
    color: Param = Param()
    color2: Param = Param()
    roughness: Param = Param((0.0, 0.0, 0.0))
    ior: float = 1.5


@dataclass(frozen=True)
class MaterialDesc:
    name: str
    closures: tuple = ()
    index: int = 0  # for the pass of that name


@dataclass(frozen=True)
class MeshDesc:
    """Triangles in object space.

    Attributes:
        positions: (vertices, 3) float32, metres.
        indices: (triangles, 3) uint32 into `positions`.
        corners: (triangles, 3) uint32 into the corner arrays, or None without any of them.
        corner_normals: (corners, 3) float32 unit, None for flat shading.
        corner_uvs: (corners, 2) float32 or None.
        corner_colors: (corners, 3) float32 linear or None.
        material_slots: (triangles,) uint32 index into an instance's materials, None for all 0.
    """

    name: str
    positions: np.ndarray
    indices: np.ndarray
    corners: Optional[np.ndarray] = None
    corner_normals: Optional[np.ndarray] = None
    corner_uvs: Optional[np.ndarray] = None
    corner_colors: Optional[np.ndarray] = None
    material_slots: Optional[np.ndarray] = None


@dataclass(frozen=True)
class InstanceDesc:
    """`transform` (3, 4) float64 object to world; `materials` ids, at least the mesh's largest slot + 1; `index` for its pass.

    What is `movable` can be placed elsewhere once the scene is built; its rays take a little longer. `motion` (keys, 3, 4) float64
    is where it stands while the shutter is open, evenly spaced in time, from its opening to its closing; None if it does not move.
    """

    name: str
    mesh: int
    materials: tuple
    transform: np.ndarray
    flags: InstanceFlags = InstanceFlags.NONE
    index: int = 0
    movable: bool = False
    motion: Optional[np.ndarray] = None


@dataclass(frozen=True)
class LightDesc:
    """See SppmLightDesc; `transform` (3, 4) float64, light goes along its -z; `motion` as of InstanceDesc."""

    name: str
    type: LightType
    transform: np.ndarray
    emission: tuple
    flags: LightFlags = LightFlags.NONE
    radius: float = 0.0
    angle: float = 0.0
    blend: float = 0.0
    size_x: float = 0.0
    size_y: float = 0.0
    motion: Optional[np.ndarray] = None


@dataclass(frozen=True)
class WorldDesc:
    """Radiance (factor of the image if there is one); `rotation` (3, 3) world direction to image direction or None."""

    radiance: tuple
    image: int = 0
    rotation: Optional[np.ndarray] = None
    hidden_from_camera: bool = False


@dataclass(frozen=True)
class CameraDesc:
    """See SppmCameraDesc; `window`: left, right, bottom, top of the image; `region`: x, y, width, height, from bottom left."""

    transform: np.ndarray  # (3, 4) float64
    window: tuple
    width: int
    height: int
    projection: Projection = Projection.PERSPECTIVE
    clip_near: float = 0.1
    clip_far: float = 1000.0
    aperture_radius: float = 0.0
    aperture_ratio: float = 1.0
    focal_distance: float = 1.0
    region: Optional[tuple] = None


@dataclass
class SceneDesc:
    """A whole scene, in world space moved by -`origin` so that float32 is fine enough far from Blender's origin.

    `camera_motion`: the camera at times evenly spaced from the opening of the shutter to its closing; empty if it does not move.
    """

    camera: Optional[CameraDesc] = None
    camera_motion: tuple = ()
    world: Optional[WorldDesc] = None
    images: list = field(default_factory=list)
    textures: list = field(default_factory=list)
    materials: list = field(default_factory=list)
    meshes: list = field(default_factory=list)
    instances: list = field(default_factory=list)
    lights: list = field(default_factory=list)
    origin: tuple = (0.0, 0.0, 0.0)


# ---------------------------------------------------------------- validation


class SceneError(ValueError):
    """A scene that cannot be rendered; the message names the item and the field."""


def validate(scene: SceneDesc) -> None:
    """Refuses wrong shapes, types, indices and numbers that are not finite.

    Raises:
        SceneError: naming the first item found to be wrong.
    """
    for position, image in enumerate(scene.images, 1):
        _validate_image(_label("image", position, image.name), image)
    for position, texture in enumerate(scene.textures, 1):
        _validate_texture(_label("texture", position), texture, position, len(scene.images))
    for position, material in enumerate(scene.materials, 1):
        _validate_material(_label("material", position, material.name), material, len(scene.textures))
    for position, mesh in enumerate(scene.meshes, 1):
        _validate_mesh(_label("mesh", position, mesh.name), mesh)
    # The slots of a mesh are counted once, however many instances it has.
    slot_counts = [_slot_count(mesh) for mesh in scene.meshes]
    for position, instance in enumerate(scene.instances, 1):
        _validate_instance(_label("instance", position, instance.name), instance, slot_counts, len(scene.materials))
    for position, light in enumerate(scene.lights, 1):
        _validate_light(_label("light", position, light.name), light)
    _validate_world(scene.world, len(scene.images))
    for camera in (scene.camera, *scene.camera_motion):
        _validate_camera(camera)


def _label(kind, position, name=""):
    return f"{kind} {position} '{name}'" if name else f"{kind} {position}"


def _require(condition, label, message):
    if not condition:
        raise SceneError(f"{label}: {message}")


def _require_array(label, name, array, shape, dtypes):
    """`shape` has None where any length is allowed."""
    _require(isinstance(array, np.ndarray), label, f"{name} must be a numpy array, is {type(array).__name__}")
    matches = array.ndim == len(shape) and all(want in (None, got) for want, got in zip(shape, array.shape))
    _require(matches, label, f"{name} has shape {array.shape}, must have {tuple('n' if s is None else s for s in shape)}")
    _require(array.dtype in dtypes, label, f"{name} is {array.dtype}, must be {' or '.join(np.dtype(d).name for d in dtypes)}")
    if array.dtype.kind == "f":
        _require(np.isfinite(array).all(), label, f"{name} has numbers that are not finite")


def _require_finite(label, name, values, count=None):
    values = np.atleast_1d(np.asarray(values, dtype=np.float64))
    _require(count is None or values.size == count, label, f"{name} has {values.size} numbers, must have {count}")
    _require(np.isfinite(values).all(), label, f"{name} = {values.tolist()} is not finite")


def _require_not_negative(label, name, values, count=None):
    _require_finite(label, name, values, count)
    _require(np.min(values) >= 0, label, f"{name} = {values} must not be negative")


def _require_id(label, name, value, last):
    _require(0 <= value <= last, label, f"{name} = {value} must be between 0 and {last}")


def _require_pass_index(label, index):
    _require(0 <= index < 1 << 32, label, f"index = {index} must be between 0 and 2^32 - 1")


def _require_indices(label, name, indices, count):
    _require(indices.size == 0 or int(indices.max()) < count, label, f"{name} has an index beyond the {count} there are")


def _require_transform(label, transform):
    _require_array(label, "transform", transform, (3, 4), (np.float64, np.float32))


def _require_motion(label, motion):
    if motion is not None:
        _require_array(label, "motion", motion, (None, 3, 4), (np.float64, np.float32))
        _require(len(motion) > 0, label, "motion has no key")


def _validate_image(label, image):
    _require_array(label, "pixels", image.pixels, (None, None, 4), (np.float32, np.uint8))
    _require(image.pixels.size > 0, label, "pixels is empty")


def _validate_texture(label, texture, position, image_count):
    _require_finite(label, "value", texture.value, 3)
    if texture.mapping is not None:
        _require_finite(label, "mapping", texture.mapping, 12)
    _require_id(label, "image", texture.image, image_count)
    needs_image = texture.type in (TextureType.IMAGE, TextureType.IMAGE_ALPHA)
    _require(texture.image > 0 or not needs_image, label, "an image texture needs an image")
    for name in ("a", "b", "factor"):
        _require_id(label, name, getattr(texture, name), position - 1)


def _validate_material(label, material, texture_count):
    _require_pass_index(label, material.index)
    _require(len(material.closures) <= 16, label, f"has {len(material.closures)} closures, at most 16 are possible")
    for closure in material.closures:
        for name in ("weight", "color", "color2", "roughness"):
            param = getattr(closure, name)
            _require_not_negative(label, f"{closure.type.name} {name}", param.value, 3)
            _require_id(label, f"{closure.type.name} {name} texture", param.texture, texture_count)
        _require_finite(label, f"{closure.type.name} ior", closure.ior)
        _require(closure.ior > 0, label, f"{closure.type.name} ior = {closure.ior} must be positive")


def _validate_mesh(label, mesh):
    _require_array(label, "positions", mesh.positions, (None, 3), (np.float32,))
    _require_array(label, "indices", mesh.indices, (None, 3), (np.uint32,))
    _require_indices(label, "indices", mesh.indices, len(mesh.positions))
    corner_count = None
    for name, channels in (("corner_normals", 3), ("corner_uvs", 2), ("corner_colors", 3)):
        array = getattr(mesh, name)
        if array is not None:
            _require_array(label, name, array, (corner_count, channels), (np.float32,))
            corner_count = len(array)
    if corner_count is not None:
        _require(mesh.corners is not None, label, "corner arrays need `corners`")
        _require_array(label, "corners", mesh.corners, mesh.indices.shape, (np.uint32,))
        _require_indices(label, "corners", mesh.corners, corner_count)
    if mesh.material_slots is not None:
        _require_array(label, "material_slots", mesh.material_slots, (len(mesh.indices),), (np.uint32,))


def _slot_count(mesh):
    if mesh.material_slots is None or mesh.material_slots.size == 0:
        return 1
    return int(mesh.material_slots.max()) + 1


def _validate_instance(label, instance, slot_counts, material_count):
    _require(1 <= instance.mesh <= len(slot_counts), label, f"mesh = {instance.mesh} must be between 1 and {len(slot_counts)}")
    needed = slot_counts[instance.mesh - 1]
    _require(len(instance.materials) >= needed, label, f"has {len(instance.materials)} materials, its mesh needs {needed}")
    for material in instance.materials:
        _require_id(label, "material", material, material_count)
    _require_transform(label, instance.transform)
    _require_motion(label, instance.motion)
    _require_pass_index(label, instance.index)


def _validate_light(label, light):
    _require_transform(label, light.transform)
    _require_motion(label, light.motion)
    _require_finite(label, "emission", light.emission, 3)
    for name in ("radius", "angle", "blend", "size_x", "size_y"):
        _require_not_negative(label, name, getattr(light, name), 1)


def _validate_world(world, image_count):
    if world is None:
        return
    _require_not_negative("world", "radiance", world.radiance, 3)
    _require_id("world", "image", world.image, image_count)
    if world.rotation is not None:
        _require_finite("world", "rotation", world.rotation, 9)


def _validate_camera(camera):
    _require(camera is not None, "scene", "has no camera")
    _require_transform("camera", camera.transform)
    _require_finite("camera", "window", camera.window, 4)
    for name in ("clip_near", "clip_far", "aperture_radius", "aperture_ratio", "focal_distance"):
        _require_not_negative("camera", name, getattr(camera, name), 1)
    _require(camera.width > 0 and camera.height > 0, "camera", f"size {camera.width} x {camera.height} must be positive")
    if camera.region is not None:
        x, y, width, height = camera.region
        inside = x >= 0 and y >= 0 and width > 0 and height > 0 and x + width <= camera.width and y + height <= camera.height
        _require(inside, "camera", f"region {camera.region} must lie inside {camera.width} x {camera.height}")
