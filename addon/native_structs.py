"""Descriptions as the structs that the library reads.

Arrays are made contiguous and live as long as the struct that points to them; the library copies what it needs.
"""

from ctypes import POINTER, c_float, c_uint8, c_uint32

import numpy as np

from . import native_abi as abi


def _pointer(array, dtype, c_type):
    """A typed pointer to a contiguous array, which the pointer keeps alive; NULL for None."""
    if array is None:
        return None
    array = np.ascontiguousarray(array, dtype=dtype)
    pointer = array.ctypes.data_as(POINTER(c_type))
    pointer.owner = array
    return pointer


def floats(array):
    """As `_pointer`, to float32."""
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


def image_struct(image):
    height, width = image.pixels.shape[:2]
    f32 = floats(image.pixels) if image.pixels.dtype != np.uint8 else None
    u8 = _pointer(image.pixels, np.uint8, c_uint8) if image.pixels.dtype == np.uint8 else None
    struct = abi.Image(width=width, height=height, pixels=f32, pixels_u8=u8, encoding=int(image.srgb), name=image.name.encode())
    return _keep(struct, f32, u8)


def texture_struct(texture):
    return abi.Texture(type=texture.type, value=tuple(texture.value), image=texture.image, interpolation=texture.interpolation,
                       extension=texture.extension, mapping=tuple(texture.mapping or (0.0,) * 12), blend=texture.blend,
                       a=texture.a, b=texture.b, factor=texture.factor)


def _param(param):
    return abi.Param(value=tuple(param.value), texture=param.texture)


def _closure_struct(closure):
    return abi.Closure(type=closure.type, flags=closure.flags, weight=_param(closure.weight), color=_param(closure.color),
                       color2=_param(closure.color2), roughness=_param(closure.roughness), ior=closure.ior)


def material_struct(material):
    closures = (abi.Closure * len(material.closures))(*map(_closure_struct, material.closures))
    struct = abi.Material(closure_count=len(closures), closures=closures if closures else None, index=material.index,
                          name=material.name.encode())
    return _keep(struct, closures)


def mesh_struct(mesh):
    corner_arrays = [a for a in (mesh.corner_normals, mesh.corner_uvs, mesh.corner_colors) if a is not None]
    pointers = {"positions": floats(mesh.positions), "indices": _uints(mesh.indices), "corners": _uints(mesh.corners),
                "corner_normals": floats(mesh.corner_normals), "corner_uvs": floats(mesh.corner_uvs),
                "corner_colors": floats(mesh.corner_colors), "material_slots": _uints(mesh.material_slots)}
    struct = abi.Mesh(vertex_count=len(mesh.positions), triangle_count=len(mesh.indices), name=mesh.name.encode(),
                      corner_count=len(corner_arrays[0]) if corner_arrays else 0, **pointers)
    return _keep(struct, pointers)


def instance_struct(instance):
    materials, motion = _uints(instance.materials), floats(instance.motion)
    struct = abi.Instance(mesh=instance.mesh, material_count=len(instance.materials), materials=materials,
                          transform=_matrix(instance.transform), flags=instance.flags, index=instance.index,
                          name=instance.name.encode(), movable=int(instance.movable), motion_count=_count(instance.motion),
                          motion=motion)
    return _keep(struct, materials, motion)


def light_struct(light):
    motion = floats(light.motion)
    struct = abi.Light(type=light.type, flags=light.flags, transform=_matrix(light.transform), emission=tuple(light.emission),
                       radius=light.radius, angle=light.angle, blend=light.blend, size_x=light.size_x, size_y=light.size_y,
                       name=light.name.encode(), motion_count=_count(light.motion), motion=motion)
    return _keep(struct, motion)


def world_struct(world):
    rotation = (0.0,) * 9 if world.rotation is None else tuple(np.asarray(world.rotation, dtype=np.float64).ravel())
    return abi.World(radiance=tuple(world.radiance), image=world.image, rotation=rotation,
                     hidden_from_camera=int(world.hidden_from_camera))


def camera_struct(camera):
    x, y, width, height = camera.region or (0, 0, 0, 0)
    return abi.Camera(projection=camera.projection, transform=_matrix(camera.transform), window=tuple(camera.window),
                      clip_near=camera.clip_near, clip_far=camera.clip_far, aperture_radius=camera.aperture_radius,
                      aperture_ratio=camera.aperture_ratio, focal_distance=camera.focal_distance, width=camera.width,
                      height=camera.height, region_x=x, region_y=y, region_width=width, region_height=height)
