"""The C ABI as ctypes sees it: structs and prototypes that mirror `native/include/sppm/sppm.h`, field by field."""

import ctypes
from ctypes import POINTER, c_char_p, c_double, c_float, c_uint8, c_uint32, c_uint64, c_void_p

ABI_VERSION = 4


class Sized(ctypes.Structure):
    """A description struct: its first field is its own size."""

    _fields_ = [("struct_size", c_uint64)]

    def __init__(self, **values):
        super().__init__(struct_size=ctypes.sizeof(self), **values)


class Image(Sized):
    _fields_ = [("width", c_uint64), ("height", c_uint64), ("pixels", POINTER(c_float)), ("pixels_u8", POINTER(c_uint8)),
                ("encoding", c_uint32), ("name", c_char_p)]


class Texture(Sized):
    _fields_ = [("type", c_uint32), ("value", c_float * 3), ("image", c_uint32), ("interpolation", c_uint32),
                ("extension", c_uint32), ("mapping", c_float * 12), ("blend", c_uint32), ("a", c_uint32), ("b", c_uint32),
                ("factor", c_uint32)]


class Param(ctypes.Structure):
    _fields_ = [("value", c_float * 3), ("texture", c_uint32)]


class Closure(Sized):
    _fields_ = [("type", c_uint32), ("flags", c_uint32), ("weight", Param), ("color", Param), ("color2", Param),
                ("roughness", Param), ("ior", c_float)]


class Material(Sized):
    _fields_ = [("closure_count", c_uint64), ("closures", POINTER(Closure)), ("index", c_uint32), ("name", c_char_p)]


class Mesh(Sized):
    _fields_ = [("vertex_count", c_uint64), ("triangle_count", c_uint64), ("corner_count", c_uint64),
                ("positions", POINTER(c_float)), ("indices", POINTER(c_uint32)), ("corners", POINTER(c_uint32)),
                ("corner_normals", POINTER(c_float)), ("corner_uvs", POINTER(c_float)), ("corner_colors", POINTER(c_float)),
                ("material_slots", POINTER(c_uint32)), ("name", c_char_p)]


class Instance(Sized):
    _fields_ = [("mesh", c_uint32), ("material_count", c_uint32), ("materials", POINTER(c_uint32)), ("transform", c_float * 12),
                ("flags", c_uint32), ("index", c_uint32), ("name", c_char_p), ("movable", c_uint32), ("motion_count", c_uint32),
                ("motion", POINTER(c_float))]


class Light(Sized):
    _fields_ = [("type", c_uint32), ("flags", c_uint32), ("transform", c_float * 12), ("emission", c_float * 3),
                ("radius", c_float), ("angle", c_float), ("blend", c_float), ("size_x", c_float), ("size_y", c_float),
                ("name", c_char_p), ("motion_count", c_uint32), ("motion", POINTER(c_float))]


class World(Sized):
    _fields_ = [("radiance", c_float * 3), ("image", c_uint32), ("rotation", c_float * 9), ("hidden_from_camera", c_uint32)]


class Camera(Sized):
    _fields_ = [("projection", c_uint32), ("transform", c_float * 12), ("window", c_float * 4), ("clip_near", c_float),
                ("clip_far", c_float), ("aperture_radius", c_float), ("aperture_ratio", c_float), ("focal_distance", c_float),
                ("width", c_uint64), ("height", c_uint64), ("region_x", c_uint64), ("region_y", c_uint64),
                ("region_width", c_uint64), ("region_height", c_uint64)]


class SceneInfo(Sized):
    _fields_ = [("triangle_count", c_uint64), ("instance_count", c_uint64), ("light_count", c_uint64), ("light_power", c_double),
                ("bounds_min", c_double * 3), ("bounds_max", c_double * 3), ("memory_bytes", c_uint64),
                ("has_specular", c_uint32), ("has_transparent", c_uint32), ("has_textures", c_uint32)]


class Settings(Sized):
    _fields_ = [("iterations", c_uint64), ("photons_per_iteration", c_uint64), ("initial_radius", c_double),
                ("max_depth", c_uint32), ("pixel_filter", c_uint32), ("filter_width", c_double), ("gamma", c_double),
                ("seed", c_uint64), ("time_limit", c_double), ("write_interval", c_uint64), ("snapshot_path", c_char_p),
                ("threads", c_uint32), ("transparent_film", c_uint32), ("passes", c_uint64), ("indirect", c_uint32),
                ("radius_rule", c_uint32), ("aim_photons", c_uint32), ("alpha_threshold", c_float), ("mist_start", c_float),
                ("mist_depth", c_float), ("mist_power", c_float), ("origin", c_double * 3)]


class Progress(Sized):
    _fields_ = [("iteration", c_uint64), ("photons_emitted", c_uint64), ("photons_stored", c_uint64), ("rays_camera", c_uint64),
                ("rays_shadow", c_uint64), ("rays_photon", c_uint64), ("dropped_samples", c_uint64), ("seconds", c_double),
                ("seconds_camera", c_double), ("seconds_photons", c_double), ("seconds_grid", c_double),
                ("seconds_gather", c_double), ("memory_bytes", c_uint64), ("finished", c_uint32), ("indirect", c_uint32)]


_ID_OUT = POINTER(c_uint32)
_HANDLE_OUT = POINTER(c_void_p)

# Functions that return a status, and their argument types.
STATUS_PROTOTYPES = {
    "sppm_self_test": [],
    "sppm_scene_create": [_HANDLE_OUT],
    "sppm_scene_add_image": [c_void_p, POINTER(Image), _ID_OUT],
    "sppm_scene_add_texture": [c_void_p, POINTER(Texture), _ID_OUT],
    "sppm_scene_add_material": [c_void_p, POINTER(Material), _ID_OUT],
    "sppm_scene_add_mesh": [c_void_p, POINTER(Mesh), _ID_OUT],
    "sppm_scene_add_instance": [c_void_p, POINTER(Instance), _ID_OUT],
    "sppm_scene_add_light": [c_void_p, POINTER(Light), _ID_OUT],
    "sppm_scene_set_world": [c_void_p, POINTER(World)],
    "sppm_scene_set_camera": [c_void_p, POINTER(Camera)],
    "sppm_scene_set_camera_motion": [c_void_p, POINTER(Camera), c_uint32],
    "sppm_scene_commit": [c_void_p, c_uint32],
    "sppm_scene_move_instance": [c_void_p, c_uint32, POINTER(c_float)],
    "sppm_scene_set_light": [c_void_p, c_uint32, POINTER(Light)],
    "sppm_scene_update": [c_void_p, c_uint32],
    "sppm_scene_info": [c_void_p, POINTER(SceneInfo)],
    "sppm_session_create": [c_void_p, POINTER(Settings), _HANDLE_OUT],
    "sppm_session_step": [c_void_p],
    "sppm_session_cancel": [c_void_p],
    "sppm_session_progress": [c_void_p, POINTER(Progress)],
    "sppm_pass_channels": [c_uint32, _ID_OUT],
    "sppm_session_read_pass": [c_void_p, c_uint32, POINTER(c_float), c_uint64],
    "sppm_session_write_exr": [c_void_p, c_char_p],
}

# The others: result and argument types.
PLAIN_PROTOTYPES = {
    "sppm_abi_version": (c_uint32, []),
    "sppm_version": (c_char_p, []),
    "sppm_last_message": (c_char_p, []),
    "sppm_scene_destroy": (None, [c_void_p]),
    "sppm_session_destroy": (None, [c_void_p]),
}
