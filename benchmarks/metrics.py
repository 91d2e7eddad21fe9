"""How far a picture is from a reference. Pictures are (height, width, channels) linear radiance, without alpha."""

import numpy as np

WORST = 0.001  # share of the pixels that a trimmed mean leaves out: a few fireflies say nothing about all others


def scale_of(reference):
    """(height, width, channels) of b^2 averaged over 3x3 pixels, plus 0.01 mean(b)^2, mean(b) of the whole: squared errors are
    divided by it.

    b^2 of the pixel alone would weigh errors most where noise has made b too small; the square of the average would weigh them by up
    to 81 where a single pixel is bright.

    Raises:
        ValueError: the reference is black or not finite.
    """
    b = np.asarray(reference, np.float64)
    mean = b.mean()
    if not mean > 0 or not np.isfinite(mean):
        raise ValueError(f"the reference has the mean {mean}")
    return smoothed(b**2) + 0.01 * mean**2


def relative_products(pictures, references):
    """(height, width) of (first picture - first reference) (second picture - second reference) over the scale of both references'
    mean, averaged over the channels.

    Raises:
        ValueError: the shapes differ, or the references are black or not finite.
    """
    a, b = np.asarray(pictures, np.float64), np.asarray(references, np.float64)
    if a.shape != b.shape or a.ndim != 4:
        raise ValueError(f"pictures of shapes {a.shape[1:]} and {b.shape[1:]}")
    return (np.prod(a - b, axis=0) / scale_of(b.mean(0))).mean(-1)


def smoothed(picture):
    """Mean over 3x3 pixels; beyond the border it goes on as it ends. (height, width) or (height, width, channels)."""
    height, width = picture.shape[:2]
    padded = np.pad(picture, [(1, 1), (1, 1)] + [(0, 0)] * (picture.ndim - 2), mode="edge")
    return sum(padded[y : y + height, x : x + width] for y in range(3) for x in range(3)) / 9


def relmse(picture, reference, mask=None, worst=0.0):
    """Mean squared relative error over the pixels of `mask` (height, width), without the share `worst` of the largest."""
    errors = relative_products((picture, picture), (reference, reference))
    errors = errors[mask] if mask is not None else errors.ravel()
    if not len(errors):
        raise ValueError("the mask leaves no pixel")
    return errors[without_worst(errors, worst)].mean()


def without_worst(errors, worst=WORST):
    """Indices of the errors, (n,), that remain without the share `worst` of the largest, whatever their sign; smallest first."""
    return np.argsort(np.abs(errors), kind="stable")[: len(errors) - int(worst * len(errors))]


def trimmed_relmse(picture, reference, mask=None):
    """`relmse` without the worst 0.1 % of the pixels."""
    return relmse(picture, reference, mask, WORST)


def rmse(picture, reference, mask=None):
    """Root of the mean squared difference over the pixels of `mask`, in the unit of the pictures."""
    squares = ((np.asarray(picture, np.float64) - reference) ** 2).mean(-1)
    return np.sqrt((squares[mask] if mask is not None else squares).mean())


def slope(amounts, errors):
    """Exponent of the power law that fits errors against amounts (of photons, of seconds) best in logarithms."""
    return np.polyfit(np.log(amounts), np.log(errors), 1)[0]
