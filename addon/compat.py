"""Every difference between the Blender versions that the add-on runs on (3.4, 4.2, 4.5, 5.0) but renamed shader
sockets, which are in `compat_nodes`; no other file asks for the version.

Where two versions can be told apart by what they offer, that is asked; the version number only where they look the same.
A render engine's `__init__` needs `*args` from 4.4 on and none before: the engine defines none and is spared the difference.
"""

import math

import bpy
import numpy as np

# ---------------------------------------------------------------- meshes


def positions(mesh):
    """(vertices, 3) float32, metres, object space."""
    attribute = mesh.attributes.get("position")
    if attribute is not None:
        return _read(attribute.data, "vector", len(mesh.vertices), 3, np.float32)
    return _read(mesh.vertices, "co", len(mesh.vertices), 3, np.float32)


def corner_vertices(mesh):
    """(corners,) uint32: the vertex of each corner."""
    attribute = mesh.attributes.get(".corner_vert")
    if attribute is not None:
        return _read(attribute.data, "value", len(mesh.loops), 1, np.uint32)
    return _read(mesh.loops, "vertex_index", len(mesh.loops), 1, np.uint32)


def triangle_corners(mesh):
    """(triangles, 3) uint32 into the corners."""
    if hasattr(mesh, "calc_loop_triangles"):
        mesh.calc_loop_triangles()
    return _read(mesh.loop_triangles, "loops", len(mesh.loop_triangles), 3, np.uint32)


def triangle_polygons(mesh):
    """(triangles,) uint32 into the polygons; after `triangle_corners`."""
    if hasattr(mesh, "loop_triangle_polygons"):
        return _read(mesh.loop_triangle_polygons, "value", len(mesh.loop_triangles), 1, np.uint32)
    return _read(mesh.loop_triangles, "polygon_index", len(mesh.loop_triangles), 1, np.uint32)


def polygon_materials(mesh):
    """(polygons,) uint32 material slots, or None where all are in the first."""
    attribute = mesh.attributes.get("material_index")
    if attribute is not None and attribute.domain == "FACE" and attribute.data_type == "INT":
        return _read(attribute.data, "value", len(mesh.polygons), 1, np.uint32)
    if hasattr(mesh, "corner_normals"):
        return None
    return _read(mesh.polygons, "material_index", len(mesh.polygons), 1, np.uint32)


def corner_normals(mesh):
    """(corners, 3) float32 unit, or None where every face is flat."""
    if hasattr(mesh, "corner_normals"):
        if mesh.normals_domain == "FACE":
            return None
        return _read(mesh.corner_normals, "vector", len(mesh.loops), 3, np.float32)
    smooth = np.empty(len(mesh.polygons), dtype=bool)
    mesh.polygons.foreach_get("use_smooth", smooth)
    if not smooth.any():
        return None
    mesh.calc_normals_split()
    return _read(mesh.loops, "normal", len(mesh.loops), 3, np.float32)


def corner_uvs(layer, count):
    """(corners, 2) float32 of a UV layer."""
    if hasattr(layer, "uv"):
        return _read(layer.uv, "vector", count, 2, np.float32)
    return _read(layer.data, "uv", count, 2, np.float32)


def _read(collection, name, count, channels, dtype):
    values = np.empty(count * channels, dtype=dtype)
    if count:
        collection.foreach_get(name, values)
    return values.reshape(count, channels) if channels > 1 else values


# ---------------------------------------------------------------- lights


def area_radiance_per_watt(area):
    """Radiance of an area light of 1 W and `area` [m^2]: P / (4 A) before 4.0, P / (pi A) since (measured in 3.4, 4.2, 4.5)."""
    return 1.0 / ((math.pi if bpy.app.version >= (4, 0, 0) else 4.0) * area)


def sun_irradiance(angle):
    """Irradiance of a sun of strength 1 and full `angle` on a plane that faces it: 1, in 3.4 less for wide ones."""
    cosine = math.cos(0.5 * angle)
    return 1.0 if bpy.app.version >= (4, 0, 0) else 2.0 * cosine / (1.0 + cosine)


def spot_falls_with_cosine():
    """Before 4.0 a spot's fall-off is multiplied by the cosine to its axis."""
    return bpy.app.version < (4, 0, 0)


def light_energy(light, matrix):
    """(3,) the light's power, or a sun's strength, times its colour, with 4.5's exposure, temperature and normalisation."""
    energy = np.array(light.color[:], dtype=np.float64) * light.energy
    if getattr(light, "use_temperature", False):
        energy = energy * np.array(light.temperature_color[:])
    energy = energy * 2.0 ** getattr(light, "exposure", 0.0)
    if not getattr(light, "normalize", True):
        energy = energy * light.area(matrix_world=matrix)
    return energy


def light_strength(light):
    """Names of what makes a lamp's colour and power: `light_energy` reads them."""
    names = ("use_temperature", "temperature", "color", "energy", "exposure", "normalize")
    has_temperature = getattr(light, "use_temperature", False)
    return [name for name in names if hasattr(light, name) and (name != "temperature" or has_temperature)]


def shadow_switch(light):
    """(owner, name) of the switch that lets a lamp cast shadows: Cycles' own where it has one (3.4), else Blender's."""
    cycles = getattr(light, "cycles", None)
    return (cycles, "cast_shadow") if hasattr(cycles, "cast_shadow") else (light, "use_shadow")


# ---------------------------------------------------------------- motion


def motion_blur_position(scene):
    """(owner, name) of where in the shutter a frame lies: Blender's own from 4.2 on, before Cycles' or, without it, EEVEE's."""
    owners = (scene.render, getattr(scene, "cycles", None), scene.eevee)
    return next(owner for owner in owners if hasattr(owner, "motion_blur_position")), "motion_blur_position"


# ---------------------------------------------------------------- nodes


def uses_nodes(owner):
    """Whether a material, world or light is described by its node tree; from 5.0 on a material or world with a tree always is."""
    if owner.node_tree is None:
        return False
    if bpy.app.version >= (5, 0, 0) and not isinstance(owner, bpy.types.Light):
        return True
    return owner.use_nodes


# ---------------------------------------------------------------- view layers


_OLD_PASS_NAMES = {"Object Index": "IndexOB", "Material Index": "IndexMA", "Emission": "Emit", "Environment": "Env",
                   "Diffuse Color": "DiffCol"}


def pass_name(name):
    """What Blender calls a pass of the library in results and files; before 5.0 some names are short."""
    return name if bpy.app.version >= (5, 0, 0) else _OLD_PASS_NAMES.get(name, name)


def denoising_switch(view_layer):
    """(owner, name) of the switch for the denoising passes: Cycles' own where it is enabled, so that its scenes need no other."""
    owner = view_layer.cycles if hasattr(view_layer, "cycles") else view_layer.sppm
    return owner, "denoising_store_passes"


def world_of(scene, view_layer):
    """The world that a view layer shows; layers may have their own from 4.2 on."""
    return getattr(view_layer, "world_override", None) or scene.world


# ---------------------------------------------------------------- results


def set_pass_pixels(render_pass, pixels):
    """Hands (height, width, channels) float32 to a render pass; 3.4 wants the array as (pixels, channels), 4.5 wants it flat."""
    pixels = np.ascontiguousarray(pixels, dtype=np.float32)
    if bpy.app.version < (4, 0, 0):
        render_pass.rect.foreach_set(pixels.reshape(-1, pixels.shape[2]))
        return
    try:
        render_pass.rect.foreach_set(pixels.reshape(-1))
    except (TypeError, ValueError):
        render_pass.rect.foreach_set(pixels.reshape(-1, pixels.shape[2]))


# ---------------------------------------------------------------- drawing


def texture(pixels):
    """A GPUTexture of (height, width, 4) float32, bottom row first; only where Blender has a window."""
    import gpu

    height, width, _ = pixels.shape
    flat = np.ascontiguousarray(pixels, dtype=np.float32).reshape(-1)
    return gpu.types.GPUTexture((width, height), format="RGBA16F", data=gpu.types.Buffer("FLOAT", flat.size, flat))


def draw_texture(texture, x, y, width, height):
    """Draws premultiplied scene-linear pixels over a rectangle of a viewport; Blender brings that to the screen's colours."""
    import gpu
    from gpu_extras.presets import draw_texture_2d

    gpu.state.blend_set("ALPHA_PREMULT")
    draw_texture_2d(texture, (x, y), width, height)
    gpu.state.blend_set("NONE")
