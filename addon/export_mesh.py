"""Evaluated Blender meshes -> MeshDesc, read in bulk with `foreach_get` only."""

import numpy as np

from . import compat
from .scene_desc import MeshDesc

_LARGEST = 1e18  # of a coordinate: a float holds the square of no larger ones


def export_mesh(mesh, want_uvs=False, want_colors=None, warn=lambda message: None):
    """Reads the triangles of an evaluated mesh.

    Args:
        mesh: bpy.types.Mesh; Blender may cache triangles and normals in it.
        want_uvs: whether a material reads the active render UV map.
        want_colors: name of the colour attribute that a material reads; '' or True for the active render one, None or False for
            none.
        warn: called with a message where something wanted is missing.

    Returns:
        A MeshDesc in object space, or None for a mesh without triangles.
    """
    corners = compat.triangle_corners(mesh)
    positions, indices = compat.positions(mesh), compat.corner_vertices(mesh)[corners]
    kept = _usable(positions, indices)
    if kept is not None:
        warn(f"mesh '{mesh.name}': {len(kept) - kept.sum()} of its triangles have vertices that are not finite and are left out")
        positions, corners, indices = _moved_in(positions, indices[kept]), corners[kept], indices[kept]
    if len(corners) == 0:
        return None
    slots = _material_slots(mesh)
    arrays = {
        "corner_normals": _normals(mesh, positions, indices, corners),
        "corner_uvs": _uvs(mesh) if want_uvs else None,
        "corner_colors": None if want_colors in (None, False) else _colors(mesh, want_colors, warn),
    }
    has_corners = any(array is not None for array in arrays.values())
    return MeshDesc(
        name=mesh.name,
        positions=positions,
        indices=indices,
        corners=corners if has_corners else None,
        material_slots=slots if slots is None or kept is None else slots[kept],
        **{name: None if array is None else _finite(array) for name, array in arrays.items()},
    )


def _usable(positions, indices):
    """(triangles,) bool: which have finite vertices, of which a float can hold the square; None if all have."""
    with np.errstate(invalid="ignore"):
        good = (np.abs(positions) < _LARGEST).all(axis=1)
    return None if good.all() else good[indices].all(axis=1)


def _normals(mesh, positions, indices, corners):
    """(corners, 3) float32, None for a flat mesh. Beside a bad vertex Blender's are not finite: the triangle's own it is."""
    normals = compat.corner_normals(mesh)
    if normals is None or np.isfinite(normals).all():
        return normals
    bad = ~np.isfinite(normals).all(axis=1)[corners]
    hit = bad.any(axis=1)
    a, b, c = positions[indices[hit]].transpose(1, 0, 2)
    flat = np.cross(b - a, c - a)
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-30)
    normals[corners[hit][bad[hit]]] = np.repeat(flat, bad[hit].sum(axis=1), axis=0)
    return normals


def _moved_in(positions, indices):
    """The positions with those that no triangle uses moved to one that is used, so that they count in no bounds."""
    used = np.zeros(len(positions), dtype=bool)
    used[indices] = True
    return np.where(used[:, None], positions, positions[indices[0, 0]] if len(indices) else np.float32(0.0))


def _finite(array):
    """The array with 0 in place of what is no number."""
    return array if np.isfinite(array).all() else np.nan_to_num(array, nan=0.0, posinf=0.0, neginf=0.0)


def _material_slots(mesh):
    """Slots of the triangles, or None if all use the first; like Blender, a slot that does not exist counts as the last."""
    last = len(mesh.materials) - 1
    if last < 1:
        return None
    polygons = compat.polygon_materials(mesh)
    if polygons is None or not polygons.any():
        return None
    return np.minimum(polygons, np.uint32(last))[compat.triangle_polygons(mesh)]


def _uvs(mesh):
    """The active render UV map, None where the mesh has none: the engine then reads every texture at (0, 0), as Cycles does."""
    layer = next((layer for layer in mesh.uv_layers if layer.active_render), None)
    return compat.corner_uvs(layer, len(mesh.loops)) if layer else None


def _colors(mesh, name, warn):
    """(corners, 3) float32 linear RGB of a colour attribute on corners or points."""
    attribute = _color_attribute(mesh, name)
    if attribute is None:
        warn(f"mesh '{mesh.name}' has no colour attribute {repr(name) if isinstance(name, str) and name else 'at all'}: black")
        return np.zeros((len(mesh.loops), 3), dtype=np.float32)
    rgba = np.empty(len(attribute.data) * 4, dtype=np.float32)
    # Blender decodes byte colours to linear RGB in `color`.
    attribute.data.foreach_get("color", rgba)
    rgb = rgba.reshape(-1, 4)[:, :3]
    return np.ascontiguousarray(rgb[compat.corner_vertices(mesh)] if attribute.domain == "POINT" else rgb)


def _color_attribute(mesh, name):
    colors = mesh.color_attributes
    if isinstance(name, str) and name:
        return colors.get(name)
    if not len(colors):
        return None
    index = colors.render_color_index
    return colors[index if 0 <= index < len(colors) else 0]
