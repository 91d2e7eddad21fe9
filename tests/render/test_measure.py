"""What the speed benchmark says of pictures and of curves, where the answer is known."""

import consistency
import measure
import numpy as np
import pytest
from measure import Reference, caustic_mask, squared_errors
from reference import compare, judge
from results import Point, curve, error_at, time_to
from scenes import furnished_room
from variants import REFERENCE

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


def test_noise_of_the_reference_is_in_no_error(truth):
    """The picture's own variance is an eighth of that of the reference, and still found."""
    error = squared_errors(noisy(truth, 0.005, 3), reference_of(truth, 0.02))
    assert error["relmse_all"] == pytest.approx(0.005**2 / (0.25 * 1.01), rel=0.15)
    assert error["relmse_trimmed_all"] == pytest.approx(0.005**2 / (0.25 * 1.01), rel=0.15)


def test_large_noise_of_the_reference_is_not_in_the_denominator(truth):
    """Halves that are off by half of what they show: divided by a pixel's own b^2 the error would be several times as large."""
    reference = reference_of(truth, 0.25)
    error = np.mean([squared_errors(share * truth, reference)["relmse_all"] for share in (0.7, 1.3)])
    assert error == pytest.approx(0.3**2 / 1.01, rel=0.15)


def test_a_perfect_picture_has_no_error_beside_glints_of_the_reference(truth):
    """A two-hundredth of the pixels has ten times the noise. What `least_error` says is how far the error is off zero, by two."""
    off, least = [], []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        strength = 0.02 * np.where(rng.random((2, SIZE, SIZE, 1)) < 0.005, 10, 1)
        reference = Reference(tuple(truth + strength * rng.normal(0, 1, (2, *truth.shape))), np.zeros((SIZE, SIZE), bool))
        off.append(squared_errors(truth, reference)["relmse_trimmed_all"])
        least.append(reference.least_error(reference.region("all")))
    assert np.sqrt(np.mean(np.square(off))) == pytest.approx(np.mean(least) / 2, rel=0.3)
    assert abs(np.mean(off)) < 3 * np.std(off) / np.sqrt(len(off))


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
    assert np.isnan(reference_of(truth, 0.0).least_error(np.zeros((SIZE, SIZE), bool)))
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


# ---------------------------------------------------------------- references


def pictures(truth, bias, noise):
    """Halves that are too bright by `bias`, and a coarse pair whose radius is twice as large."""
    fine, coarse = ([noisy(truth + off, noise, seed) for seed in seeds] for off, seeds in ((bias, (1, 2)), (4 * bias, (3, 4))))
    return {"combined": np.stack(fine), "coarse": np.stack(coarse), "caustics": 0 * np.stack(fine), "iterations": np.array((5, 6))}


def test_bias_is_told_though_noise_is_larger(truth):
    told = judge(pictures(truth, 0.01, 0.03))[1]
    assert told["bias_all"] == pytest.approx(0.01**2 / (0.51**2 * 1.01), rel=0.1)
    assert told["bias_uncertainty_all"] < 0.1 * told["bias_all"] < 0.1 * told["noise_all"]
    assert told["iterations"] == 11 and told["caustic_share"] == 0 and np.isnan(told["noise_in"])


def test_a_glint_is_not_told_as_bias(truth):
    glinting = pictures(truth, 0.0, 0.0)
    glinting["coarse"][:, 20, 30] = 50.0
    assert judge(glinting)[1]["bias_all"] == 0


def test_radius_of_a_reference_does_not_shrink():
    radius = consistency.render(furnished_room().desc, 20, 1, "Radius", initial_radius=0.01, photons_per_iteration=1, **REFERENCE)[0]
    assert radius[radius > 0] == pytest.approx(0.01, rel=1e-6)


def test_two_renderers_are_compared_without_noise(truth):
    """Each picture has a noise of nine times what the renderers do not agree on."""
    found = compare(reference_of(truth, 0.03), noisy(1.02 * truth, 0.03, 3), noisy(1.02 * truth, 0.03, 4))
    assert found == pytest.approx(0.02**2 / 1.01, rel=0.2)


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
