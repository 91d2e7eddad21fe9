"""The first test presses F12 and looks at the pixels."""

import math

import blender_scene
import bpy
import make_scenes
import numpy as np
import pytest

POWER = 50.0  # watts
HEIGHT = 1.3  # of the lamp above the floor, metres


@pytest.fixture
def lit_floor(empty_scene):
    """A white floor seen from straight above, a point lamp 1.3 m over its middle."""
    make_scenes.add_floor(8.0, make_scenes.diffuse("White", (1.0, 1.0, 1.0)))
    make_scenes.add_lamp("POINT", (0, 0, HEIGHT), (0, 0, 0), POWER, shadow_soft_size=0.0)
    make_scenes.add_camera((0, 0, 2.0), (0, 0, 0))
    return empty_scene


def engines():
    """The names of all engines that were registered by Python."""
    return [getattr(engine, "bl_idname", "") for engine in bpy.types.RenderEngine.__subclasses__()]


def test_engine_is_registered(addon):
    assert engines().count("SPPM") == 1


def test_f12_has_the_brightness_of_the_closed_form(lit_floor, tmp_path):
    """Radiance of white Lambert under a point lamp: P cos^3 / (4 pi^2 h^2); 1 % for the spread over a pixel."""
    pixels = blender_scene.render(tmp_path / "floor.exr")
    assert pixels.shape == (32, 32, 4)
    middle = pixels[14:18, 14:18, :3].mean()
    assert middle == pytest.approx(POWER / (4 * math.pi**2 * HEIGHT**2), rel=0.01)
    assert np.allclose(pixels[..., 3], 1.0, atol=1e-5)


def test_falls_off_from_the_middle(lit_floor, tmp_path):
    """The view is 2 m tan(fov/2) = 0.72 m to either side: cos^3 at the middle of the last four pixels is known."""
    pixels = blender_scene.render(tmp_path / "floor.exr")
    half = 2.0 * 18.0 / 50.0
    offset = half * (28.0 / 32.0)  # the middle of the last four pixels
    expected = (1 + (offset / HEIGHT) ** 2) ** -1.5
    edge = pixels[14:18, 28:, :3].mean() / pixels[14:18, 14:18, :3].mean()
    assert edge == pytest.approx(expected, rel=0.02)


def test_twice_the_same(lit_floor, tmp_path):
    first = blender_scene.render(tmp_path / "first.exr")
    assert np.array_equal(first, blender_scene.render(tmp_path / "second.exr"))


def test_no_camera_is_an_error(lit_floor, tmp_path):
    bpy.context.scene.camera = None
    with pytest.raises(RuntimeError, match=r"(?i)camera"):
        blender_scene.render(tmp_path / "none.exr")
    assert not (tmp_path / "none.exr").exists()


def test_failure_inside_the_engine_is_an_error(lit_floor, tmp_path, monkeypatch):
    """Whatever goes wrong while rendering reaches the user, and no picture is written."""
    from sppm import native, native_library

    def fail(*_args, **_kwargs):
        raise native_library.SppmError("out of luck")

    monkeypatch.setattr(native.Session, "step", fail)
    with pytest.raises(RuntimeError, match="out of luck"):
        blender_scene.render(tmp_path / "failed.exr")
    assert not (tmp_path / "failed.exr").exists()


def test_renders_again_after_a_failure(lit_floor, tmp_path):
    camera, bpy.context.scene.camera = bpy.context.scene.camera, None
    with pytest.raises(RuntimeError):
        blender_scene.render(tmp_path / "none.exr")
    bpy.context.scene.camera = camera
    assert blender_scene.render(tmp_path / "again.exr")[..., :3].mean() > 0


def test_empty_scene_is_black(empty_scene, tmp_path):
    make_scenes.add_camera((0, 0, 2.0), (0, 0, 0))
    assert not blender_scene.render(tmp_path / "empty.exr")[..., :3].any()
