"""Scenes from 10 cm to 1 km, near and far: the first radius that comes by itself serves each about as well as any."""

import pytest
from framings import FRAMINGS, quality


@pytest.mark.parametrize("framing", FRAMINGS)
def test_no_first_radius_is_much_better_than_the_automatic_one(framing):
    """relMSE at most twice that of the best of five fixed radii, a quarter to four times as large."""
    found = quality(FRAMINGS[framing]())
    assert found.picture < 2 * found.best


@pytest.mark.parametrize("framing", FRAMINGS)
def test_first_radius_is_a_few_pixels(framing):
    assert 2 < quality(FRAMINGS[framing](), reference=1, seeds=1, factors=(1,)).radius < 6
