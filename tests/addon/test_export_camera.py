"""What of Blender's camera and picture size is exported; nothing is rendered."""

import bpy
import make_scenes
import numpy as np
import pytest
from sppm import scene_desc


@pytest.mark.parametrize("size", [(48, 32), (32, 48)], ids=["wide", "tall"])
@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
@pytest.mark.parametrize("lens_type", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("pixel_aspect", [1.0, 2.0])
def test_window_is_blenders_view_frame(export, size, fit, lens_type, pixel_aspect):
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.pixel_aspect_y = pixel_aspect
    lens = scene.camera.data
    lens.type, lens.sensor_fit, lens.shift_x, lens.shift_y = lens_type, fit, 0.2, -0.1
    lens.sensor_width, lens.sensor_height, lens.lens, lens.ortho_scale = 30.0, 20.0, 45.0, 3.0
    camera = export()[0].camera
    corners = np.array([tuple(corner) for corner in lens.view_frame(scene=scene)])
    if lens_type == "PERSP":
        corners = corners / -corners[:, 2:]
    low, high = corners.min(0), corners.max(0)
    assert np.allclose(camera.window, (low[0], high[0], low[1], high[1]), atol=1e-5)
    assert (camera.width, camera.height) == size
    assert camera.projection == scene_desc.Projection[{"PERSP": "PERSPECTIVE", "ORTHO": "ORTHOGRAPHIC"}[lens_type]]


def test_camera_stands_where_it_stands_without_its_scale(export):
    before = export()[0].camera.transform
    bpy.context.scene.camera.scale = (2, 3, 4)
    assert np.allclose(export()[0].camera.transform, before, atol=1e-6)
    assert np.allclose(before[:, 3], (0, -5, 3))


def test_clipping_and_percentage(export):
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 33, 21, 50
    scene.camera.data.clip_start, scene.camera.data.clip_end = 0.5, 70.0
    camera = export()[0].camera
    assert (camera.width, camera.height) == (16, 10)
    assert (camera.clip_near, camera.clip_far) == (0.5, 70.0)


@pytest.mark.parametrize("crop", [False, True])
def test_border_is_a_region(export, crop):
    render = bpy.context.scene.render
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.75, 0.5, 0.625
    render.use_crop_to_border = crop
    assert export()[0].camera.region is None
    render.use_border = True
    assert export()[0].camera.region == (8, 16, 16, 4)


@pytest.mark.parametrize("lens_type, focal_length", [("PERSP", 0.05), ("ORTHO", 1.0)])
def test_depth_of_field(export, lens_type, focal_length):
    lens = bpy.context.scene.camera.data
    lens.type, lens.lens = lens_type, 50.0
    lens.dof.aperture_fstop, lens.dof.focus_distance, lens.dof.aperture_ratio = 2.0, 3.0, 1.5
    assert export()[0].camera.aperture_radius == 0
    lens.dof.use_dof = True
    camera = export()[0].camera
    assert camera.aperture_radius == pytest.approx(focal_length / 4)
    assert (camera.focal_distance, camera.aperture_ratio) == (3.0, 1.5)


def test_focus_object_counts_along_the_view(export):
    camera = make_scenes.aim(bpy.context.scene.camera, (0, 0, 10), (0, 0, 0))
    target = make_scenes.link("Target", None)
    target.location = (3, 1, 4)
    camera.data.dof.use_dof, camera.data.dof.focus_object, camera.data.dof.aperture_blades = True, target, 5
    desc, warnings = export()
    assert desc.camera.focal_distance == pytest.approx(6.0)
    assert len(warnings) == 1 and "5 aperture blades" in warnings[0]


def test_panoramic_camera_is_refused_by_name(export):
    bpy.context.scene.camera.name = "Fisheye"
    bpy.context.scene.camera.data.type = "PANO"
    with pytest.raises(RuntimeError, match=r"'Fisheye' is panoramic"):
        export()
