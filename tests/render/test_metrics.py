"""The figures by which pictures are judged, on pictures whose figures are known."""

import metrics
import numpy as np
import pytest

GREY = np.full((50, 40, 3), 0.5)


def test_identical_pictures_have_no_error():
    assert metrics.relmse(GREY, GREY) == metrics.trimmed_relmse(GREY, GREY) == metrics.rmse(GREY, GREY) == 0


def test_an_even_error():
    """10 % everywhere: 0.01 b^2 / (b^2 + 0.01 b^2)."""
    assert metrics.relmse(1.1 * GREY, GREY) == pytest.approx(0.01 / 1.01)
    assert metrics.rmse(1.1 * GREY, GREY) == pytest.approx(0.05)


def test_black_pixels_count_by_the_mean():
    reference = GREY.copy()
    reference[:25] = 0
    assert metrics.relmse(reference + 0.025, reference, reference[..., 0] == 0) == pytest.approx(0.025**2 / (0.01 * 0.25**2))


def test_products_of_differences_have_a_sign():
    found = metrics.relative_products((GREY + 0.1, GREY - 0.2), (GREY, GREY), 2 * GREY)
    assert found == pytest.approx(-0.02 / 1.01)


def test_smoothed_is_the_mean_of_nine():
    one = np.zeros((5, 6, 2))
    one[2, 3] = 9.0
    assert metrics.smoothed(one)[1:4, 2:5] == pytest.approx(1)
    assert metrics.smoothed(one).sum() == pytest.approx(one.sum())
    assert metrics.smoothed(GREY[..., 0]) == pytest.approx(GREY[..., 0])


def test_the_worst_are_left_out_whatever_their_sign():
    assert set(metrics.without_worst(np.array([1, -9, 2, 8, -3]), 0.4)) == {0, 2, 4}


def test_the_worst_thousandth_is_left_out():
    """2000 pixels: two fireflies are, a third is not."""
    picture = GREY.copy()
    picture[[3, 7], [8, 20]] = 100
    assert metrics.trimmed_relmse(picture, GREY) == 0 < metrics.relmse(picture, GREY)
    picture[30, 30] = 100
    assert metrics.trimmed_relmse(picture, GREY) > 1


def test_mask():
    picture, left = GREY.copy(), np.zeros(GREY.shape[:2], bool)
    left[:, :20] = True
    picture[:, :20] += 0.1
    assert metrics.rmse(picture, GREY, left) == pytest.approx(0.1)
    assert metrics.rmse(picture, GREY, ~left) == 0
    with pytest.raises(ValueError, match="no pixel"):
        metrics.relmse(picture, GREY, left & ~left)


@pytest.mark.parametrize("reference", [np.zeros((4, 4, 3)), np.full((4, 4, 3), np.nan), np.ones((4, 5, 3))])
def test_references_that_say_nothing_are_refused(reference):
    with pytest.raises(ValueError, match="picture|mean"):
        metrics.relmse(np.ones((4, 4, 3)), reference)


def test_slope_of_a_power_law():
    assert metrics.slope([1, 4, 16], [3, 1.5, 0.75]) == pytest.approx(-0.5)
