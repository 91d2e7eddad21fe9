"""What a render does beside being right on average: identity, cancelling, files, passes, odd cameras."""

import os
import struct
import threading
import time
import zlib

import numpy as np
import pytest
from scenes import (DOWN, Scene, at, box, diffuse, emission, floor, glass, grey, look_at, quad, render, render_all, sphere)
from sppm import native
from sppm.native_library import STATUS_NAMES, Cancelled, SppmError
from sppm.scene_desc import LightFlags, LightType, Projection

RHO = 0.5
ALL = frozenset(native.PASS_NAMES)


def room(size=24, **camera):
    """Walls, an area lamp, a ball of glass with its caustic: every pass has something."""
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(0.6)).add(sphere(0.35, (0.1, 0.2, -0.5), divisions=3), glass())
    scene.light(LightType.RECTANGLE, at(0, 0, 0.95), 3, size_x=0.4, size_y=0.4)
    return scene.camera(look_at((0, -0.95, 0.1), (0, 0.4, -0.4)), 0.8, size, **camera)


def assert_identical(a, b):
    for name in native.PASS_NAMES:
        assert np.array_equal(a[name], b[name]), name


# ---------------------------------------------------------------- seeds


def test_seeds_differ():
    a, b = (render(room(), "Combined", iterations=1, seed=seed) for seed in (1, 2))
    assert not np.array_equal(a, b)


# ---------------------------------------------------------------- identity


def test_same_bits_for_any_number_of_threads_and_again():
    first = render_all(room(), threads=1, photons_per_iteration=20000)
    for threads in (1, 2, 4):
        assert_identical(first, render_all(room(), threads=threads, photons_per_iteration=20000))


def test_sessions_of_more_threads_than_cores_are_given_them_side_by_side(capfd):
    """TBB would tell on stderr that it gives fewer."""
    few, many = os.cpu_count() + 1, os.cpu_count() + 9
    with native.Scene(room().desc) as scene, native.Session(scene, native.Settings(threads=few)) as first:
        first.step()
        with native.Session(scene, native.Settings(threads=many)) as second:
            second.step()
    assert capfd.readouterr().err == ""


def test_region_shows_the_pixels_of_the_whole():
    """All that does not come from photons, whose number a pixel and whose path depends on what else is seen."""
    whole = render_all(room(), photons_per_iteration=5000)
    x, y, width, height = 5, 9, 13, 7
    part = render_all(room(region=(x, y, width, height)), photons_per_iteration=5000)
    for name in ("Direct", "Depth", "Normal", *native.PASS_NAMES[8:]):
        assert part[name].shape[:2] == (height, width)
        assert np.array_equal(part[name], whole[name][y:y + height, x:x + width]), name


def test_combined_is_the_sum_of_its_parts():
    found = render_all(room())
    total = found["Direct"] + found["Indirect"] + found["Caustics"]
    np.testing.assert_allclose(found["Combined"][..., :3], total, rtol=1e-5, atol=1e-7)
    assert found["Indirect"].any() and found["Caustics"].any()


# ---------------------------------------------------------------- the split of the work


@pytest.mark.parametrize(("indirect", "share"), [("PHOTONS", 1), ("PATHS", 0.5)])
def test_photons_take_about_as_many_rays_as_camera_paths_and_caustic_photons_half(indirect, share):
    with native.Scene(room(48).desc) as scene, native.Session(scene, native.Settings(indirect=indirect)) as session:
        session.step()
        first = session.progress()
        for _ in range(4):
            session.step()
        last = session.progress()
    paths = last.rays_camera + last.rays_shadow - first.rays_camera - first.rays_shadow
    assert 0.8 < (last.rays_photon - first.rays_photon) / (share * paths) < 1.25


@pytest.mark.parametrize(("walls", "wanted"), [(True, "PHOTONS"), (False, "PATHS")])
def test_closed_rooms_are_lit_by_photons_and_open_ones_by_paths(walls, wanted):
    scene = room(48) if walls else Scene(0.1).add(floor(50), diffuse(0.5)).light(LightType.SUN, DOWN, 3).above(1, 0.5, size=48)
    with native.Scene(scene.desc) as built, native.Session(built, native.Settings()) as session:
        assert session.progress().indirect == "AUTO"
        session.step()
        assert session.progress().indirect == wanted


def test_an_open_scene_decided_by_itself_is_the_one_asked_for():
    """What the first iteration tried leaves no trace."""
    scene = Scene(0.1).add(floor(50), diffuse(0.5)).add(sphere(0.2, (0, 0, 0.3)), glass()).light(LightType.SUN, DOWN, 3)
    scene.above(1, 0.5, size=24)
    assert_identical(render_all(scene), render_all(scene, indirect="PATHS"))


def test_what_throws_no_caustics_costs_no_photons():
    scene = Scene(0.1).add(floor(50), diffuse(0.5)).light(LightType.SUN, DOWN, 3).above(1, 0.5, size=48)
    with native.Scene(scene.desc) as built, native.Session(built, native.Settings(indirect="PATHS")) as session:
        session.step()
        assert session.progress().photons_emitted == session.progress().rays_photon == 0


# ---------------------------------------------------------------- stopping


def test_time_limit_finishes():
    settings = native.Settings(iterations=1_000_000, time_limit=0.3)
    with native.Scene(room().desc) as scene, native.Session(scene, settings) as session:
        started = time.monotonic()
        while not session.progress().finished:
            session.step()
            assert time.monotonic() - started < 20
        progress = session.progress()
        assert 0.3 <= progress.seconds < 20
        assert 1 <= progress.iteration < 1_000_000


def test_finished_after_the_last_iteration_and_legal_beyond():
    with native.Scene(room().desc) as scene, native.Session(scene, native.Settings(iterations=2)) as session:
        finished = []
        for _ in range(3):
            session.step()
            finished.append(session.progress().finished)
    assert finished == [False, True, True]


def test_cancel_from_another_thread_returns_soon_and_leaves_no_trace():
    """The step under way would take minutes; afterwards the session goes on as if it had not been."""
    wanted = render(room(), "Combined", iterations=1, photons_per_iteration=5000)
    huge = native.Settings(photons_per_iteration=1 << 28)
    with native.Scene(room().desc) as scene, native.Session(scene, huge) as session:
        timer = threading.Timer(0.3, session.cancel)
        started = time.monotonic()
        timer.start()
        with pytest.raises(Cancelled):
            session.step()
        assert time.monotonic() - started < 5
        timer.join()
        assert session.progress().iteration == 0
        assert not session.read_pass("Combined").any()
    small = native.Settings(photons_per_iteration=5000)
    with native.Scene(room().desc) as scene, native.Session(scene, small) as session:
        session.cancel()
        with pytest.raises(Cancelled):
            session.step()
        session.step()
        assert np.array_equal(session.read_pass("Combined"), wanted)


# ---------------------------------------------------------------- files


def read_exr(path):
    """Channels (height, width) and string attributes of a scanline file of floats with ZIP compression."""
    data = path.read_bytes()
    assert struct.unpack_from("<II", data) == (20000630, 2)
    position, attributes = 8, {}

    def text():
        nonlocal position
        end = data.index(b"\0", position)
        value, position = data[position:end].decode(), end + 1
        return value

    while name := text():
        kind, (size,) = text(), struct.unpack_from("<I", data, position)
        attributes[name] = kind, data[position + 4:position + 4 + size]
        position += 4 + size
    assert attributes["compression"][1] == b"\3"
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"][1])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    names, rest = [], attributes["channels"][1]
    while rest != b"\0":
        name, rest = rest.split(b"\0", 1)
        assert struct.unpack_from("<I", rest)[0] == 2  # float
        names.append(name.decode())
        rest = rest[16:]
    rows = []
    for offset in struct.unpack_from(f"<{(height + 15) // 16}Q", data, position):
        y, size = struct.unpack_from("<iI", data, offset)
        count = min(16, height - (y - y0))
        raw = data[offset + 8:offset + 8 + size]
        if size < count * width * 4 * len(names):
            steps = np.frombuffer(zlib.decompress(raw), np.uint8).astype(np.int64)
            steps[1:] -= 128
            mixed = (np.cumsum(steps) % 256).astype(np.uint8)
            half = (len(mixed) + 1) // 2
            raw = np.empty_like(mixed)
            raw[0::2], raw[1::2] = mixed[:half], mixed[half:]
        rows.append(np.frombuffer(bytes(raw), "<f4").reshape(count, len(names), width))
    pixels = np.concatenate(rows)
    strings = {name: value.decode() for name, (kind, value) in attributes.items() if kind == "string"}
    return {name: pixels[:, i] for i, name in enumerate(names)}, strings


def test_exr_has_every_pass_and_the_statistics(tmp_path):
    path = tmp_path / "picture.exr"
    with native.Scene(room().desc) as scene, native.Session(scene, native.Settings(seed=7, passes=ALL)) as session:
        for _ in range(2):
            session.step()
        session.write_exr(path)
        channels, strings = read_exr(path)
        letters = {"RGB": ("Direct", "Indirect", "Caustics", "Emission", "Environment", "Diffuse Color", "Denoising Albedo"),
                   "XYZ": ("Normal", "Position", "Denoising Normal"), "UVA": ("UV",), "Z": ("Depth", "Mist"),
                   "V": ("Radius", "Photons", "Object Index", "Material Index")}
        layers = {name: [f"{name}.{c}" for c in parts] for parts, names in letters.items() for name in names}
        layers["Combined"] = list("RGBA")
        assert set(layers) == ALL and sorted(channels) == sorted(sum(layers.values(), []))
        for name, parts in layers.items():
            stored = np.stack([channels[part] for part in parts], axis=-1)[::-1]  # a file's first row is the top one
            assert np.array_equal(stored, session.read_pass(name)), name
    assert (strings["sppm:iterations"], strings["sppm:seed"]) == ("2", "7")
    assert list(tmp_path.iterdir()) == [path]


def test_snapshots_are_written_at_their_interval(tmp_path):
    path = tmp_path / "snapshot.exr"
    settings = native.Settings(write_interval=2, snapshot_path=str(path))
    with native.Scene(room().desc) as scene, native.Session(scene, settings) as session:
        session.step()
        assert not path.exists()
        session.step()
        session.step()
        assert read_exr(path)[1]["sppm:iterations"] == "2"


def test_file_that_cannot_be_written(tmp_path):
    with native.Scene(room().desc) as scene, native.Session(scene, native.Settings()) as session:
        session.step()
        with pytest.raises(SppmError, match="missing") as caught:
            session.write_exr(tmp_path / "missing" / "picture.exr")
    assert STATUS_NAMES[caught.value.status] == "I/O error"


# ---------------------------------------------------------------- passes and cameras

SHARP = dict(iterations=2, pixel_filter="BOX", filter_width=0.001)


def half_plane(world=0.5):
    """Fills the left half of the picture."""
    scene = Scene(world).add(quad([(-9, -9, 0), (0, -9, 0), (0, 9, 0), (-9, 9, 0)]), diffuse(RHO))
    return scene.camera(at(0, 0, 2), 1, 16)


@pytest.mark.parametrize("transparent", [False, True])
def test_alpha_of_the_film(transparent):
    picture = render(half_plane(), "Combined", transparent_film=transparent, **SHARP)
    assert (picture[:, :8, 3] == 1).all()
    assert (picture[:, 8:, 3] == (0 if transparent else 1)).all()
    assert np.allclose(picture[:, 8:, :3], 0 if transparent else 0.5)
    assert (picture[:, :8, :3] > 0).all()


def test_alpha_at_an_edge_is_what_is_covered():
    """The box filter over the pixels left and right of the edge: one is half covered once the filter is two pixels wide."""
    settings = {"iterations": 400, "transparent_film": True, "pixel_filter": "BOX", "filter_width": 2.0}
    picture = render(half_plane(), "Combined", **settings)[..., 3]
    # 16 rows of 400 samples of a coin that shows 3/4 or 1/4.
    error = 4 * np.sqrt(0.75 * 0.25 / (16 * 400))
    assert abs(picture[:, 7].mean() - 0.75) < error
    assert abs(picture[:, 8].mean() - 0.25) < error


def test_depth_and_normal_of_a_plane():
    depth, normal = render(half_plane(), "Depth", "Normal", **SHARP)
    assert np.allclose(depth[:, :8], 2, rtol=1e-5)
    assert np.allclose(depth[:, 8:], 1e10)
    assert np.allclose(normal[:, :8], (0, 0, 1), atol=1e-4)
    assert (normal[:, 8:] == 0).all()


def test_depth_of_a_tilted_plane_is_along_the_axis_and_its_normal_faces_the_camera():
    """Plane z = x seen from (0, 0, 2): depth 2 - x, and x = u depth gives 2 / (1 + u). Its normal points away from the camera."""
    shape = quad([(-5, -5, -5), (-5, 5, -5), (5, 5, 5), (5, -5, 5)])
    scene = Scene(0.5).add(shape, diffuse(RHO)).camera(at(0, 0, 2), 0.5, 16)
    depth, normal = render(scene, "Depth", "Normal", **SHARP)
    u = (np.arange(16) + 0.5) / 16 - 0.5
    assert np.allclose(depth[..., 0], 2 / (1 + u), rtol=1e-4)
    assert np.allclose(normal, np.array([-1, 0, 1]) / np.sqrt(2), atol=1e-3)


def test_orthographic_sees_parallel():
    """A square of side 1 covers the middle quarter of a window of width 2, wherever the camera stands."""
    for z in (1, 7):
        scene = Scene(0.5).add(floor(0.5), diffuse(RHO)).camera(at(0, 0, z), 1, 16, projection=Projection.ORTHOGRAPHIC)
        depth = render(scene, "Depth", **SHARP)[..., 0]
        assert np.allclose(depth[4:12, 4:12], z, rtol=1e-5)
        assert (depth < 100).sum() == 64


def test_clipping():
    scene = Scene(0.5).add(floor(9), diffuse(RHO)).add(floor(9, 1), diffuse(RHO))
    for near, far, wanted in ((0.1, 9, 1), (1.5, 9, 2), (0.1, 0.9, 1e10), (2.5, 9, 1e10)):
        scene.camera(at(0, 0, 2), 0.5, 4, clip_near=near, clip_far=far)
        assert np.allclose(render(scene, "Depth", **SHARP), wanted, rtol=1e-5)


def test_camera_inside_glass():
    """It looks out of a block: the sky is seen n^2 times as bright where it is seen at all, and nothing breaks."""
    scene = Scene(world=1).add(box((-1, -1, -1), (1, 1, 1)), glass(1.5)).camera(at(0, 0, 0), 0.2)
    picture = render(scene, "Combined", iterations=256, max_depth=1024)[..., :3]
    assert np.isclose(picture.mean(), 1.5**2, rtol=0.02)


def test_depth_of_field_keeps_what_is_in_focus():
    scene = half_plane().camera(at(0, 0, 2), 1, 16, aperture_radius=0.3, focal_distance=2)
    sharp = render(scene, "Combined", transparent_film=True, **SHARP)[..., 3]
    assert (sharp[:, :8] == 1).all() and (sharp[:, 8:] == 0).all()
    scene.camera(at(0, 0, 2), 1, 16, aperture_radius=0.3, focal_distance=1)
    blurred = render(scene, "Combined", transparent_film=True, **{**SHARP, "iterations": 64})[..., 3]
    assert 0 < blurred[:, 7].mean() < 1 and 0 < blurred[:, 8].mean() < 1


def test_nothing_visible():
    scene = Scene().add(floor(1), diffuse(RHO)).light(LightType.POINT, at(0, 0, 1), 1).camera(look_at((0, 0, 2), (0, 1, 9)), 0.5)
    found = render_all(scene)
    assert not found["Combined"][..., :3].any()
    assert (found["Depth"] == np.float32(1e10)).all()


def test_no_light():
    found = render_all(Scene().add(floor(1), diffuse(RHO)).above(1, 0.5))
    assert not found["Combined"][..., :3].any() and (found["Combined"][..., 3] == 1).all()


def test_empty_scene():
    assert not render(Scene().camera(at(0, 0, 0), 1), "Combined")[..., :3].any()


def test_dark_materials():
    """No closure at all, and a diffuse one of albedo 0."""
    for closures in ((), (diffuse(0),)):
        scene = Scene(world=1).add(floor(9), *closures).light(LightType.POINT, at(0, 0, 1), 1).above(0.5, 0.5)
        assert not render(scene, "Combined")[..., :3].any()


def test_shadow_and_its_switch():
    for flags, lit in ((LightFlags.NONE, False), (LightFlags.NO_SHADOW, True)):
        scene = Scene().add(floor(1), diffuse(RHO)).add(floor(1, 0.5), diffuse(0)).above(0.4, 0.2)
        scene.light(LightType.SUN, DOWN, 1, flags=flags)
        assert render(scene, "Direct").any() == lit


def test_emitter_seen_directly():
    picture = render(Scene().add(floor(9), emission(2.5)).above(1, 0.5), "Combined")
    assert np.allclose(picture, (*grey(2.5), 1))
