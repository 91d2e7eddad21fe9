"""Light that leaks is what geometry says of a disk that knows no edges, and no more; what does not contribute does not count."""

import leaks
import numpy as np
import pytest
from leaks import beyond


@pytest.mark.parametrize("thickness", [0.0, 0.25, 0.5])
def test_leak_beside_a_thin_wall(thickness):
    """The share of the kernel that reaches the lit floor on the other side.

    The lit floor is darker close to the wall than where it is looked at for comparison: up to 15 %. Noise is 1 %.
    """
    distance, share = leaks.through_wall(thickness)
    np.testing.assert_allclose(share, beyond(distance + thickness), rtol=0.15, atol=0.01)
    pixel = distance[1] - distance[0]
    assert not share[distance + thickness > 1 + pixel].any()


def test_no_leak_beside_a_wall_of_one_radius():
    assert not leaks.through_wall(1.0)[1].any()


def test_a_leak_shrinks_with_the_radius():
    """Averaged over the first radius, with the rule by which all radii shrink alike."""
    settings = dict(reach=1.0, seeds=2, photons_per_iteration=20_000, radius_rule="PASS_INDEXED")
    first, later = (leaks.through_wall(0.1, iterations=n, **settings)[1].mean() for n in (1, 64))
    assert later < 0.8 * first


@pytest.mark.parametrize("thickness", [0.0, 0.1])
def test_nothing_comes_through_the_wall_itself(thickness):
    """However thin: photons on its other face have the other side, and none is counted, for a count would shrink the radius."""
    indirect, photons = leaks.dark_face(thickness)
    assert not indirect.any()
    assert not photons.any()


def test_darkness_in_corners():
    """A kernel that reaches past an edge finds nothing there: photons on the wall have another normal."""
    distance, share = leaks.in_corner()
    np.testing.assert_allclose(share, 1 - beyond(distance), atol=0.04)  # noise: 1 %
    assert share[distance > 1].mean() == pytest.approx(1, abs=0.02)
