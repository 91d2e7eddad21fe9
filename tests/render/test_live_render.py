"""The thread that renders for a viewport, without Blender: what it shows, what it keeps, and that it stops."""

import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from scenes import Scene, at, diffuse, floor, glass, look_at, sphere
from sppm import live_render, native, scene_change
from sppm.live_render import Job, LiveRender
from sppm.scene_desc import LightType

SECONDS = 60  # until a test gives up; how quick it is on a quiet machine is told by tests/addon/test_live.py
SETTINGS = native.Settings(iterations=3, photons_per_iteration=4000, indirect="PATHS")


def scene(ball=(0.0, 0.0, 0.5), albedo=0.6):
    made = Scene().add(floor(2), diffuse(albedo)).add(sphere(0.4, divisions=3), glass())
    made.desc.instances[1] = replace(made.desc.instances[1], transform=at(*ball))
    return made.light(LightType.POINT, at(0.5, -0.3, 2), 3, radius=0.05).desc


ROOM = scene()


def camera(size=64, eye=(0, -3, 2)):
    return Scene().camera(look_at(eye, (0, 0, 0.3)), 0.4, size).desc.camera


def wait_for(condition):
    limit = time.monotonic() + SECONDS
    while not condition():
        assert time.monotonic() < limit, "it never came"
        time.sleep(0.001)


def job(desc=None, settings=SETTINGS, **view):
    return Job(desc or scene(), camera(**view), settings)


def rendered(wanted, movable=()):
    """The picture of a job by a session of its own; what is movable is not moved to world space, which would round otherwise."""
    instances = [replace(item, movable=i in movable) for i, item in enumerate(wanted.scene.instances)]
    desc = replace(wanted.scene, camera=wanted.camera, instances=instances)
    with native.Scene(desc) as built, native.Session(built, wanted.settings) as session:
        while not session.progress().finished:
            session.step()
        return session.read_pass("Combined")


@pytest.fixture
def live():
    live = LiveRender()
    yield live
    live.stop()
    live.wait()


def pictures_of(live, wanted):
    """Every picture that is seen until the job is done."""
    seen = []
    live.start(wanted)
    wait_for(lambda: collect(live, wanted, seen) and seen[-1].iteration == wanted.settings.iterations and not seen[-1].is_reduced)
    return seen


def collect(live, wanted, seen):
    if live.picture and live.picture.job is wanted and (not seen or seen[-1] is not live.picture):
        seen.append(live.picture)
    return bool(seen)


def test_reduced_comes_first_and_the_last_is_that_of_a_render(live):
    wanted = job()
    seen = pictures_of(live, wanted)
    assert seen[0].is_reduced and seen[0].pixels.shape == (16, 16, 4)
    assert [picture.is_reduced for picture in seen] == sorted((picture.is_reduced for picture in seen), reverse=True)
    assert np.array_equal(seen[-1].pixels, rendered(wanted))
    wait_for(lambda: not live.is_running)


def test_what_moved_is_as_rendered_there(live):
    """Twice: the first move builds the scene again so that the next ones need not."""
    for number, x in enumerate((0.0, 0.3, -0.4)):
        wanted = job(replace_ball(ROOM, x))
        assert np.array_equal(pictures_of(live, wanted)[-1].pixels, rendered(wanted, movable={1} if number else ()))


def replace_ball(desc, x):
    floor_, ball = desc.instances
    return replace(desc, instances=[floor_, replace(ball, transform=at(x, 0, 0.5))])


def test_moves_build_nothing_the_second_time(live, monkeypatch):
    built = []
    original = native.Scene.__init__
    monkeypatch.setattr(native.Scene, "__init__", lambda self, *args: built.append(1) or original(self, *args))
    for x in (0.0, 0.1, 0.2, 0.3):
        pictures_of(live, job(replace_ball(ROOM, x)))
    pictures_of(live, job(replace_ball(ROOM, 0.3), eye=(1, -3, 2)))
    assert len(built) == 2
    pictures_of(live, job(replace(ROOM, materials=scene(albedo=0.1).materials)))
    assert len(built) == 3


def test_newer_job_replaces_the_one_under_way(live):
    long = job(settings=replace(SETTINGS, iterations=1_000_000), size=512)
    live.start(long)
    wait_for(lambda: live.picture)
    newer = job(eye=(1, -3, 2))
    assert pictures_of(live, newer)[-1].job is newer


def test_a_picture_follows_however_fast_changes_come(live):
    """Each is asked for as soon as the one before was: none may be waited for, and yet some are shown."""
    shown, limit = set(), time.monotonic() + SECONDS
    while len(shown) < 3:
        assert time.monotonic() < limit
        live.start(job(ROOM, eye=(time.monotonic() - limit, -3, 2)))
        time.sleep(0.002)
        if live.picture:
            shown.add(live.picture.job)


def test_stop_ends_the_thread(live):
    live.start(job(settings=replace(SETTINGS, iterations=1_000_000), size=512))
    wait_for(lambda: live.picture and not live.picture.is_reduced)
    live.stop()
    live.wait()
    assert not live.is_running
    assert not [thread for thread in threading.enumerate() if thread.name == "sppm live"]


def test_failure_is_told_and_the_next_job_goes_on(live):
    bad = scene()
    bad.instances[1] = replace(bad.instances[1], mesh=7)
    live.start(job(bad))
    wait_for(lambda: live.error)
    assert "mesh = 7" in live.error
    pictures_of(live, job())
    assert live.error == ""


@pytest.mark.parametrize(("milliseconds", "expected"), [(50, 1), (150, 2), (900, 4), (5000, 8), (1e6, 8)])
def test_reduction_keeps_a_picture_quick(milliseconds, expected):
    """By how long a full iteration takes."""
    live, view = LiveRender(), camera(100)
    assert live._reduction(view) == 4, "nothing is known at first"
    live._seconds_per_pixel = 1e-3 * milliseconds / (view.width * view.height)
    assert live._reduction(view) == expected


def test_reduced_camera_sees_the_same():
    view = replace(camera(), width=101, height=7)
    small = live_render.reduced(view, 4)
    assert (small.width, small.height) == (26, 2)
    assert scene_change.equal(replace(small, width=101, height=7), view)


# ---------------------------------------------------------------- telling scenes apart


def test_unchanged_is_what_has_the_same_values():
    same = replace(ROOM, instances=[replace(item, transform=item.transform.copy()) for item in ROOM.instances])
    assert scene_change.is_unchanged(ROOM, same)
    assert not scene_change.is_unchanged(ROOM, replace_ball(ROOM, 0.7))


@pytest.mark.parametrize("change", [
    lambda s: replace(s, lights=[replace(s.lights[0], radius=0.1)]),
    lambda s: replace(s, lights=[]),
    lambda s: replace(s, materials=scene(albedo=0.1).materials),
    lambda s: replace(s, meshes=[replace(mesh) for mesh in s.meshes]),
    lambda s: replace(s, instances=s.instances[:1]),
    lambda s: replace(s, world=Scene(world=0.3).desc.world),
], ids=["lamp", "no lamp", "material", "mesh", "fewer", "world"])
def test_changes_are_seen(change):
    assert not scene_change.is_unchanged(ROOM, change(ROOM))
