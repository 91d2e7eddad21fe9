"""Caustics with closed forms: a burning glass, and the cusps of curved mirrors."""

import pytest
from caustic_forms import (APERTURE, IOR, RADIUS, cardioid, flux_in_focus, flux_in_narrow_focus, focal_length, halfway_to_focus,
                           image_of_the_sun, nephroid)
from scenes import check, fresnel


def test_flux_in_the_focus_of_a_lens():
    """Ghosts, thrown back and forth in the lens, a share R^2 in all, miss the window or not."""
    check(*flux_in_focus(), bias=2 * fresnel(1, IOR) ** 2)


def test_flux_in_a_focus_narrower_than_the_radius():
    """The sum over pixels of different radii is a little too large there; see `flux_in_narrow_focus`."""
    found, expected = flux_in_narrow_focus()
    assert 0.99 < found.mean() / expected < 1.03


def test_a_lens_halfway_to_its_focus_gathers_four_times_the_light():
    """Ghosts come on top. Rays at a height h meet the axis 5/3 h^2 / f before the focus; h is at most 0.028, which adds 1 %."""
    check(*halfway_to_focus(), bias=fresnel(1, IOR) ** 2 + 0.01)


def test_the_image_of_the_sun_is_as_bright_as_the_aperture_is_wide():
    """Its radius of f tan(angle / 2) = 0.025 is wide enough for the window and the lens's aberration of 0.003.

    That the lens bends by tangents and not by sines is an error of (APERTURE / f)^2 / 2.
    """
    check(*image_of_the_sun(), bias=(APERTURE / focal_length()[0]) ** 2 / 2)


@pytest.mark.parametrize("curve", [nephroid, cardioid], ids=lambda curve: curve.__name__)
def test_cusps_of_a_round_mirror(curve):
    """The nephroid's at half the radius, the cardioid's at a third; the strip that is looked at is not infinitely narrow."""
    (cusps, place), (irradiance, one) = curve()
    check(cusps, place, precision=0.01 * RADIUS / place, bias=0.005 * RADIUS / place)
    check(irradiance, one, bias=0.01)
