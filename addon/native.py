"""The renderer as Python objects: a `Scene` and `Session`s that render it with `Settings` (no Blender here).

Functions and fields are those of `native/include/sppm/sppm.h`.
"""

import ctypes
import os
from ctypes import POINTER, c_float, c_uint32, c_uint64, c_void_p
from dataclasses import dataclass, fields

import numpy as np

from . import native_abi as abi
from . import native_structs as structs
from .native_library import SppmError, library
from .scene_desc import SceneDesc
from .scene_validation import validate, validate_place

PASS_NAMES = ("Combined", "Depth", "Normal", "Direct", "Indirect", "Caustics", "Radius", "Photons", "Position", "UV",
              "Object Index", "Material Index", "Mist", "Emission", "Environment", "Diffuse Color", "Denoising Albedo",
              "Denoising Normal")
PIXEL_FILTERS = ("BLACKMAN_HARRIS", "BOX")
INDIRECT = ("PHOTONS", "PATHS", "AUTO")
RADIUS_RULES = ("PROGRESSIVE", "DENSITY", "PASS_INDEXED")


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
        """Places an instance, counted from 1 and added `movable`, elsewhere; `update` makes it so. `transform` is (3, 4)."""
        validate_place(number, transform)
        self._lib.sppm_scene_move_instance(self._handle, number, structs.floats(np.asarray(transform)))

    def set_light(self, number, light):
        """Replaces a lamp, counted from 1, by that of a LightDesc; `update` makes it so."""
        self._lib.sppm_scene_set_light(self._handle, number, structs.light_struct(light))

    def set_camera(self, camera):
        """Looks through another CameraDesc from now on; sessions whose picture has another size go on no more."""
        self._lib.sppm_scene_set_camera(self._handle, structs.camera_struct(camera))
        self.size = _size_of(camera)

    def update(self, threads=0):
        """Carries out what was moved; no session of the scene may be in a step."""
        self._lib.sppm_scene_update(self._handle, threads)

    def info(self):
        """Sizes, bounds and power of the scene as a dict; the keys are the fields of SppmSceneInfo."""
        info = abi.SceneInfo()
        self._lib.sppm_scene_info(self._handle, info)
        values = {name: getattr(info, name) for name, _ in abi.SceneInfo._fields_}
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
            add, describe = getattr(self._lib, f"sppm_scene_add_{kind}"), getattr(structs, f"{kind}_struct")
            for item in getattr(desc, "meshes" if kind == "mesh" else kind + "s"):
                add(self._handle, describe(item), c_uint32())
        if desc.world:
            self._lib.sppm_scene_set_world(self._handle, structs.world_struct(desc.world))
        if desc.camera:
            self._lib.sppm_scene_set_camera(self._handle, structs.camera_struct(desc.camera))
        if desc.camera_motion:
            keys = (abi.Camera * len(desc.camera_motion))(*map(structs.camera_struct, desc.camera_motion))
            self._lib.sppm_scene_set_camera_motion(self._handle, keys, len(keys))


def _size_of(camera):
    """Width and height of what the camera renders."""
    return camera.region[2:] if camera.region else (camera.width, camera.height)


@dataclass
class Settings:
    """Names, units and meanings of SppmSettings; `passes` are names from `PASS_NAMES` that will be read."""

    iterations: int = 64
    photons_per_iteration: int = 0
    initial_radius: float = 0.0
    max_depth: int = 24
    pixel_filter: str = "BLACKMAN_HARRIS"
    filter_width: float = 1.5
    gamma: float = 0.7
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
        for name, kind in abi.Settings._fields_:
            if kind in (c_uint32, c_uint64) and not 0 <= values[name] < 1 << 8 * ctypes.sizeof(kind):
                raise SppmError(f"{name} = {values[name]} does not fit an unsigned integer of {8 * ctypes.sizeof(kind)} bits")
        return abi.Settings(**values)


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
        struct = abi.Progress()
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
