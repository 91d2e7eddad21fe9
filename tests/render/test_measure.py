"""What the speed benchmark says of pictures and of curves, where the answer is known."""

import measure
import numpy as np
import pytest
from measure import Reference, caustic_mask, squared_errors
from results import Point, curve, error_at, time_to

SIZE = 200


def noisy(picture, deviation, seed):
    return picture + np.random.default_rng(seed).normal(0, deviation, picture.shape)


@pytest.fixture
def truth():
    return np.full((SIZE, SIZE, 3), 0.5)


def reference_of(truth, deviation, caustic=None):
    """Halves with independent noise."""
    halves = noisy(truth, deviation, 1), noisy(truth, deviation, 2)
    return Reference(halves, np.zeros((SIZE, SIZE), bool) if caustic is None else caustic)


def test_noise_of_the_reference_is_its_variance(truth):
    """Two halves of deviation 0.02 have a mean of variance 0.0002; 2 % is four standard errors of 120,000 samples."""
    noise = reference_of(truth, 0.02).noise().mean()
    assert noise == pytest.approx(0.0002 / (0.25 * 1.01), rel=0.02)


def test_noise_of_the_reference_is_subtracted(truth):
    """The picture's own noise is a tenth of the reference's, and still found."""
    error = squared_errors(noisy(truth, 0.005, 3), reference_of(truth, 0.02))["relmse_all"]
    assert error == pytest.approx(0.005**2 / (0.25 * 1.01), rel=0.15)


def test_regions_have_their_own_errors(truth):
    caustic = np.zeros((SIZE, SIZE), bool)
    caustic[:50] = True
    picture = truth.copy()
    picture[caustic] += 0.05
    errors = squared_errors(picture, reference_of(truth, 0.0, caustic))
    inside = 0.05**2 / (0.25 * 1.01)
    assert errors["relmse_in"] == pytest.approx(inside)
    assert errors["relmse_out"] == 0
    assert errors["relmse_all"] == pytest.approx(inside / 4)


def test_a_firefly_is_trimmed(truth):
    picture = truth.copy()
    picture[20, 30] = 50.0
    errors = squared_errors(picture, reference_of(truth, 0.0))
    assert errors["relmse_trimmed_all"] == 0 < errors["relmse_all"]


def test_a_region_without_pixels_says_nothing(truth):
    errors = squared_errors(truth, reference_of(truth, 0.0))
    assert np.isnan(errors["relmse_in"]) and np.isnan(errors["relmse_trimmed_in"])
    assert all(f"{metric}_{region}" in measure.COLUMNS for metric in ("relmse", "flip") for region in measure.REGIONS)


def test_caustics_are_where_they_give_a_fifth_of_the_light(truth):
    caustics = np.zeros_like(truth)
    caustics[:, :80] = 0.3 * truth[:, :80]
    caustics[:, 80:] = 0.1 * truth[:, 80:]
    mask = caustic_mask(truth, caustics)
    assert mask[:, :79].all()
    assert not mask[:, 81:].any()


def test_nothing_is_caustic_in_the_dark(truth):
    assert not caustic_mask(0 * truth, 0 * truth).any()


# ---------------------------------------------------------------- curves


def points(*pairs):
    return [Point(budget=t, seconds=t, error=e, low=e, high=e) for t, e in pairs]


def test_a_curve_is_the_median_of_the_repeats():
    one = {"scene": "a", "variant": "x", "budget": 5.0}
    rows = [{**one, "wall": wall, "relmse": error} for wall, error in ((5.1, 3.0), (5.3, 1.0), (5.2, 9.0))]
    rows += [{**rows[0], "variant": "y"}, {**rows[0], "scene": "b"}, {**rows[0], "budget": 9.0, "relmse": float("nan")}]
    assert curve(rows, "a", "x", "relmse") == [Point(5.0, 5.2, 3.0, 1.0, 9.0)]


def test_time_to_an_error_between_points_follows_the_power_law():
    """Error 8 / t."""
    assert time_to(points((1, 8), (4, 2), (16, 0.5)), 1.0) == (pytest.approx(8.0), "")


def test_time_to_an_error_beyond_the_ends_is_a_bound():
    line = points((1, 8), (4, 2))
    assert time_to(line, 10.0) == (1, "<")
    assert time_to(line, 1.0) == (4, ">")
    assert time_to(points((1, 8), (4, -0.1)), 1.0) == (4, "")


def test_error_at_a_time_goes_on_as_the_last_piece():
    line = points((1, 8), (4, 2))
    assert [error_at(line, t) for t in (0.5, 2, 16)] == pytest.approx([16, 4, 0.5])
    assert error_at(points((1, 8), (4, -0.1)), 2) is None
