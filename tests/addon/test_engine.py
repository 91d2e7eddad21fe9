"""Pictures as Blender writes them: passes, layers, borders; and what the engine says while it makes them."""

import os
import re
import subprocess
import time
from pathlib import Path

import blender_scene
import bpy
import make_scenes
import numpy as np
import pytest
from exr_layers import render_layers
from sppm import engine, native, native_library, render_result

SIZE = 32


@pytest.fixture
def room(empty_scene):
    """A floor, a glass ball that makes a caustic, and a box, under a small lamp; nothing behind them."""
    make_scenes.add_floor(2.0, make_scenes.diffuse("White", (0.8, 0.7, 0.6)))
    make_scenes.add_sphere("Ball", (0.35, 0, 0.4), 0.3, make_scenes.glass("Glass"), 32, 16)
    make_scenes.add_box("Box", (-0.5, 0.2, 0.2), (0.4, 0.4, 0.4), make_scenes.diffuse("Red", make_scenes.RED), turn=20)
    make_scenes.add_lamp("POINT", (0.4, -0.4, 1.8), (0, 0, 0), 50.0, shadow_soft_size=0.05)
    make_scenes.add_camera((0, -2.6, 1.6), (0, 0, 0.2))
    empty_scene.sppm.photons_per_iteration = 4000
    return empty_scene


def ask_for_all_passes():
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = True
    for name in ("direct", "indirect", "caustics", "radius", "photons"):
        setattr(layer.sppm, f"use_pass_{name}", True)


# ---------------------------------------------------------------- passes


def test_parts_of_the_light_sum_to_the_picture(room, tmp_path):
    ask_for_all_passes()
    passes = {name.split(".")[1]: pixels for name, pixels in render_layers(tmp_path / "room.exr").items()}
    assert {name: pixels.shape[2] for name, pixels in passes.items()} == {
        "Combined": 4, "Depth": 1, "Normal": 3, "Direct": 3, "Indirect": 3, "Caustics": 3, "Radius": 1, "Photons": 1}
    assert passes["Combined"].shape == (SIZE, SIZE, 4)
    for name in ("Direct", "Indirect", "Caustics", "Radius", "Photons"):
        assert passes[name].max() > 0, f"{name} is empty"
    total = passes["Direct"] + passes["Indirect"] + passes["Caustics"]
    assert np.allclose(total, passes["Combined"][..., :3], rtol=1e-4, atol=1e-6)


def test_only_what_is_asked_for_is_in_the_file(room, tmp_path):
    bpy.context.view_layer.use_pass_z = False
    assert list(render_layers(tmp_path / "room.exr")) == ["ViewLayer.Combined"]


def test_depth_and_normal_are_those_of_cycles(room, tmp_path):
    """Where the same surface covers the whole pixel: Cycles' one sample lies anywhere in it."""
    bpy.data.objects.remove(bpy.data.objects["Ball"])
    room.sppm.pixel_filter, room.sppm.filter_width = "BOX", 1.0
    room.sppm.iterations = 16
    layer = bpy.context.view_layer
    layer.use_pass_z = layer.use_pass_normal = True
    ours = render_layers(tmp_path / "sppm.exr")
    room.render.engine = "CYCLES"
    room.cycles.samples, room.cycles.use_denoising = 16, False
    try:
        theirs = render_layers(tmp_path / "cycles.exr")
    finally:
        room.render.engine = "SPPM"
    ours_normal, theirs_normal = ours["ViewLayer.Normal"], theirs["ViewLayer.Normal"]
    same = np.isclose(ours_normal, theirs_normal, atol=0.02).all(-1)
    assert same.mean() > 0.85
    inside = same & (np.abs(np.linalg.norm(theirs_normal, axis=-1) - 1) < 1e-3)
    assert inside.mean() > 0.3
    # A pixel of the slanted floor is deep itself: within it Cycles picks one sample and SPPM the first or the mean.
    depths = ours["ViewLayer.Depth"][inside], theirs["ViewLayer.Depth"][inside]
    assert np.allclose(*depths, rtol=0.06)
    assert np.mean(depths[0]) == pytest.approx(np.mean(depths[1]), rel=0.005)


def test_transparent_film(room, tmp_path):
    """The world still shines, but is not in the picture; glass is opaque."""
    background = room.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (1, 1, 1, 1)
    opaque = blender_scene.render(tmp_path / "opaque.exr")
    assert np.allclose(opaque[..., 3], 1, atol=1e-5)
    room.render.film_transparent = True
    clear = blender_scene.render(tmp_path / "clear.exr")
    assert not clear[-4:].any(), "nothing is behind the top of the picture"
    covered = clear[..., 3] > 0.9999
    assert 0.2 < covered.mean() < 0.9
    assert clear[4, SIZE // 2, 3] == pytest.approx(1, abs=1e-5)
    assert np.allclose(clear[..., :3] + (1 - clear[..., 3:]), opaque[..., :3], atol=1e-3)
    assert np.isclose(clear[covered], opaque[covered], atol=1e-4).all()


# ---------------------------------------------------------------- borders and layers


@pytest.mark.parametrize("crop", [False, True])
def test_border_has_the_pixels_of_the_full_picture(room, tmp_path, crop):
    # What is decided by other pixels is fixed: who finds indirect light, and radii that look at their neighbours'.
    room.sppm.indirect, room.sppm.radius_rule = "PHOTONS", "PROGRESSIVE"
    full = blender_scene.render(tmp_path / "full.exr")
    render = room.render
    render.use_border, render.use_crop_to_border = True, crop
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.8, 0.1, 0.6
    rows, columns = slice(int(0.1 * SIZE), int(0.6 * SIZE)), slice(int(0.25 * SIZE), int(0.8 * SIZE))
    part = blender_scene.render(tmp_path / "part.exr")
    if crop:
        assert part.shape[:2] == full[rows, columns].shape[:2]
    else:
        assert part.shape == full.shape
        outside = np.ones(part.shape[:2], bool)
        outside[rows, columns] = False
        assert not part[outside].any()
        part = part[rows, columns]
    assert np.array_equal(part, full[rows, columns])


def test_two_view_layers(room, tmp_path):
    collection = bpy.data.collections.new("Extra")
    room.collection.children.link(collection)
    make_scenes.add_box("Wall", (0, 0.8, 0.5), (2, 0.1, 1), make_scenes.diffuse("Blue", (0.1, 0.1, 0.9)), collection=collection)
    with_wall = render_layers(tmp_path / "one.exr")["ViewLayer.Combined"]
    second = room.view_layers.new("Second")
    second.layer_collection.children["Extra"].exclude = True
    second.use_pass_normal = True
    bpy.context.view_layer.use_pass_normal = False
    layers = render_layers(tmp_path / "two.exr")
    assert {"ViewLayer.Combined", "Second.Combined", "Second.Normal"} <= set(layers)
    assert "ViewLayer.Normal" not in layers
    assert np.array_equal(layers["ViewLayer.Combined"], with_wall)
    bpy.data.objects.remove(bpy.data.objects["Wall"])
    without = render_layers(tmp_path / "bare.exr")
    assert np.array_equal(layers["Second.Combined"], without["Second.Combined"])
    assert not np.array_equal(with_wall, without["ViewLayer.Combined"])


@pytest.mark.parametrize("is_shared", [False, True], ids=["alone", "two instances"])
@pytest.mark.parametrize("kind", ["glass", "diffuse"])
def test_negative_scale_is_a_mirrored_mesh(room, tmp_path, kind, is_shared):
    """A mesh with one instance is moved to world space by the engine, one with two is not: both must turn its sides right."""
    bpy.data.objects.remove(bpy.data.objects["Box"])
    ball = bpy.data.objects["Ball"]
    ball.data.materials[0] = make_scenes.glass("Glass") if kind == "glass" else make_scenes.diffuse("Blue", (0.1, 0.2, 0.9))
    for vertex in ball.data.vertices:
        vertex.co.x = vertex.co.x * (0.5 if vertex.co.x > 0 else 1.2) + 0.3
    if is_shared:
        make_scenes.link("Hidden below", ball.data).location = (0, 0, -3)
    ball.location, ball.scale = (0, 0, 0.4), (-1, 1, 1)
    bpy.context.view_layer.use_pass_normal = True
    scaled = render_layers(tmp_path / "scaled.exr")
    mirrored = ball.data.copy()
    for vertex in mirrored.vertices:
        vertex.co.x = -vertex.co.x
    mirrored.flip_normals()
    ball.data, ball.scale = mirrored, (1, 1, 1)
    expected = render_layers(tmp_path / "mirrored.exr")
    assert np.isclose(scaled["ViewLayer.Normal"], expected["ViewLayer.Normal"], atol=1e-3).all(-1).mean() > 0.98
    pictures = scaled["ViewLayer.Combined"], expected["ViewLayer.Combined"]
    assert np.isclose(*pictures, rtol=0.02, atol=1e-3).all(-1).mean() > 0.95
    assert pictures[0].mean() == pytest.approx(pictures[1].mean(), rel=0.01)


# ---------------------------------------------------------------- settings and the log


STAMP = re.compile(r"^SPPM: rendered (\d+) iterations, (\d+) photons, ([\d.]+) s, ([\d.]+) MB$", re.MULTILINE)


def stamps(text):
    """(iterations, photons, seconds, megabytes) of each layer that was rendered."""
    return [tuple(map(float, found)) for found in STAMP.findall(text)]


def test_log_has_one_stamp(room, tmp_path, capsys):
    room.sppm.iterations, room.sppm.indirect = 7, "PHOTONS"
    blender_scene.render(tmp_path / "room.exr")
    ((iterations, photons, seconds, megabytes),) = stamps(capsys.readouterr().out)
    assert (iterations, photons) == (7, 7 * 4000)
    assert 0 < seconds < 10
    assert 0 < megabytes < 100


def test_memory_grows_with_the_picture(room, tmp_path, capsys):
    blender_scene.render(tmp_path / "small.exr")
    room.render.resolution_x = room.render.resolution_y = 256
    room.sppm.iterations = 1
    blender_scene.render(tmp_path / "large.exr")
    small, large = stamps(capsys.readouterr().out)
    assert large[3] > small[3] + 256 * 256 * 40 / 2**20


def test_the_first_iteration_sends_as_many_photons_as_pixels_by_default(room, tmp_path, capsys):
    room.sppm.photons_per_iteration, room.sppm.iterations, room.sppm.indirect = 0, 1, "PHOTONS"
    blender_scene.render(tmp_path / "room.exr")
    # Of each kind: those aimed at what throws caustics, and all others.
    assert stamps(capsys.readouterr().out)[0][:2] == (1, 2 * SIZE * SIZE)


def test_time_limit(room, tmp_path, capsys):
    room.sppm.iterations, room.sppm.time_limit = 20_000, 0.3
    start = time.monotonic()
    blender_scene.render(tmp_path / "room.exr")
    assert time.monotonic() - start < 5
    iterations, _, seconds, _ = stamps(capsys.readouterr().out)[0]
    assert 0.3 <= seconds < 3
    assert 1 < iterations < 20_000


def test_another_seed_is_other_noise(room, tmp_path):
    first = blender_scene.render(tmp_path / "first.exr")
    room.sppm.seed = 1
    assert not np.array_equal(first, blender_scene.render(tmp_path / "second.exr"))


def test_threads_are_blenders_and_do_not_change_the_picture(room, tmp_path, monkeypatch):
    threads, scene_type = [], native.Scene
    monkeypatch.setattr(native, "Scene", lambda desc, count: threads.append(count) or scene_type(desc, count))
    first = blender_scene.render(tmp_path / "first.exr")
    room.render.threads_mode, room.render.threads = "FIXED", 3
    assert np.array_equal(first, blender_scene.render(tmp_path / "second.exr"))
    assert threads == [0, 3]


class Interrupted:
    """A render engine whose user presses Esc; Blender lets nobody replace an engine's own `test_break`."""

    def __init__(self, engine, test_break):
        self._engine, self.test_break = engine, test_break

    def __getattr__(self, name):
        return getattr(self._engine, name)


@pytest.mark.parametrize("is_within_step", [False, True], ids=["between steps", "within a step"])
def test_cancelled_picture_is_that_of_the_last_iteration(room, tmp_path, monkeypatch, is_within_step):
    """As by Esc; a step that is cancelled leaves no trace."""
    room.sppm.iterations = 2
    expected = blender_scene.render(tmp_path / "expected.exr")
    room.sppm.iterations = 1000
    step, started, cancelled = native.Session.step, [], []

    def step_or_wait(session):
        started.append(1)
        if len(started) < 3:
            return step(session)
        for _ in range(200):
            if cancelled:
                raise native_library.Cancelled("cancelled", native_library.STATUS_CANCELLED)
            time.sleep(0.01)
        raise AssertionError("nobody cancelled the step")

    monkeypatch.setattr(native.Session, "step", step_or_wait)
    monkeypatch.setattr(native.Session, "cancel", lambda session: cancelled.append(1))
    last = 3 if is_within_step else 2
    make_render = engine._Render
    monkeypatch.setattr(engine, "_Render", lambda engine, *others: make_render(
        Interrupted(engine, lambda: len(started) >= last), *others))
    assert np.array_equal(blender_scene.render(tmp_path / "cancelled.exr"), expected)
    assert len(started) == last


def test_snapshot_lies_beside_the_output(room, tmp_path):
    room.sppm.write_interval = 2
    picture = blender_scene.render(tmp_path / "room.exr")
    (snapshot,) = tmp_path.glob("*.sppm.exr")
    assert np.allclose(blender_scene.read(snapshot)[..., :3], picture[..., :3], rtol=1e-3, atol=1e-5)


def test_unsupported_node_is_named_once(room, tmp_path, capsys):
    """Two objects have the material."""
    hair = make_scenes.node_material("Fur", "ShaderNodeBsdfHair", {})
    for name in ("Box", "Ball"):
        bpy.data.objects[name].data.materials[0] = hair
    blender_scene.render(tmp_path / "room.exr")
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("SPPM:") and "'Fur'" in line]
    assert len(lines) == 1
    assert "Hair BSDF" in lines[0]


def test_clean_scene_warns_of_nothing(room, tmp_path, capsys):
    room.sppm.iterations = 1
    blender_scene.render(tmp_path / "room.exr")
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("SPPM:")]
    assert STAMP.match(lines[0]), "the first line is the stamp"


# ---------------------------------------------------------------- failures


def fail(*_args, **_kwargs):
    raise ValueError("out of luck")


@pytest.mark.parametrize("owner, name", [
    (engine, "export_scene"), (native, "Scene"), (native, "Session"), (native.Session, "step"),
    (native.Session, "read_pass"), (render_result.ResultWriter, "write"),
], ids=lambda part: part if isinstance(part, str) else part.__name__)
def test_whatever_fails_is_an_error_without_a_picture(room, tmp_path, monkeypatch, owner, name, capsys):
    with monkeypatch.context() as patch:
        patch.setattr(owner, name, fail)
        with pytest.raises(RuntimeError, match="out of luck"):
            blender_scene.render(tmp_path / "room.exr")
        assert not (tmp_path / "room.exr").exists()
        assert stamps(capsys.readouterr().out) == []
    assert blender_scene.render(tmp_path / "room.exr")[..., :3].mean() > 0


def test_step_that_fails_late_is_an_error(room, tmp_path, monkeypatch):
    step, calls = native.Session.step, []

    def fail_at_third(session):
        calls.append(1)
        return step(session) if len(calls) < 3 else fail()

    monkeypatch.setattr(native.Session, "step", fail_at_third)
    with pytest.raises(RuntimeError, match="out of luck"):
        blender_scene.render(tmp_path / "room.exr")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not bpy.app.binary_path, reason="the bpy wheel has no blender program to start")
@pytest.mark.parametrize("camera", ["PERSP", "PANO", None])
def test_exit_code_of_blender(room, tmp_path, camera):
    """A panoramic camera is refused by the engine, none at all by Blender itself."""
    if camera:
        room.camera.data.type = camera
    else:
        room.camera = None
    room.render.image_settings.file_format = "OPEN_EXR"
    file, works = tmp_path / "room.blend", camera == "PERSP"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    command = [bpy.app.binary_path, "-b", "--factory-startup", "--addons", "sppm", str(file),
               "-o", str(tmp_path / "out_####"), "-f", "1"]
    done = subprocess.run(command, env=dict(os.environ), capture_output=True, text=True, timeout=60, check=False)
    output = done.stdout + done.stderr
    assert done.returncode == (0 if works else 1), output
    assert [Path(path).name for path in tmp_path.glob("out_*")] == (["out_0001.exr"] if works else [])
    assert len(stamps(done.stdout)) == works
    if not works:
        assert ("panoramic" if camera else "camera") in output
