"""Blender's camera -> CameraDesc, framed exactly as Cycles frames it (intern/cycles/blender/camera.cpp is the reference)."""

import numpy as np

from .scene_desc import CameraDesc, Projection


class CameraError(RuntimeError):
    """The scene has no camera that the engine can look through; the message names it."""


def export_camera(camera, render, warn):
    """The camera and the part of its image to render.

    Args:
        camera: evaluated camera object or None.
        render: scene.render, for size, pixel aspect and border.
        warn: called with a message for what the engine cannot do.

    Raises:
        CameraError: no camera, or a panoramic one.
    """
    check_camera(camera)
    lens = camera.data
    width, height = image_size(render)
    return CameraDesc(
        transform=_transform(camera.matrix_world),
        window=window(lens, width * render.pixel_aspect_x, height * render.pixel_aspect_y),
        width=width,
        height=height,
        projection=Projection.ORTHOGRAPHIC if lens.type == "ORTHO" else Projection.PERSPECTIVE,
        clip_near=lens.clip_start,
        clip_far=lens.clip_end,
        region=_region(render, width, height),
        **aperture(camera, warn),
    )


def check_camera(camera):
    """Raises a CameraError where the engine cannot look through an object."""
    if camera is None or camera.type != "CAMERA":
        raise CameraError("the scene has no camera" if camera is None else f"'{camera.name}' is no camera")
    if camera.data.type == "PANO":
        raise CameraError(f"camera '{camera.name}' is panoramic, only perspective and orthographic ones can be rendered")
    axes = np.linalg.norm(np.array(camera.matrix_world, dtype=np.float64)[:3], axis=0)
    if not (np.isfinite(axes).all() and axes[:3].all()):
        raise CameraError(f"camera '{camera.name}' is scaled to 0 or its place is not finite")


def image_size(render):
    """Width and height of the full image, rounded down as Blender does."""
    return tuple(max(1, size * render.resolution_percentage // 100) for size in (render.resolution_x, render.resolution_y))


def _transform(matrix):
    """(3, 4) float64 camera to world without scale."""
    transform = np.array(matrix, dtype=np.float64)[:3]
    transform[:, :3] /= np.linalg.norm(transform[:, :3], axis=0)
    return transform


def window(lens, x_ratio, y_ratio):
    """Left, right, bottom, top at distance 1 or, orthographic, in metres; a shift of 1 is the length of the fitted side."""
    horizontal = x_ratio > y_ratio if lens.sensor_fit == "AUTO" else lens.sensor_fit == "HORIZONTAL"
    aspect = x_ratio / y_ratio if horizontal else y_ratio / x_ratio
    if lens.type == "ORTHO":
        unit = lens.ortho_scale / 2.0
    else:
        unit = 0.5 * (lens.sensor_height if lens.sensor_fit == "VERTICAL" else lens.sensor_width) / lens.lens
    # The fitted side has half length `unit`, the other follows from the aspect.
    half_x, half_y = (unit, unit / aspect) if horizontal else (unit / aspect, unit)
    shift_x, shift_y = 2.0 * unit * lens.shift_x, 2.0 * unit * lens.shift_y
    return (shift_x - half_x, shift_x + half_x, shift_y - half_y, shift_y + half_y)


def _region(render, width, height):
    """x, y, width, height of the border, cut to whole pixels in single precision as Blender does; None for the full image."""
    if not render.use_border:
        return None

    def cut(low, high, size):
        first = min(int(np.float32(low) * np.float32(size)), size - 1)
        return first, max(1, min(int(np.float32(high) * np.float32(size)), size) - first)

    x, region_width = cut(render.border_min_x, render.border_max_x, width)
    y, region_height = cut(render.border_min_y, render.border_max_y, height)
    return (x, y, region_width, region_height)


def aperture(camera, warn):
    """Those fields of a CameraDesc that depth of field sets; none without it."""
    lens, dof = camera.data, camera.data.dof
    if not dof.use_dof:
        return {}
    if dof.aperture_blades:
        warn(f"camera '{camera.name}': the {dof.aperture_blades} aperture blades are rendered as a circle")
    # Blender's lens is in millimetres; an orthographic camera has none and Cycles counts it as 1 m.
    focal_length = 1.0 if lens.type == "ORTHO" else lens.lens * 1e-3
    return {
        "aperture_radius": focal_length / (2.0 * max(dof.aperture_fstop, 1e-5)),
        "aperture_ratio": dof.aperture_ratio,
        "focal_distance": _focal_distance(camera, dof),
    }


def _focal_distance(camera, dof):
    """Depth of the focus object (or bone) along the view direction, or the distance given; never 0."""
    if dof.focus_object is None:
        return max(dof.focus_distance, 1e-5)
    matrix = dof.focus_object.matrix_world
    bone = dof.focus_object.pose.bones.get(dof.focus_subtarget) if dof.focus_object.pose and dof.focus_subtarget else None
    if bone:
        matrix = matrix @ bone.matrix
    axis = camera.matrix_world.col[2].to_3d().normalized()
    return max(abs(axis.dot(camera.matrix_world.translation - matrix.translation)), 1e-5)
