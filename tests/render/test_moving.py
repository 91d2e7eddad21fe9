"""A built scene whose instances, lamps and camera are moved, through `native`: what a live view and motion blur rest on."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import Scene, at, box, diffuse, glass, look_at, sphere
from sppm import native
from sppm.scene_desc import LightType


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
        with pytest.raises(native.SppmError, match="instance 1 .*movable"):
            built.move_instance(1, at(0, 0, 0))
