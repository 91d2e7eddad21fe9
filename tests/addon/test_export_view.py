"""What a viewport looks at, against the exporter of cameras: Blender's own matrices of a camera must give its own picture."""

from types import SimpleNamespace

import bpy
import make_scenes
import numpy as np
import pytest
from mathutils import Matrix
from sppm.export_camera import CameraError, export_camera
from sppm.export_view import export_view
from sppm.scene_desc import Projection

SIZE = (300, 200)


@pytest.fixture
def camera(empty_scene):
    make_scenes.add_camera((1, -4, 2), (0, 0, 0.5), lens=35.0)
    render = empty_scene.render
    render.resolution_x, render.resolution_y = SIZE
    camera = empty_scene.camera
    camera.data.shift_x, camera.data.shift_y = 0.1, -0.2
    return camera


def through(camera, **space):
    """The View of a viewport whose camera's frame fills it."""
    bpy.context.view_layer.update()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    matrix = camera.evaluated_get(depsgraph).calc_matrix_camera(depsgraph, x=SIZE[0], y=SIZE[1])
    return looked("CAMERA", matrix, camera.matrix_world.inverted(), camera=camera, **space)


def looked(perspective, window_matrix, view_matrix, **space):
    view = SimpleNamespace(view_perspective=perspective, window_matrix=window_matrix, view_matrix=view_matrix)
    space = SimpleNamespace(**{"use_render_border": False, "clip_start": 0.01, "clip_end": 100.0, **space})
    region = SimpleNamespace(width=SIZE[0], height=SIZE[1])
    return export_view(region, space, view, bpy.context.evaluated_depsgraph_get())


@pytest.mark.parametrize("kind", ["PERSP", "ORTHO"])
@pytest.mark.parametrize("fit", ["AUTO", "HORIZONTAL", "VERTICAL"])
def test_camera_view_is_the_camera(camera, kind, fit):
    camera.data.type, camera.data.sensor_fit = kind, fit
    camera.data.dof.use_dof, camera.data.dof.focus_distance, camera.data.dof.aperture_fstop = True, 2.5, 0.5
    view = through(camera)
    expected = export_camera(camera, bpy.context.scene.render, lambda message: None)
    assert (view.x, view.y, view.camera.width, view.camera.height) == (0, 0, *SIZE)
    assert view.camera.window == pytest.approx(expected.window, rel=1e-4), "of float32 matrices"
    assert np.allclose(view.camera.transform, expected.transform, atol=1e-5)
    for name in ("projection", "clip_near", "clip_far", "aperture_radius", "aperture_ratio", "focal_distance"):
        assert getattr(view.camera, name) == getattr(expected, name), name


def test_border_in_camera_view_is_that_of_the_render(camera):
    """On pixels of the viewport, which are those of the picture here."""
    render = bpy.context.scene.render
    render.use_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.2, 0.5, 0.1, 0.6
    view = through(camera)
    assert (view.x, view.y, view.camera.width, view.camera.height) == (60, 20, 90, 100)
    left, right, bottom, top = export_camera(camera, render, lambda message: None).window
    width, height = right - left, top - bottom
    expected = (left + 0.2 * width, left + 0.5 * width, bottom + 0.1 * height, bottom + 0.6 * height)
    assert view.camera.window == pytest.approx(expected, rel=1e-4)
    assert looked("PERSP", frustum(), camera.matrix_world.inverted()).camera.width == SIZE[0], "elsewhere it is not"


def frustum():
    """A projection matrix as Blender makes it: a window of -0.3 to 0.3 by -0.2 to 0.2 at distance 1."""
    return Matrix(((1 / 0.3, 0, 0, 0), (0, 1 / 0.2, 0, 0), (0, 0, -1.0, -0.02), (0, 0, -1, 0)))


def test_perspective_view_of_nobodys_camera(empty_scene):
    view = looked("PERSP", frustum(), Matrix.Translation((0, 0, -5)))
    assert view.camera.window == pytest.approx((-0.3, 0.3, -0.2, 0.2))
    assert np.allclose(view.camera.transform[:, 3], (0, 0, 5))
    assert (view.camera.clip_near, view.camera.clip_far, view.camera.aperture_radius) == (0.01, 100.0, 0.0)


def test_orthographic_view_sees_what_is_behind_its_middle(empty_scene):
    """Blender's has its place in the middle of what it shows."""
    matrix = Matrix(((0.5, 0, 0, 0), (0, 0.75, 0, 0), (0, 0, -0.02, 0), (0, 0, 0, 1)))
    view = looked("ORTHO", matrix, Matrix.Translation((0, 0, -5)))
    assert view.camera.projection is Projection.ORTHOGRAPHIC
    assert view.camera.window == pytest.approx((-2.0, 2.0, -4 / 3, 4 / 3))
    assert np.allclose(view.camera.transform[:, 3], (0, 0, 5 + 50.0))
    assert (view.camera.clip_near, view.camera.clip_far) == (0.0, 100.0)


@pytest.mark.parametrize(("border", "expected"), [
    ((0.25, 0.75, 0.0, 0.5), (75, 0, 150, 100)), ((-0.5, 0.5, 0.5, 1.5), (0, 100, 150, 100)), ((1.1, 1.5, 0.0, 1.0), None)])
def test_border_of_a_viewport(empty_scene, border, expected):
    names = ("render_border_min_x", "render_border_max_x", "render_border_min_y", "render_border_max_y")
    view = looked("PERSP", frustum(), Matrix.Identity(4), use_render_border=True, **dict(zip(names, border)))
    assert (view and (view.x, view.y, view.camera.width, view.camera.height)) == expected


def test_camera_that_cannot_be_looked_through_is_told(camera):
    camera.data.type = "PANO"
    with pytest.raises(CameraError, match="panoramic"):
        looked("CAMERA", frustum(), Matrix.Identity(4), camera=camera)


def test_any_object_may_be_looked_from(camera):
    lamp = make_scenes.add_lamp("POINT", (0, 0, 5), (0, 0, 0), 10.0)
    view = looked("CAMERA", frustum(), Matrix.Translation((0, 0, -5)), camera=lamp)
    assert np.allclose(view.camera.transform[:, 3], (0, 0, 5))
