"""The renderer library `libsppm.so` behind Python objects: the only module that uses ctypes, and no Blender here.

Structs and prototypes mirror `native/include/sppm/sppm.h`. A status other than SPPM_OK becomes an `SppmError` with the library's
own message. Arrays are made contiguous and kept alive for the length of a call; the library copies what it needs.
"""

import ctypes
import os
from ctypes import POINTER, c_char_p, c_double, c_float, c_uint8, c_uint32, c_uint64, c_void_p
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from .scene_desc import SceneDesc, validate

ABI_VERSION = 4
LIBRARY_PATH = Path(__file__).parent / "lib" / "libsppm.so"

PASS_NAMES = ("Combined", "Depth", "Normal", "Direct", "Indirect", "Caustics", "Radius", "Photons", "Position", "UV", "Object Index",
              "Material Index", "Mist", "Emission", "Environment", "Diffuse Color", "Denoising Albedo", "Denoising Normal")
PIXEL_FILTERS = ("BLACKMAN_HARRIS", "BOX")
INDIRECT = ("PHOTONS", "PATHS", "AUTO")
RADIUS_RULES = ("PROGRESSIVE", "DENSITY", "PASS_INDEXED")
STATUS_CANCELLED = 7
STATUS_NAMES = ("OK", "invalid argument", "invalid state", "out of memory", "I/O error", "unsupported", "internal error",
                "cancelled")


class SppmError(RuntimeError):
    """A call of the library failed; `status` is its SppmStatus (0 if the library could not be used at all)."""

    def __init__(self, message, status=0):
        super().__init__(message)
        self.status = status


class Cancelled(SppmError):
    """The step was given up; the session is as the iteration before left it."""


# ---------------------------------------------------------------- structs


class _Sized(ctypes.Structure):
    """A description struct: its first field is its own size."""

    _fields_ = [("struct_size", c_uint64)]

    def __init__(self, **values):
        super().__init__(struct_size=ctypes.sizeof(self), **values)


class _Image(_Sized):
    _fields_ = [("width", c_uint64), ("height", c_uint64), ("pixels", POINTER(c_float)), ("pixels_u8", POINTER(c_uint8)),
                ("encoding", c_uint32), ("name", c_char_p)]


class _Texture(_Sized):
    _fields_ = [("type", c_uint32), ("value", c_float * 3), ("image", c_uint32), ("interpolation", c_uint32),
                ("extension", c_uint32), ("mapping", c_float * 12), ("blend", c_uint32), ("a", c_uint32), ("b", c_uint32),
                ("factor", c_uint32)]


class _Param(ctypes.Structure):
    _fields_ = [("value", c_float * 3), ("texture", c_uint32)]


class _Closure(_Sized):
    _fields_ = [("type", c_uint32), ("flags", c_uint32), ("weight", _Param), ("color", _Param), ("color2", _Param),
                ("roughness", _Param), ("ior", c_float)]


class _Material(_Sized):
    _fields_ = [("closure_count", c_uint64), ("closures", POINTER(_Closure)), ("index", c_uint32), ("name", c_char_p)]


class _Mesh(_Sized):
    _fields_ = [("vertex_count", c_uint64), ("triangle_count", c_uint64), ("corner_count", c_uint64),
                ("positions", POINTER(c_float)), ("indices", POINTER(c_uint32)), ("corners", POINTER(c_uint32)),
                ("corner_normals", POINTER(c_float)), ("corner_uvs", POINTER(c_float)), ("corner_colors", POINTER(c_float)),
                ("material_slots", POINTER(c_uint32)), ("name", c_char_p)]


class _Instance(_Sized):
    _fields_ = [("mesh", c_uint32), ("material_count", c_uint32), ("materials", POINTER(c_uint32)), ("transform", c_float * 12),
                ("flags", c_uint32), ("index", c_uint32), ("name", c_char_p), ("movable", c_uint32), ("motion_count", c_uint32),
                ("motion", POINTER(c_float))]


class _Light(_Sized):
    _fields_ = [("type", c_uint32), ("flags", c_uint32), ("transform", c_float * 12), ("emission", c_float * 3),
                ("radius", c_float), ("angle", c_float), ("blend", c_float), ("size_x", c_float), ("size_y", c_float),
                ("name", c_char_p), ("motion_count", c_uint32), ("motion", POINTER(c_float))]


class _World(_Sized):
    _fields_ = [("radiance", c_float * 3), ("image", c_uint32), ("rotation", c_float * 9), ("hidden_from_camera", c_uint32)]


class _Camera(_Sized):
    _fields_ = [("projection", c_uint32), ("transform", c_float * 12), ("window", c_float * 4), ("clip_near", c_float),
                ("clip_far", c_float), ("aperture_radius", c_float), ("aperture_ratio", c_float), ("focal_distance", c_float),
                ("width", c_uint64), ("height", c_uint64), ("region_x", c_uint64), ("region_y", c_uint64),
                ("region_width", c_uint64), ("region_height", c_uint64)]


class _SceneInfo(_Sized):
    _fields_ = [("triangle_count", c_uint64), ("instance_count", c_uint64), ("light_count", c_uint64), ("light_power", c_double),
                ("bounds_min", c_double * 3), ("bounds_max", c_double * 3), ("memory_bytes", c_uint64),
                ("has_specular", c_uint32), ("has_transparent", c_uint32), ("has_textures", c_uint32)]


class _Settings(_Sized):
    _fields_ = [("iterations", c_uint64), ("photons_per_iteration", c_uint64), ("initial_radius", c_double),
                ("max_depth", c_uint32), ("pixel_filter", c_uint32), ("filter_width", c_double), ("gamma", c_double),
                ("seed", c_uint64), ("time_limit", c_double), ("write_interval", c_uint64), ("snapshot_path", c_char_p),
                ("threads", c_uint32), ("transparent_film", c_uint32), ("passes", c_uint64), ("indirect", c_uint32),
                ("radius_rule", c_uint32), ("aim_photons", c_uint32), ("alpha_threshold", c_float), ("mist_start", c_float),
                ("mist_depth", c_float), ("mist_power", c_float), ("origin", c_double * 3)]


class _Progress(_Sized):
    _fields_ = [("iteration", c_uint64), ("photons_emitted", c_uint64), ("photons_stored", c_uint64), ("rays_camera", c_uint64),
                ("rays_shadow", c_uint64), ("rays_photon", c_uint64), ("dropped_samples", c_uint64), ("seconds", c_double),
                ("seconds_camera", c_double), ("seconds_photons", c_double), ("seconds_grid", c_double),
                ("seconds_gather", c_double), ("memory_bytes", c_uint64), ("finished", c_uint32), ("indirect", c_uint32)]


# ---------------------------------------------------------------- library

_ID_OUT = POINTER(c_uint32)
_HANDLE_OUT = POINTER(c_void_p)

# Functions that return a status, and their argument types.
_PROTOTYPES = {
    "sppm_self_test": [],
    "sppm_scene_create": [_HANDLE_OUT],
    "sppm_scene_add_image": [c_void_p, POINTER(_Image), _ID_OUT],
    "sppm_scene_add_texture": [c_void_p, POINTER(_Texture), _ID_OUT],
    "sppm_scene_add_material": [c_void_p, POINTER(_Material), _ID_OUT],
    "sppm_scene_add_mesh": [c_void_p, POINTER(_Mesh), _ID_OUT],
    "sppm_scene_add_instance": [c_void_p, POINTER(_Instance), _ID_OUT],
    "sppm_scene_add_light": [c_void_p, POINTER(_Light), _ID_OUT],
    "sppm_scene_set_world": [c_void_p, POINTER(_World)],
    "sppm_scene_set_camera": [c_void_p, POINTER(_Camera)],
    "sppm_scene_set_camera_motion": [c_void_p, POINTER(_Camera), c_uint32],
    "sppm_scene_commit": [c_void_p, c_uint32],
    "sppm_scene_move_instance": [c_void_p, c_uint32, POINTER(c_float)],
    "sppm_scene_set_light": [c_void_p, c_uint32, POINTER(_Light)],
    "sppm_scene_update": [c_void_p, c_uint32],
    "sppm_scene_info": [c_void_p, POINTER(_SceneInfo)],
    "sppm_session_create": [c_void_p, POINTER(_Settings), _HANDLE_OUT],
    "sppm_session_step": [c_void_p],
    "sppm_session_cancel": [c_void_p],
    "sppm_session_progress": [c_void_p, POINTER(_Progress)],
    "sppm_pass_channels": [c_uint32, _ID_OUT],
    "sppm_session_read_pass": [c_void_p, c_uint32, POINTER(c_float), c_uint64],
    "sppm_session_write_exr": [c_void_p, c_char_p],
}

# The others: result and argument types.
_PLAIN_PROTOTYPES = {
    "sppm_abi_version": (c_uint32, []),
    "sppm_version": (c_char_p, []),
    "sppm_last_message": (c_char_p, []),
    "sppm_scene_destroy": (None, [c_void_p]),
    "sppm_session_destroy": (None, [c_void_p]),
}

_libraries = {}


def library(path=None):
    """Loads the library once, compares ABI versions and traces the known ray.

    Load it after bpy: RTLD_DEEPBIND makes it find its own Embree and TBB before those of Blender.

    Args:
        path: of the shared library; None for `lib/libsppm.so` beside this file.

    Raises:
        SppmError: it is missing, was built for another interface, or the process gives it a foreign Embree.
    """
    path = Path(path or LIBRARY_PATH).resolve()
    if path not in _libraries:
        _libraries[path] = _load(path)
    return _libraries[path]


def version():
    """The library's version and those of what it was built with."""
    return library().sppm_version().decode()


def _load(path):
    if not path.is_file():
        raise SppmError(f"the renderer library is missing: {path} (build it with ./dev build)")
    try:
        lib = ctypes.CDLL(str(path), mode=os.RTLD_NOW | os.RTLD_LOCAL | getattr(os, "RTLD_DEEPBIND", 0))
        _declare(lib)
    except (OSError, AttributeError) as error:
        raise SppmError(f"cannot load {path}: {error}") from error
    return lib


def _declare(lib):
    for name, (result, arguments) in _PLAIN_PROTOTYPES.items():
        function = getattr(lib, name)
        function.restype, function.argtypes = result, arguments
    if lib.sppm_abi_version() != ABI_VERSION:
        raise SppmError(f"the library has interface version {lib.sppm_abi_version()}, the add-on needs {ABI_VERSION}")
    for name, arguments in _PROTOTYPES.items():
        function = getattr(lib, name)
        function.restype, function.argtypes = c_uint32, arguments
        function.errcheck = _raise_on_failure(lib)
    lib.sppm_self_test()


def _raise_on_failure(lib):
    def check(status, function, _arguments):
        if status == 0:
            return
        name = STATUS_NAMES[status] if status < len(STATUS_NAMES) else f"status {status}"
        message = (lib.sppm_last_message() or b"").decode("utf-8", "replace") or f"{function.__name__}: {name}"
        raise (Cancelled if status == STATUS_CANCELLED else SppmError)(message, status)

    return check


# ---------------------------------------------------------------- scene


class Scene:
    """A committed scene of the library: only places, lamps and the camera can change.

    Args:
        desc: what to add; it is validated first.
        threads: to build the BVH with; 0 for all cores.
    """

    def __init__(self, desc: SceneDesc, threads=0, library_path=None):
        self._handle = None
        validate(desc)
        self._lib = library(library_path)
        handle = c_void_p()
        self._lib.sppm_scene_create(handle)
        self._handle = handle
        try:
            self._add_all(desc)
            self._lib.sppm_scene_commit(self._handle, threads)
        except BaseException:
            self.close()
            raise
        self.size = _size_of(desc.camera)

    def move_instance(self, number, transform):
        """Places an instance, counted from 1 and added `movable`, elsewhere; `update` makes it so."""
        self._lib.sppm_scene_move_instance(self._handle, number, _floats(np.asarray(transform)))

    def set_light(self, number, light):
        """Replaces a lamp, counted from 1, by that of a LightDesc; `update` makes it so."""
        self._lib.sppm_scene_set_light(self._handle, number, _light_struct(light))

    def set_camera(self, camera):
        """Looks through another CameraDesc from now on; sessions whose picture has another size go on no more."""
        self._lib.sppm_scene_set_camera(self._handle, _camera_struct(camera))
        self.size = _size_of(camera)

    def update(self, threads=0):
        """Carries out what was moved; no session of the scene may be in a step."""
        self._lib.sppm_scene_update(self._handle, threads)

    def info(self):
        """Sizes, bounds and power of the scene as a dict; the keys are the fields of SppmSceneInfo."""
        info = _SceneInfo()
        self._lib.sppm_scene_info(self._handle, info)
        values = {name: getattr(info, name) for name, _ in _SceneInfo._fields_}
        return {name: tuple(value) if name.startswith("bounds") else value for name, value in values.items()}

    def close(self):
        """Frees the scene; sessions that use it keep what they need."""
        if self._handle:
            self._lib.sppm_scene_destroy(self._handle)
            self._handle = None

    __del__ = close

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def _add_all(self, desc):
        for kind in ("image", "texture", "material", "mesh", "instance", "light"):
            add, describe = getattr(self._lib, f"sppm_scene_add_{kind}"), globals()[f"_{kind}_struct"]
            for item in getattr(desc, "meshes" if kind == "mesh" else kind + "s"):
                add(self._handle, describe(item), c_uint32())
        if desc.world:
            self._lib.sppm_scene_set_world(self._handle, _world_struct(desc.world))
        if desc.camera:
            self._lib.sppm_scene_set_camera(self._handle, _camera_struct(desc.camera))
        if desc.camera_motion:
            keys = (_Camera * len(desc.camera_motion))(*map(_camera_struct, desc.camera_motion))
            self._lib.sppm_scene_set_camera_motion(self._handle, keys, len(keys))


def _pointer(array, dtype, c_type):
    """A typed pointer to a contiguous array, which the pointer keeps alive; NULL for None."""
    if array is None:
        return None
    array = np.ascontiguousarray(array, dtype=dtype)
    pointer = array.ctypes.data_as(POINTER(c_type))
    pointer.owner = array
    return pointer


def _floats(array):
    return _pointer(array, np.float32, c_float)


def _uints(array):
    return _pointer(array, np.uint32, c_uint32)


def _count(array):
    """Length of an array, 0 for None."""
    return 0 if array is None else len(array)


def _keep(struct, *owners):
    """Ties what a struct points to to its own life: a struct's pointer fields do not keep their targets alive by themselves."""
    struct.owners = owners
    return struct


def _matrix(transform):
    return tuple(np.asarray(transform, dtype=np.float64).ravel()[:12])


def _image_struct(image):
    height, width = image.pixels.shape[:2]
    floats = _floats(image.pixels) if image.pixels.dtype != np.uint8 else None
    u8 = _pointer(image.pixels, np.uint8, c_uint8) if image.pixels.dtype == np.uint8 else None
    struct = _Image(width=width, height=height, pixels=floats, pixels_u8=u8, encoding=int(image.srgb), name=image.name.encode())
    return _keep(struct, floats, u8)


def _texture_struct(texture):
    return _Texture(type=texture.type, value=tuple(texture.value), image=texture.image, interpolation=texture.interpolation,
                    extension=texture.extension, mapping=tuple(texture.mapping or (0.0,) * 12), blend=texture.blend,
                    a=texture.a, b=texture.b, factor=texture.factor)


def _param(param):
    return _Param(value=tuple(param.value), texture=param.texture)


def _closure_struct(closure):
    return _Closure(type=closure.type, flags=closure.flags, weight=_param(closure.weight), color=_param(closure.color),
                    color2=_param(closure.color2), roughness=_param(closure.roughness), ior=closure.ior)


def _material_struct(material):
    closures = (_Closure * len(material.closures))(*map(_closure_struct, material.closures))
    struct = _Material(closure_count=len(closures), closures=closures if closures else None, index=material.index,
                       name=material.name.encode())
    return _keep(struct, closures)


def _mesh_struct(mesh):
    corner_arrays = [a for a in (mesh.corner_normals, mesh.corner_uvs, mesh.corner_colors) if a is not None]
    pointers = {"positions": _floats(mesh.positions), "indices": _uints(mesh.indices), "corners": _uints(mesh.corners),
                "corner_normals": _floats(mesh.corner_normals), "corner_uvs": _floats(mesh.corner_uvs),
                "corner_colors": _floats(mesh.corner_colors), "material_slots": _uints(mesh.material_slots)}
    struct = _Mesh(vertex_count=len(mesh.positions), triangle_count=len(mesh.indices), name=mesh.name.encode(),
                   corner_count=len(corner_arrays[0]) if corner_arrays else 0, **pointers)
    return _keep(struct, pointers)


def _instance_struct(instance):
    materials, motion = _uints(instance.materials), _floats(instance.motion)
    struct = _Instance(mesh=instance.mesh, material_count=len(instance.materials), materials=materials,
                       transform=_matrix(instance.transform), flags=instance.flags, index=instance.index,
                       name=instance.name.encode(), movable=int(instance.movable), motion_count=_count(instance.motion), motion=motion)
    return _keep(struct, materials, motion)


def _light_struct(light):
    motion = _floats(light.motion)
    struct = _Light(type=light.type, flags=light.flags, transform=_matrix(light.transform), emission=tuple(light.emission),
                    radius=light.radius, angle=light.angle, blend=light.blend, size_x=light.size_x, size_y=light.size_y,
                    name=light.name.encode(), motion_count=_count(light.motion), motion=motion)
    return _keep(struct, motion)


def _world_struct(world):
    rotation = (0.0,) * 9 if world.rotation is None else tuple(np.asarray(world.rotation, dtype=np.float64).ravel())
    return _World(radiance=tuple(world.radiance), image=world.image, rotation=rotation,
                  hidden_from_camera=int(world.hidden_from_camera))


def _size_of(camera):
    """Width and height of what the camera renders."""
    return camera.region[2:] if camera.region else (camera.width, camera.height)


def _camera_struct(camera):
    x, y, width, height = camera.region or (0, 0, 0, 0)
    return _Camera(projection=camera.projection, transform=_matrix(camera.transform), window=tuple(camera.window),
                   clip_near=camera.clip_near, clip_far=camera.clip_far, aperture_radius=camera.aperture_radius,
                   aperture_ratio=camera.aperture_ratio, focal_distance=camera.focal_distance, width=camera.width,
                   height=camera.height, region_x=x, region_y=y, region_width=width, region_height=height)


# ---------------------------------------------------------------- session


@dataclass
class Settings:
    """Names, units and meanings of SppmSettings; `passes` are names from `PASS_NAMES` that will be read."""

    iterations: int = 64
    photons_per_iteration: int = 0
    initial_radius: float = 0.0
    max_depth: int = 24
    pixel_filter: str = "BLACKMAN_HARRIS"
    filter_width: float = 1.5
    gamma: float = 0.8
    seed: int = 0
    time_limit: float = 0.0
    write_interval: int = 0
    snapshot_path: str = ""
    threads: int = 0
    transparent_film: bool = False
    passes: frozenset = frozenset({"Combined"})
    indirect: str = "AUTO"
    radius_rule: str = "DENSITY"
    aim_photons: bool = True
    alpha_threshold: float = 0.0
    mist_start: float = 0.0
    mist_depth: float = 0.0
    mist_power: float = 1.0
    origin: tuple = (0.0, 0.0, 0.0)

    def _struct(self):
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        values["pixel_filter"] = _choice("pixel_filter", self.pixel_filter, PIXEL_FILTERS)
        values["snapshot_path"] = os.fsencode(self.snapshot_path) if self.snapshot_path else None
        values["indirect"] = _choice("indirect", self.indirect, INDIRECT)
        values["radius_rule"] = _choice("radius_rule", self.radius_rule, RADIUS_RULES)
        values["transparent_film"], values["aim_photons"] = int(self.transparent_film), int(self.aim_photons)
        values["passes"] = sum(1 << _choice("passes", name, PASS_NAMES) for name in set(self.passes) | {"Combined"})
        for name, kind in _Settings._fields_:
            if kind in (c_uint32, c_uint64) and not 0 <= values[name] < 1 << 8 * ctypes.sizeof(kind):
                raise SppmError(f"{name} = {values[name]} does not fit an unsigned integer of {8 * ctypes.sizeof(kind)} bits")
        return _Settings(**values)


@dataclass(frozen=True)
class Progress:
    """See SppmProgress: counts since the first step, wall times in seconds; `indirect` is a name of `INDIRECT`."""

    iteration: int
    photons_emitted: int
    photons_stored: int
    rays_camera: int
    rays_shadow: int
    rays_photon: int
    dropped_samples: int
    seconds: float
    seconds_camera: float
    seconds_photons: float
    seconds_grid: float
    seconds_gather: float
    memory_bytes: int
    finished: bool
    indirect: str


class Session:
    """A progressive render of a scene. `cancel` and `progress` may be called from any thread, the rest from one at a time."""

    def __init__(self, scene: Scene, settings: Settings):
        self._handle = None
        self._lib, self.size = scene._lib, scene.size
        handle = c_void_p()
        self._lib.sppm_session_create(scene._handle, settings._struct(), handle)
        self._handle = handle

    def step(self):
        """Renders one iteration, without the GIL.

        Raises:
            Cancelled: `cancel` was called.
        """
        self._lib.sppm_session_step(self._handle)

    def cancel(self):
        """Makes the running step, or else the next one, raise `Cancelled` soon."""
        self._lib.sppm_session_cancel(self._handle)

    def progress(self):
        """The counters as they are now."""
        struct = _Progress()
        self._lib.sppm_session_progress(self._handle, struct)
        values = {f.name: getattr(struct, f.name) for f in fields(Progress)}
        return Progress(**{**values, "finished": bool(struct.finished), "indirect": INDIRECT[struct.indirect]})

    def read_pass(self, name):
        """The pass as (height, width, channels) float32, bottom row first."""
        index, channels = _choice("pass", name, PASS_NAMES), c_uint32()
        self._lib.sppm_pass_channels(index, channels)
        width, height = self.size
        out = np.empty((height, width, channels.value), dtype=np.float32)
        self._lib.sppm_session_read_pass(self._handle, index, out.ctypes.data_as(POINTER(c_float)), out.size)
        return out

    def write_exr(self, path):
        """Writes the requested passes into one OpenEXR file."""
        self._lib.sppm_session_write_exr(self._handle, os.fsencode(path))

    def close(self):
        """Frees the session; no step may be running."""
        if self._handle:
            self._lib.sppm_session_destroy(self._handle)
            self._handle = None

    __del__ = close

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


def _choice(field_name, name, names):
    if name not in names:
        raise SppmError(f"{field_name} = {name!r}: must be one of {', '.join(names)}")
    return names.index(name)
