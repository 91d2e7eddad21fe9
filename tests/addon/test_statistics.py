"""What a render tells about itself: in the log, and in what the panels are given."""

import re

import blender_scene
import bpy
import make_scenes
import pytest
from sppm import statistics
from sppm.statistics import Report
from test_engine import ask_for_all_passes, render_layers


@pytest.fixture
def ball(empty_scene):
    blender_scene.add_ball_on_floor()
    return empty_scene


def the_report():
    ((_, report),) = statistics.reports("Scene", ["ViewLayer"])
    return report


def test_report_has_the_counters_of_the_stamp(ball, tmp_path, capsys):
    blender_scene.render(tmp_path / "ball.exr")
    stamp = re.search(r"rendered (\d+) iterations, (\d+) photons, ([\d.]+) s, ([\d.]+) MB", capsys.readouterr().out)
    report = the_report()
    assert (report.progress.iteration, report.progress.photons_emitted) == (int(stamp[1]), int(stamp[2]))
    assert report.progress.seconds == pytest.approx(float(stamp[3]), abs=1e-3)
    assert report.memory_bytes / 2**20 == pytest.approx(float(stamp[4]), abs=0.1)
    assert report.messages == []


def test_shares_are_those_of_the_passes(ball, tmp_path, capsys):
    ask_for_all_passes()
    passes = {name.split(".")[1]: pixels for name, pixels in render_layers(tmp_path / "ball.exr").items()}
    total, shares, log = passes["Combined"][..., :3].sum(), the_report().shares, capsys.readouterr().out
    assert set(shares) == {"Caustics", "Indirect"}
    assert shares["Caustics"] > 0.01
    for name, light in (("Caustics", "caustic light"), ("Indirect", "indirect light")):
        assert shares[name] == pytest.approx(passes[name].sum() / total, rel=1e-4)
        assert f"SPPM: {light} is {shares[name]:.1%} of the picture" in log


def test_snapshots_have_no_passes_that_nobody_asked_for(ball, tmp_path):
    ball.sppm.write_interval = 2
    blender_scene.render(tmp_path / "ball.exr")
    (snapshot,) = tmp_path.glob("*.sppm.exr")
    assert b"Caustics" not in snapshot.read_bytes()
    assert the_report().shares == {}
    assert the_report().progress.iteration == 4


def test_photons_that_arrive_nowhere_in_view(ball, tmp_path, capsys):
    """The camera looks at the sky."""
    ball.camera.rotation_euler.x += 2.0
    blender_scene.render(tmp_path / "sky.exr")
    (message,) = the_report().messages
    assert message.startswith(f"none of {the_report().progress.photons_emitted} photons arrived")
    assert f"SPPM: {message}" in capsys.readouterr().out


def test_warnings_of_the_exporter_are_kept(ball, tmp_path):
    bpy.data.objects["Ball"].data.materials[0] = make_scenes.node_material("Fur", "ShaderNodeBsdfHair", {})
    blender_scene.render(tmp_path / "fur.exr")
    assert any("'Fur'" in message for message in the_report().messages)


def test_messages_survive_a_render_that_fails(ball, tmp_path, monkeypatch):
    from sppm import native, native_library

    def fail(*_):
        raise native_library.SppmError("out of luck")

    bpy.data.objects["Ball"].data.flip_normals()
    monkeypatch.setattr(native.Session, "step", fail)
    with pytest.raises(RuntimeError, match="out of luck"):
        blender_scene.render(tmp_path / "failed.exr")
    assert "'Ball'" in the_report().messages[0]
    assert the_report().progress is None


def test_message_of_one_layer_names_it():
    both, one = Report(["dark", "open"]), Report(["dark"])
    assert statistics.messages([("A", both), ("B", one)]) == ["dark", "A: open"]
    assert statistics.messages([("A", both)]) == ["dark", "open"]


@pytest.mark.parametrize("value, text", [(0.314, "0.31 s"), (59.99, "59.99 s"), (125, "2:05"), (3609.4, "1:00:09")])
def test_times_read_well(value, text):
    assert statistics.seconds(value) == text


@pytest.mark.parametrize("value, text", [(12, "12"), (1200, "1.20 k"), (3_400_000, "3.40 M"), (5_600_000_000, "5.60 G")])
def test_counts_read_well(value, text):
    assert statistics.count(value) == text
