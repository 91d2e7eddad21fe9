"""Bad input as Blender makes it: what can be rendered is, and one clear message names the object."""

import blender_scene
import bpy
import make_scenes
import numpy as np
import pytest


@pytest.fixture
def floor(empty_scene):
    """A lit floor that fills the picture, seen from above."""
    make_scenes.add_floor(2.0, make_scenes.diffuse("White", (0.8, 0.8, 0.8)))
    make_scenes.add_lamp("SUN", (0, 0, 3), (0, 0, 0), 2.0)
    make_scenes.add_camera((0, 0, 3), (0, 0, 0))
    return empty_scene


def add_mesh(name, vertices, faces, smooth=False):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    mesh.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    return make_scenes.link(name, mesh)


def middle(pixels):
    assert np.isfinite(pixels).all()
    return pixels[12:20, 12:20, :3].mean()


@pytest.mark.parametrize("smooth", [False, True], ids=["flat", "smooth"])
@pytest.mark.parametrize("value", [float("nan"), float("inf"), 1e30])
def test_bad_vertex_costs_its_triangles_only(floor, tmp_path, capsys, value, smooth):
    """Of a sheet of two triangles one is left, over the left half of the floor and in its light."""
    sheet = add_mesh("Sheet", [(-1, -1, 1), (1, -1, 1), (-1, 1, 1), (1, 1, 1)], [(0, 1, 2), (1, 3, 2)], smooth)
    sheet.data.materials.append(make_scenes.diffuse("Black", (0.0, 0.0, 0.0)))
    sheet.data.vertices[3].co = (value, 1, 1)
    pixels = blender_scene.render(tmp_path / "sheet.exr")
    assert np.isfinite(pixels).all()
    assert pixels[..., :3].max() > 0.3 and pixels[10, 10, :3].max() < 0.05
    assert "'Sheet': 1 of its triangles" in capsys.readouterr().out


def test_mesh_of_bad_vertices_alone_is_left_out(floor, tmp_path, capsys):
    add_mesh("Bad", [(float("nan"),) * 3] * 3, [(0, 1, 2)])
    assert middle(blender_scene.render(tmp_path / "bad.exr")) == pytest.approx(2 * 0.8 / np.pi, rel=0.05)
    assert "'Bad'" in capsys.readouterr().out


@pytest.mark.parametrize("scale", [(0, 0, 0), (0, 0, 1)], ids=["point", "line"])
def test_object_scaled_to_nothing(floor, tmp_path, scale):
    make_scenes.add_box("Box", (0, 0, 0.5), (1, 1, 1), make_scenes.diffuse("Black", (0.0, 0.0, 0.0))).scale = scale
    assert middle(blender_scene.render(tmp_path / "box.exr")) == pytest.approx(2 * 0.8 / np.pi, rel=0.05)


def test_mesh_without_faces(floor, tmp_path):
    add_mesh("Points", [(0, 0, 1), (1, 0, 1)], [])
    assert middle(blender_scene.render(tmp_path / "points.exr")) == pytest.approx(2 * 0.8 / np.pi, rel=0.05)


@pytest.mark.parametrize("kind", ["POINT", "SPOT", "AREA", "SUN"])
def test_lamp_scaled_to_zero(floor, tmp_path, capsys, kind):
    """A point has no direction to lose; the others are left out by name."""
    lamp = make_scenes.add_lamp(kind, (0, 0, 2), (0, 0, 0), 100.0)
    lamp.name, lamp.scale = "Tiny", (0, 0, 0)
    found = middle(blender_scene.render(tmp_path / "lamp.exr"))
    if kind == "POINT":
        assert found > 1
    else:
        assert found == pytest.approx(2 * 0.8 / np.pi, rel=0.05)
        assert "'Tiny'" in capsys.readouterr().out


@pytest.mark.parametrize("kind", ["POINT", "SPOT", "SUN"])
def test_lamp_of_size_zero(floor, tmp_path, kind):
    rest = {"angle": 0.0} if kind == "SUN" else {"shadow_soft_size": 0.0}
    make_scenes.add_lamp(kind, (0, 0, 2), (0, 0, 0), 100.0, **rest)
    assert middle(blender_scene.render(tmp_path / "lamp.exr")) > 1


def test_camera_scaled_to_zero_is_named(floor, tmp_path):
    floor.camera.scale = (0, 0, 0)
    with pytest.raises(RuntimeError, match="camera 'Camera'"):
        blender_scene.render(tmp_path / "camera.exr")
    assert not (tmp_path / "camera.exr").exists()


def test_missing_image_is_named(floor, tmp_path, capsys):
    image = bpy.data.images.new("Lost", 4, 4)
    image.source, image.filepath = "FILE", str(tmp_path / "lost.png")
    make_scenes.use_image(bpy.data.materials["White"], image)
    pixels = blender_scene.render(tmp_path / "floor.exr")
    assert pixels[16, 16, 0] > 0.1 > pixels[16, 16, 1] and pixels[16, 16, 2] > 0.1
    assert "Lost" in capsys.readouterr().out


@pytest.mark.parametrize("distance", [1e5, 1e6])
def test_far_from_the_origin(floor, tmp_path, distance):
    """Moved as a whole: Blender's own matrices are rounded to 8 mm and 6 cm there, on a floor of 4 m without an edge in view."""
    move = (distance, -distance / 2, 0)
    for thing in bpy.context.scene.objects:
        thing.location = tuple(a + b for a, b in zip(thing.location, move))
    assert middle(blender_scene.render(tmp_path / "far.exr")) == pytest.approx(2 * 0.8 / np.pi, rel=0.05)
