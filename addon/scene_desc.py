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
    SMOOTH_ALBEDO = 256


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

    What is `movable` can be placed elsewhere once the scene is built; its rays take a little longer. `motion` (keys, 3, 4)
    float64 is where it stands while the shutter is open, evenly spaced in time, from its opening to its closing; None if it does
    not move.
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
