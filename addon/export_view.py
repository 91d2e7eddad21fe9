"""A 3D viewport's point of view -> the CameraDesc that shows it and the rectangle of the region that it fills.

Blender's own projection matrix is read, so perspective, orthographic and camera views with zoom, shift and offset are all the
same here; a border only cuts the window.
"""

from dataclasses import dataclass, replace

import numpy as np

from .export_camera import aperture, check_camera, image_size, window
from .scene_desc import CameraDesc, Projection


@dataclass(frozen=True)
class View:
    """`camera` renders the rectangle at `x`, `y` [pixels from the bottom left of the region] and of its own width and height."""

    camera: CameraDesc
    x: int
    y: int


def export_view(region, space, view, depsgraph):
    """What a viewport looks at.

    Args:
        region: bpy.types.Region, for its size.
        space: bpy.types.SpaceView3D.
        view: bpy.types.RegionView3D.
        depsgraph: that of the viewport.

    Returns:
        A View, or None where there is nothing to be seen: the border lies outside.

    Raises:
        CameraError: the viewport looks through a panoramic camera.
    """
    camera = space.camera if view.view_perspective == "CAMERA" else None
    if camera and camera.type == "CAMERA":
        camera = camera.evaluated_get(depsgraph)
        check_camera(camera)
    else:
        camera = None  # any object may be looked from: it has a place and no lens
    projection = np.array(view.window_matrix, dtype=np.float64)
    full = CameraDesc(width=region.width, height=region.height, **_looking(projection, view, space, camera))
    border = _border(full.window, space, view, depsgraph.scene_eval.render, camera)
    return View(full, 0, 0) if border is None else _cut(full, border)


def _looking(projection, view, space, camera):
    """All fields of the full CameraDesc but its size."""
    transform = np.linalg.inv(np.array(view.view_matrix, dtype=np.float64))[:3]
    is_perspective = projection[3, 2] != 0.0
    near, far = (camera.data.clip_start, camera.data.clip_end) if camera else (space.clip_start, space.clip_end)
    if not is_perspective and not camera:
        # Such a view starts far behind the point that it turns around.
        transform[:, 3] += 0.5 * far * transform[:, 2]
        near = 0.0
    fields = {"transform": transform, "window": _window(projection, is_perspective), "clip_near": near, "clip_far": far,
              "projection": Projection.PERSPECTIVE if is_perspective else Projection.ORTHOGRAPHIC}
    return {**fields, **(aperture(camera, lambda message: None) if camera else {})}


def _window(projection, is_perspective):
    """Left, right, bottom, top: at distance 1 or, orthographic, in metres."""
    edges = []
    for axis in (0, 1):
        scale, shift = projection[axis, axis], projection[axis, 2] if is_perspective else -projection[axis, 3]
        edges += [(-1.0 + shift) / scale, (1.0 + shift) / scale]
    return tuple(edges)


# ---------------------------------------------------------------- border


def _border(whole, space, view, render, camera):
    """The rendered part as left, right, bottom, top, 0 to 1 of the region; None without a border."""
    if view.view_perspective == "CAMERA":
        if not (camera and render.use_border):
            return None
        width, height = image_size(render)
        frame = window(camera.data, width * render.pixel_aspect_x, height * render.pixel_aspect_y)
        border = (render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y)
        return _relative(_part(frame, border), whole)
    if not space.use_render_border:
        return None
    return (space.render_border_min_x, space.render_border_max_x, space.render_border_min_y, space.render_border_max_y)


def _part(frame, shares):
    """The part of a window, left, right, bottom, top, that shares of its sides cut out."""
    left, right, bottom, top = frame
    x, y = (left, right - left), (bottom, top - bottom)
    return tuple(start + share * size for (start, size), share in zip((x, x, y, y), shares))


def _relative(part, whole):
    """The inverse of `_part`: the shares of the whole at which a part begins and ends."""
    left, right, bottom, top = whole
    x, y = (left, right - left), (bottom, top - bottom)
    return tuple((edge - start) / size for (start, size), edge in zip((x, x, y, y), part))


def _cut(full, border):
    """The View of whole pixels inside a border, None if there are none."""
    sizes = (full.width, full.width, full.height, full.height)
    left, right, bottom, top = (min(max(round(share * size), 0), size) for share, size in zip(border, sizes))
    if right <= left or top <= bottom:
        return None
    shares = (left / full.width, right / full.width, bottom / full.height, top / full.height)
    camera = replace(full, window=_part(full.window, shares), width=right - left, height=top - bottom)
    return View(camera, left, bottom)
