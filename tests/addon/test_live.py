"""Viewports in Rendered shading, in a real window: one run of live_in_window.py, looked at from all sides."""

import json

import blender_scene
import in_window
import numpy as np
import pytest

pytestmark = in_window.needed

# On a quiet machine the first picture after a change is there within 0.2 s; this one may be shared.
PATIENCE = 30.0


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """{name of a step: what it told}, and the folder of its pictures."""
    folder = tmp_path_factory.mktemp("live")
    output = in_window.run("live_in_window.py", folder, folder, size=(640, 480))
    facts = {}
    for line in output.splitlines():
        if line.startswith("LIVE "):
            name, _, told = line[5:].partition(" {")
            facts[name] = json.loads("{" + told)
    print("\n".join(f"{name}: {fact['seconds']:.3f} s" for name, fact in facts.items() if "seconds" in fact))
    facts["preview lines"] = [line for line in output.partition("LIVE shown")[0].splitlines() if line.startswith("SPPM")]
    return facts, folder


def srgb(linear):
    linear = np.clip(linear, 0, 1)
    return np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def test_the_screen_shows_the_picture_in_the_right_colours(run):
    facts, folder = run
    pixels = np.load(folder / "shown.npy")
    screen = blender_scene.read(folder / "shown.png")
    assert pixels.shape[:2] == screen.shape[:2] == tuple(facts["shown"]["size"])
    error = np.abs(srgb(pixels[..., :3]) - screen[..., :3])
    assert np.median(error) <= 1.5 / 255, "of rounding to bytes"
    assert np.quantile(error, 0.9) < 0.03, "but for what Blender draws over it"


def test_the_picture_is_that_of_a_render(run):
    """Inside the camera's frame, in the caustic too; the frame's edges lie within pixels, and both have noise."""
    facts, folder = run
    left, bottom, right, top = np.rint(facts["shown"]["frame"]).astype(int)
    live = np.load(folder / "shown.npy")[bottom:top, left:right, :3]
    rendered = blender_scene.read(folder / "rendered.exr")[..., :3]
    blocks = [means(picture, 8) for picture in (live, rendered)]
    assert np.median(np.abs(blocks[0] / blocks[1] - 1)) < 0.03
    assert blocks[0].max() == pytest.approx(blocks[1].max(), rel=0.25)
    assert np.unravel_index(blocks[0].argmax(), (8, 8, 3))[:2] == np.unravel_index(blocks[1].argmax(), (8, 8, 3))[:2]


def means(picture, count):
    """Of count x count parts, as even as pixels let them be."""
    rows = np.array_split(picture, count, axis=0)
    return np.array([[part.mean((0, 1)) for part in np.array_split(row, count, axis=1)] for row in rows])


@pytest.mark.parametrize(("name", "x"), [("moved 0", 0.1), ("moved 1", 0.0), ("moved 2", -0.1)])
def test_moving_an_object_restarts_and_reads_nothing(run, name, x):
    fact = run[0][name]
    assert fact["seconds"] < PATIENCE
    assert fact["read"] == []
    assert fact["x"] == pytest.approx(x)


def test_editing_a_material_restarts_and_reads_it_alone(run):
    assert run[0]["material"]["seconds"] < PATIENCE
    assert run[0]["material"]["read"] == ["Red"]


def test_selecting_restarts_nothing(run):
    assert not run[0]["selected"]["restarted"]


def test_undo_shows_what_was_before(run):
    assert run[0]["undone"]["x"] == pytest.approx(-0.1)


def test_mesh_is_shown_while_it_is_edited(run):
    assert run[0]["edited"]["after"] == 4 * run[0]["edited"]["before"] > 0


def test_view_is_followed(run):
    facts, _ = run
    for name in ("perspective", "orthographic"):
        assert facts[name]["seconds"] < PATIENCE and facts[name]["read"] == []
    assert facts["orthographic"]["projection"] == "ORTHOGRAPHIC"
    assert facts["navigated"]["pictures"] >= 8


def test_border_is_rendered_alone(run):
    border = run[0]["border"]
    assert border["full"] == [pytest.approx(size / 2, abs=1) for size in border["region"]]


def test_panoramic_camera_is_refused_and_another_goes_on(run):
    assert "panoramic" in run[0]["failed"]["message"]


@pytest.mark.parametrize("name", ["solid", "loaded", "disabled"])
def test_rendering_stops_with_the_viewport(run, name):
    assert run[0][name]["seconds"] < PATIENCE
    assert run[0][name]["views"] == 0, "nothing of it is kept"


def test_file_load_and_reload_of_the_addon_go_on(run):
    assert run[0]["shown after loading"]["views"] == 1
    assert run[0]["enabled"] == {"views": 1, "engine": "SPPM"}


# ---------------------------------------------------------------- small pictures of materials


def test_materials_have_pictures(run):
    """A red ball, and one of glass, that fill the middle and have nothing behind them; nobody is told of their rendering."""
    facts, folder = run
    for name in ("Red", "Glass"):
        assert facts[f"preview {name}"]["seconds"] < PATIENCE
        pixels = np.load(folder / f"{name}.npy")
        height, width = pixels.shape[:2]
        assert min(height, width) >= 64
        assert pixels[0, 0, 3] == 0.0 and pixels[height // 2, width // 2, 3] == 1.0
        assert 0.3 < (pixels[..., 3] > 0.5).mean() < 0.9
    red = np.load(folder / "Red.npy")
    assert red[red[..., 3] > 0.5][:, 0].mean() > 2.0 * red[red[..., 3] > 0.5][:, 1].mean() > 0.0
    assert facts["preview lines"] == []
