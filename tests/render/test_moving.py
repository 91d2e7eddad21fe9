"""A built scene whose instances, lamps and camera are moved, through `native`: what a live view and motion blur rest on."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import Scene, at, box, diffuse, floor, glass, look_at, render, sphere, student_limit
from sppm import native
from sppm.native_library import SppmError
from sppm.scene_desc import LightType
from sppm.scene_validation import SceneError


def room(glass_at, lamp_at, camera_at):
    """A ball of glass that may move in a room, a lamp."""
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(0.6)).add(sphere(0.35, divisions=3), glass())
    scene.desc.instances[1] = replace(scene.desc.instances[1], transform=at(*glass_at), movable=True)
    scene.light(LightType.RECTANGLE, at(*lamp_at), 3, size_x=0.4, size_y=0.4)
    return scene.camera(look_at(camera_at, (0, 0.4, -0.4)), 0.8, 16).desc


def picture(built):
    with native.Session(built, native.Settings(iterations=2, photons_per_iteration=5000)) as session:
        for _ in range(2):
            session.step()
        return session.read_pass("Combined")


def test_moved_is_as_built_there():
    there = room((-0.3, 0.4, -0.2), (0.3, 0.2, 0.9), (0.2, -0.9, 0.3))
    with native.Scene(there) as other:
        expected = picture(other)
    with native.Scene(room((0.1, 0.2, -0.5), (0, 0, 0.95), (0, -0.95, 0.1))) as built:
        assert not np.array_equal(picture(built), expected)
        built.move_instance(2, there.instances[1].transform)
        built.set_light(1, there.lights[0])
        built.set_camera(there.camera)
        built.update()
        assert np.array_equal(picture(built), expected)


def test_what_may_not_move_is_refused_by_its_number():
    with native.Scene(room((0, 0, 0), (0, 0, 0.9), (0, -0.9, 0))) as built:
        with pytest.raises(SppmError, match="instance 1 .*movable"):
            built.move_instance(1, at(0, 0, 0))


@pytest.mark.parametrize(("place", "says"), [(np.eye(3), "has 9 numbers, must have 12"), (np.eye(4), "has 16 numbers"),
                                             (at(0, 0, np.nan), "is not finite")], ids=["3x3", "4x4", "nan"])
def test_what_is_no_place_is_refused_by_the_instance(place, says):
    with native.Scene(room((0, 0, 0), (0, 0, 0.9), (0, -0.9, 0))) as built:
        with pytest.raises(SceneError, match=f"instance 2: transform .*{says}"):
            built.move_instance(2, place)

WAY = np.array([at(-0.3, 0, 0.5), at(0.3, 0, 0.5)])  # of the ball
ITERATIONS, SEEDS, STILLS, BLOCKS = 32, 8, 8, 4


def ball_over_floor(places):
    """A ball of glass that throws the light of a small lamp on a floor; it stands still if all its places are one."""
    scene = Scene().add(floor(2), diffuse(0.7)).add(sphere(0.3, divisions=3), glass())
    motion = places if len(places) > 1 else None
    scene.desc.instances[1] = replace(scene.desc.instances[1], transform=places[0], motion=motion)
    scene.light(LightType.POINT, at(0.2, 0.1, 3), 5, radius=0.2)
    return scene.camera(look_at((0, -1.8, 1.5), (0, 0, 0.1)), 0.5, 16)


def caustic_blocks(places, seed, **settings):
    """Means of parts of the Caustics pass."""
    picture = render(ball_over_floor(places), "Caustics", iterations=ITERATIONS, seed=seed, photons_per_iteration=4000,
                     indirect="PATHS", **settings)
    part = picture.shape[0] // BLOCKS
    return picture.mean(2).reshape(BLOCKS, part, BLOCKS, part).mean((1, 3))


@pytest.mark.slow
@pytest.mark.parametrize("rule", ("PASS_INDEXED", "PROGRESSIVE", "DENSITY"))
def test_the_caustic_of_a_moving_ball_is_the_mean_of_those_on_its_way(rule):
    """Block by block where the radius does not depend on what was found, so that its bias is the same; else the light in all."""
    moving = np.array([caustic_blocks(WAY, seed, radius_rule=rule) for seed in range(SEEDS)])

    def mean_of_stills(seed):
        shares = (np.arange(STILLS) + (seed + 0.5) / SEEDS) / STILLS
        return np.mean([caustic_blocks([WAY[0] + (WAY[1] - WAY[0]) * share], 100 * seed + k, radius_rule=rule)
                        for k, share in enumerate(shares)], axis=0)

    stills = np.array([mean_of_stills(seed) for seed in range(SEEDS)])
    if rule != "PASS_INDEXED":
        moving, stills = moving.mean((1, 2), keepdims=True), stills.mean((1, 2), keepdims=True)
    error = np.sqrt((moving.var(0, ddof=1) + stills.var(0, ddof=1)) / SEEDS)
    assert error.max() < 0.05 * stills.mean(0).max(), "too noisy to test anything"
    assert (np.abs(moving.mean(0) - stills.mean(0)) < student_limit(error.size, SEEDS - 1) * error).all()


def test_a_moving_scene_is_the_same_for_any_number_of_threads():
    first, *others = (caustic_blocks(WAY, 1, threads=threads) for threads in (1, 2, 4))
    assert all(np.array_equal(first, other) for other in others)
