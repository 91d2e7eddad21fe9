"""Blender's lamps and world -> LightDesc and WorldDesc, in radiometric units.

The factors are measured with Cycles (docs/blender.md): with power P [W], a point or spot has radiant intensity P / (4 pi), a sun
the irradiance that its strength times `compat.sun_irradiance` says, an area light the radiance that
`compat.area_radiance_per_watt` says.
"""

import math

import mathutils
import numpy as np

from . import compat
from .nodes_input import blackbody_color
from .scene_desc import LightDesc, LightFlags, LightType, WorldDesc

# ---------------------------------------------------------------- lamps


def export_light(obj, matrix, warn):
    """A lamp as seen by the renderer, or None if it gives no light.

    Args:
        obj: evaluated object whose data is a light.
        matrix: mathutils 4x4, light to world.
        warn: called with a message for what the engine cannot do.
    """
    light = obj.data
    energy = compat.light_energy(light, matrix) * _emission_factor(light, warn)
    if np.any(energy < 0.0):
        warn(f"light '{obj.name}': a negative power cannot be rendered and counts as 0")
        energy = np.maximum(energy, 0.0)
    if not np.any(energy):
        return None
    transform = np.array(matrix, dtype=np.float64)[:3]
    if not np.isfinite(transform).all():
        warn(f"light '{obj.name}': its place or scale is not finite, it is left out")
        return None
    if not np.linalg.norm(transform[:, 2]):  # scaled to 0: it has a place but no direction
        if light.type != "POINT":
            warn(f"light '{obj.name}': it is scaled to 0 and left out")
            return None
        transform[:, :3] = np.eye(3)
    fields = _BY_TYPE[light.type](light, energy, transform, warn)
    return LightDesc(name=obj.name, transform=transform, flags=_flags(obj, light), **fields) if fields else None


def _point(light, energy, _transform, _warn):
    return {"type": LightType.POINT, "emission": tuple(energy / (4.0 * math.pi)), "radius": light.shadow_soft_size}


def _spot(light, energy, _transform, _warn):
    return {"type": LightType.SPOT, "emission": tuple(energy / (4.0 * math.pi)), "radius": light.shadow_soft_size,
            "angle": light.spot_size, "blend": light.spot_blend}


def _sun(light, energy, _transform, _warn):
    return {"type": LightType.SUN, "emission": tuple(energy * compat.sun_irradiance(light.angle)), "angle": light.angle}


def _area(light, energy, transform, warn):
    round_shape = light.shape in ("DISK", "ELLIPSE")
    size_x, size_y = light.size, light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size
    area = size_x * size_y * np.linalg.norm(transform[:, 0]) * np.linalg.norm(transform[:, 1])
    area *= math.pi / 4.0 if round_shape else 1.0
    if area <= 0.0:
        warn(f"light '{light.name}': an area light of size 0 is left out")
        return None
    if light.spread < math.pi * 0.999:
        warn(f"light '{light.name}': spread is ignored, it shines to the whole hemisphere")
    return {"type": LightType.ELLIPSE if round_shape else LightType.RECTANGLE, "size_x": size_x, "size_y": size_y,
            "emission": tuple(energy * compat.area_radiance_per_watt(area))}


_BY_TYPE = {"POINT": _point, "SPOT": _spot, "SUN": _sun, "AREA": _area}


def _flags(obj, light):
    flags = LightFlags.NONE
    if not getattr(*compat.shadow_switch(light)):
        flags |= LightFlags.NO_SHADOW
    if light.type == "SPOT" and compat.spot_falls_with_cosine():
        flags |= LightFlags.SPOT_COSINE
    if not (obj.visible_glossy or obj.visible_transmission):
        flags |= LightFlags.HIDDEN_FROM_SPECULAR
    return flags


def _emission_factor(light, warn):
    """(3,) what the node tree multiplies the lamp with: its Emission node's constant colour times strength."""
    if not compat.uses_nodes(light):
        return np.ones(3)
    node = _surface_node(light.node_tree, "OUTPUT_LIGHT")
    if node is None:
        return np.zeros(3)
    if node.type != "EMISSION":
        warn(f"light '{light.name}': only an Emission node is understood, {node.name} is ignored")
        return np.ones(3)
    owner = f"light '{light.name}'"
    return _constant_color(node.inputs["Color"], owner, warn) * _constant_value(node.inputs["Strength"], owner, warn)


# ---------------------------------------------------------------- world


def export_world(world, add_image, warn):
    """The surroundings, or None if they are black.

    Args:
        world: bpy.types.World or None.
        add_image: bpy image -> image id.
        warn: called with a message for what the engine cannot do.
    """
    if world is None:
        return None
    if not compat.uses_nodes(world):
        return _world_desc(world, np.array(world.color[:], dtype=np.float64))
    node = _surface_node(world.node_tree, "OUTPUT_WORLD")
    if node is None:
        return None
    if node.type not in ("BACKGROUND", "EMISSION"):
        warn(f"world '{world.name}': only a Background node is understood, {node.name} is shown as black")
        return None
    strength = _constant_value(node.inputs["Strength"], f"world '{world.name}'", warn)
    source = _linked_node(node.inputs["Color"])
    if source is not None and source.type == "TEX_ENVIRONMENT":
        return _environment(world, source, strength, add_image, warn)
    return _world_desc(world, strength * _constant_color(node.inputs["Color"], f"world '{world.name}'", warn))


def _environment(world, node, strength, add_image, warn):
    if node.image is None:
        warn(f"world '{world.name}': {node.name} has no image, magenta is shown")
        return _world_desc(world, strength * np.array((1.0, 0.0, 1.0)))
    if node.projection != "EQUIRECTANGULAR":
        warn(f"world '{world.name}': {node.name} is read as equirectangular")
    rotation = _environment_rotation(world, node, warn)
    return _world_desc(world, np.full(3, strength), add_image(node.image), rotation)


def _environment_rotation(world, node, warn):
    """(3, 3) world direction to image direction by a Mapping node's rotation, None without one."""
    mapping = _linked_node(node.inputs["Vector"])
    if mapping is None or mapping.type == "TEX_COORD":
        return None
    if mapping.type != "MAPPING":
        warn(f"world '{world.name}': {mapping.name} between coordinates and image is ignored")
        return None
    location = mapping.inputs["Location"].default_value if "Location" in mapping.inputs else (0.0, 0.0, 0.0)
    if any(location) or any(abs(s - 1.0) > 1e-6 for s in mapping.inputs["Scale"].default_value):
        warn(f"world '{world.name}': location and scale of {mapping.name} are ignored")
    euler = mathutils.Euler(mapping.inputs["Rotation"].default_value[:], "XYZ")
    rotation = np.array(euler.to_matrix(), dtype=np.float64)
    return rotation.T if mapping.vector_type == "TEXTURE" else rotation


def _world_desc(world, radiance, image=0, rotation=None):
    if not np.any(radiance):
        return None
    visibility = getattr(world, "cycles_visibility", None)
    return WorldDesc(tuple(np.maximum(radiance, 0.0)), image, rotation, not getattr(visibility, "camera", True))


# ---------------------------------------------------------------- nodes


def _surface_node(tree, output_type):
    """What feeds the active output's Surface."""
    outputs = [node for node in tree.nodes if node.type == output_type]
    output = next((node for node in outputs if node.is_active_output), outputs[0] if outputs else None)
    return _linked_node(output.inputs["Surface"]) if output else None


def _linked_node(socket):
    """The node behind a socket, reroutes skipped, muted links not counted."""
    while socket.is_linked and not socket.links[0].is_muted:
        node = socket.links[0].from_node
        if node.type != "REROUTE":
            return node
        socket = node.inputs[0]
    return None


def _constant(socket, source_type, owner, warn):
    """The value of a socket or of the one constant node before it."""
    node = _linked_node(socket)
    if node is None:
        return socket.default_value
    if node.type == source_type:
        return node.outputs[0].default_value
    if node.type == "BLACKBODY":
        return np.maximum(blackbody_color(node.inputs["Temperature"].default_value), 0.0)
    warn(f"{owner}: {node.name} cannot be read as a constant, the socket's own value is used")
    return socket.default_value


def _constant_color(socket, owner, warn):
    return np.array(_constant(socket, "RGB", owner, warn)[:3], dtype=np.float64)


def _constant_value(socket, owner, warn):
    value = _constant(socket, "VALUE", owner, warn)
    return float(value if np.isscalar(value) else value[0])
