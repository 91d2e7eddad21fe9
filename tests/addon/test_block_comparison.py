"""The oracle is tested as well: how often it cries wolf, and what it sees."""

import block_comparison
import numpy as np
import pytest

SEEDS, SIZE = 8, 32


def pictures(chance, noise=0.3, mean=1.0):
    """(SEEDS, SIZE, SIZE, 3) of independent pixels, skewed as light is."""
    shape = 1 / noise**2
    return mean * chance.gamma(shape, 1 / shape, (SEEDS, SIZE, SIZE, 3))


@pytest.mark.parametrize("freedom, t, tail", [(7.0, 2.3646, 0.05), (14.0, 4.1405, 0.001), (1.0, 1.0, 0.5), (1e4, 3.2905, 0.001)])
def test_tail_is_that_of_the_tables(freedom, t, tail):
    found = block_comparison.student_tail(np.array([t]), np.array([freedom]))
    assert found == pytest.approx([tail], rel=2e-3)


def test_false_alarms_are_as_rare_as_stated():
    """In 100 comparisons of equals, 1 % each: five or more alarms would come once in 300 runs, but these are always the same."""
    chance = np.random.default_rng(1)
    alarms = 0
    for _ in range(100):
        found = block_comparison.compare(pictures(chance), pictures(chance))
        alarms += np.abs(found.z).max() > found.limit
    assert alarms <= 4


def test_a_block_that_is_off_is_seen():
    """By 12 standard errors, in one of 64 blocks: the mean of the picture would not show it."""
    chance = np.random.default_rng(2)
    ours, theirs = pictures(chance), pictures(chance)
    ours[:, 8:12, 4:8] *= 1 + 12 * 0.3 / 4 / np.sqrt(SEEDS / 2)
    found = block_comparison.compare(ours, theirs)
    assert found.ratio == pytest.approx(1, abs=0.01)
    assert np.argwhere(np.abs(found.z) > found.limit)[:, :2].tolist() == [[2, 1]] * 3


def test_the_allowance_is_not_counted_and_more_is():
    chance = np.random.default_rng(3)
    ours, theirs = pictures(chance, noise=0.01, mean=1.01), pictures(chance, noise=0.01)
    assert np.abs(block_comparison.compare(ours, theirs, allowance=0.02).z).max() == 0
    assert np.median(np.abs(block_comparison.compare(ours, theirs, allowance=0.002).z)) > 3


def test_pictures_without_noise():
    """Equal ones agree, others do not; nothing is divided by zero."""
    black, grey = np.zeros((2, 16, 16, 3)), np.full((2, 16, 16, 3), 0.5)
    assert (block_comparison.compare(grey, grey).z == 0).all()
    assert (block_comparison.compare(grey, black).z > 7).all()
