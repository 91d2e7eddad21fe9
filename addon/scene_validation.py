"""Refuses a description that the library could not render, by the name of the item and the field."""

import numpy as np

from .scene_desc import SceneDesc, TextureType


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


def validate_place(position: int, transform) -> None:
    """Refuses what cannot be the place of an instance, counted from 1: other than 12 finite numbers.

    Raises:
        SceneError: naming the instance.
    """
    _require_finite(_label("instance", position), "transform", transform, 12)


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
