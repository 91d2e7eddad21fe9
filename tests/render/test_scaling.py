"""The benchmark of how cost grows: its tables where the answer is known, and its scenes."""

import numpy as np
import pytest
import scaling
import scaling_scenes
from scenes import furnished_room
from sppm import native


def cells(line):
    return [cell.strip() for cell in line.strip("|").split("|")]


def test_cost_that_grows_with_the_square_is_told():
    lines = list(scaling.linear_table(("picture", "bytes"), "pixel", [("small", 1e6, 2.0, 7), ("large", 4e6, 32.0, 9)]))
    assert cells(lines[1]) == ["picture", "pixels", "CPU s", "ns a pixel", "times the least", "bytes"]
    assert cells(lines[3]) == ["small", "1,000,000", "2", "2000", "1.00", "7"]
    assert cells(lines[4]) == ["large", "4,000,000", "32", "8000", "4.00", "9"]


class Step:
    """A session that takes so many seconds an iteration, by a clock of its own."""

    now = 0.0

    def __init__(self, *seconds):
        self.seconds = list(seconds)

    def step(self):
        Step.now += self.seconds.pop(0)


def test_what_runs_in_turns_has_its_own_times_without_the_first():
    times = scaling.in_turns([Step(9, 1, 2, 3), Step(8, 2, 4, 9)], 3, lambda: Step.now)
    assert times == [[1, 2, 3], [2, 4, 9]]
    assert scaling.median_ratio(times[1], times[0]) == 2


@pytest.fixture(scope="module")
def room():
    return scaling_scenes.at_size(furnished_room().desc, 24)


def test_another_size_is_the_same_view(room):
    with native.Scene(room) as scene:
        assert scene.size == (24, 24)


@pytest.mark.parametrize("seeds", [1, 3])
def test_of_an_iteration_only_the_second_counts(room, seeds):
    """It sends the photons of one iteration, and a session remembers its pixels at least."""
    told = scaling.second_iteration(room, seeds, photons_per_iteration=5000)
    assert 0 < told["stored"] and 4990 <= told["sent"] <= 5000
    assert told["bytes"] > 136 * 24**2
    assert told["seconds"] > 0


def test_white_textures_change_nothing_but_the_work(room):
    changed = scaling_scenes.textured(room)
    pictures = []
    for desc, textures in ((room, 0), (scaling_scenes.with_uvs(room), 0), (changed, 1)):
        with native.Scene(desc) as scene, native.Session(scene, native.Settings(iterations=2)) as session:
            assert scene.info()["has_textures"] == textures
            session.step()
            pictures.append(session.read_pass("Combined"))
    assert pictures[0].mean() > 0
    assert np.array_equal(pictures[1], pictures[0])
    assert np.array_equal(pictures[2], pictures[0])


def test_a_large_mesh_is_one_however_many_instances_there_are():
    desc = scaling_scenes.large(10_000, 5)
    with native.Scene(desc) as scene:
        info = scene.info()
    assert len(desc.meshes[0].indices) == 10_000
    assert info["instance_count"] == 5
    corners = desc.meshes[0].positions[desc.meshes[0].indices].astype(float)
    areas = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert areas[:, 2].min() > 0  # all face up
    assert areas[:, 2].sum() == pytest.approx(4, rel=1e-5)
    assert len({tuple(instance.transform[:, 3]) for instance in desc.instances}) == 5
