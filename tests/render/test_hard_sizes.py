"""Numbers that renderers go wrong on: very few and very many pixels, photons and iterations, little time, short paths."""

import resource
import time

import numpy as np
import pytest
from scenes import DOWN, Scene, at, box, diffuse, floor, glass, look_at, render, render_all, sphere
from sppm import native
from sppm.scene_desc import LightType
from sppm.scene_validation import SceneError


def room(width=16, height=None):
    """Direct light, indirect light and a caustic."""
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(0.6)).add(sphere(0.35, (0.1, 0.2, -0.5), divisions=3), glass())
    scene.light(LightType.RECTANGLE, at(0, 0, 0.95), 3, size_x=0.4, size_y=0.4)
    scene.camera(look_at((0, -0.95, 0.1), (0, 0.4, -0.4)), 0.8)
    scene.desc.camera = scene.desc.camera.__class__(**{**vars(scene.desc.camera), "width": width, "height": height or width})
    return scene


def finished(scene, **settings):
    """The session after all its steps, and what it told."""
    with native.Scene(scene.desc) as built, native.Session(built, native.Settings(**settings)) as session:
        while not session.progress().finished:
            session.step()
        return session.progress(), session.read_pass("Combined")


def resident_bytes():
    """Memory of this process that is in use now."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize()


# ---------------------------------------------------------------- pixels


@pytest.mark.parametrize(("width", "height"), [(1, 1), (1, 4096), (4096, 1), (3, 2), (17, 33)])
def test_pictures_of_odd_size(width, height):
    """Squeezed to any size it is the same room."""
    # A radius in metres: three pixels as large as the picture would reach across the room, into its dark corners.
    settings = dict(initial_radius=0.1, radius_rule="PROGRESSIVE", photons_per_iteration=1000)
    wanted = render(room(32), "Combined", iterations=32, **settings)[..., :3].mean()
    found = render_all(room(width, height), iterations=min(max(2, 20000 // (width * height)), 1000), **settings)["Combined"]
    assert found.shape == (height, width, 4)
    assert found[..., :3].mean() == pytest.approx(wanted, rel=0.25)


@pytest.mark.slow
def test_picture_of_67_million_pixels():
    """8192x8192: memory stated, and no pixel is left out. The photons are few, so that pixels are what counts."""
    before, progress = resident_bytes(), None
    settings = native.Settings(iterations=2, photons_per_iteration=1 << 20)
    with native.Scene(room(8192).desc) as built, native.Session(built, settings) as session:
        started = time.monotonic()
        for _ in range(2):
            session.step()
        progress, seconds, used = session.progress(), time.monotonic() - started, resident_bytes() - before
        picture = session.read_pass("Combined")
    pixels = 8192 * 8192
    print(f"{seconds:.0f} s, {progress.memory_bytes / pixels:.0f} bytes a pixel told, {used / pixels:.0f} used")
    assert progress.dropped_samples == 0
    assert progress.memory_bytes < 300 * pixels and used < 1.2 * progress.memory_bytes
    assert np.isfinite(picture).all() and (picture[..., 3] == 1).all()
    assert (picture[..., :3] > 0).any(axis=-1).mean() > 0.5


# ---------------------------------------------------------------- photons, time, depth


@pytest.mark.parametrize("indirect", ["PHOTONS", "PATHS", "AUTO"])
def test_one_photon_an_iteration(indirect):
    """After a thousand of them their light is there, in few and bright spots."""
    many = render_all(room(8), iterations=64, photons_per_iteration=4000, indirect=indirect)
    found = render_all(room(8), iterations=1000, photons_per_iteration=1, indirect=indirect)
    assert 0.3 * many["Indirect"].mean() < found["Indirect"].mean() < 3 * many["Indirect"].mean()


@pytest.mark.parametrize("limit", [1e-9, 0.1])
def test_short_time_limit(limit):
    """At least one iteration; and the one under way is finished, no other begun."""
    progress, picture = finished(room(64), iterations=1_000_000, time_limit=limit)
    assert progress.iteration >= 1 and np.isfinite(picture).all() and picture[..., :3].any()
    assert progress.seconds - limit < 2 * progress.seconds / progress.iteration + 0.5


@pytest.mark.parametrize("max_depth", [1, 2, 3])
def test_shortest_paths(max_depth):
    """With one vertex there is direct light alone; with more only what fits."""
    found = render_all(room(), max_depth=max_depth, photons_per_iteration=5000)
    assert found["Direct"].any()
    assert found["Indirect"].any() == (max_depth > 1)
    assert found["Caustics"].any() == (max_depth > 1)  # by reflection at the glass


def test_depth_one_is_direct_light():
    """Of a room without glass it is the same direct light as with any depth."""
    scene = Scene().add(floor(2), diffuse(0.5)).light(LightType.POINT, at(0, 0, 1), 1).above(0.9, 0.5)
    shallow, deep = (render(scene, "Direct", max_depth=depth) for depth in (1, 24))
    assert np.allclose(shallow, deep, rtol=1e-6)


# ---------------------------------------------------------------- nothing at all


def test_no_camera_is_refused_by_name():
    with pytest.raises(SceneError, match="no camera"):
        native.Scene(Scene().add(floor(1), diffuse(0.5)).desc)


@pytest.mark.parametrize("what", ["nothing", "no light", "looks away", "lamp alone", "sky alone"])
def test_scenes_without_something(what):
    scene = Scene(world=0.5 if what == "sky alone" else None)
    if what in ("no light", "looks away"):
        scene.add(floor(1), diffuse(0.5))
    if what in ("looks away", "lamp alone"):
        scene.light(LightType.SUN, DOWN, 1)
    up = look_at((0, 0, 1), (0, 0.1, 9))
    picture = render_all(scene.camera(up if what == "looks away" else at(0, 0, 1), 0.5))["Combined"][..., :3]
    assert np.all(picture == (0.5 if what == "sky alone" else 0))


# ---------------------------------------------------------------- long runs


@pytest.mark.slow
def test_long_run_keeps_improving_in_constant_memory():
    """2000 iterations: the error against a render of another seed falls to the end, and memory is that of the 100th iteration."""
    settings = dict(iterations=8000, photons_per_iteration=3000)
    reference = finished(room(24), seed=99, **settings)[1][..., :3]
    errors, memory, resident = {}, {}, {}
    shorter = native.Settings(**{**settings, "iterations": 2000})
    with native.Scene(room(24).desc) as built, native.Session(built, shorter) as session:
        for iteration in range(1, 2001):
            session.step()
            if iteration in (100, 500, 2000):
                # Without the few brightest: glints of the lamp in the ball that no run of this length meets often.
                squares = np.sort(((session.read_pass("Combined")[..., :3] - reference) ** 2).mean(-1), axis=None)
                errors[iteration] = np.sqrt(squares[:-8].mean())
                memory[iteration], resident[iteration] = session.progress().memory_bytes, resident_bytes()
        assert session.progress().dropped_samples == 0
    print({n: f"{e:.3g}" for n, e in errors.items()}, memory, resident)
    assert errors[100] > 1.2 * errors[500] > 1.2**2 * errors[2000]
    assert abs(memory[2000] / memory[100] - 1) < 0.01 and abs(resident[2000] / resident[100] - 1) < 0.01
