"""How far a picture is from a reference. Pictures are (height, width, channels) linear radiance, without alpha."""

import numpy as np

WORST = 0.001  # share of the pixels that a trimmed mean leaves out: a few fireflies say nothing about all others


def squared_relative_errors(picture, reference):
    """(height, width) of (a - b)^2 / (b^2 + 0.01 mean(b)^2), averaged over the channels; the mean is the whole reference's.

    Raises:
        ValueError: the shapes differ, or the reference is black or not finite.
    """
    return relative_products((picture, picture), (reference, reference), reference)


def relative_products(pictures, references, brightness):
    """(height, width) of (a - b) (a' - b') / (c^2 + 0.01 mean(c)^2), averaged over the channels.

    Args:
        pictures, references: a and a', b and b'.
        brightness: c.

    Raises:
        ValueError: the shapes differ, or the brightness is black or not finite.
    """
    a, b, c = (np.asarray(p, np.float64) for p in (pictures, references, brightness))
    if a.shape != b.shape or a.ndim != 4:
        raise ValueError(f"pictures of shapes {a.shape[1:]} and {b.shape[1:]}")
    mean = c.mean()
    if not mean > 0 or not np.isfinite(mean):
        raise ValueError(f"the reference has the mean {mean}")
    return (np.prod(a - b, axis=0) / (c**2 + 0.01 * mean**2)).mean(-1)


def smoothed(picture):
    """Mean over 3x3 pixels; beyond the border it goes on as it ends. (height, width) or (height, width, channels)."""
    height, width = picture.shape[:2]
    padded = np.pad(picture, [(1, 1), (1, 1)] + [(0, 0)] * (picture.ndim - 2), mode="edge")
    return sum(padded[y : y + height, x : x + width] for y in range(3) for x in range(3)) / 9


def relmse(picture, reference, mask=None, worst=0.0):
    """Mean squared relative error over the pixels of `mask` (height, width), without the share `worst` of the largest."""
    errors = squared_relative_errors(picture, reference)
    errors = errors[mask] if mask is not None else errors.ravel()
    if not len(errors):
        raise ValueError("the mask leaves no pixel")
    return errors[without_worst(errors, worst)].mean()


def without_worst(errors, worst=WORST):
    """Indices of the errors, (n,), that remain without the share `worst` of the largest, whatever their sign; smallest first."""
    return np.argsort(np.abs(errors), kind="stable")[: len(errors) - int(worst * len(errors))]


def uncertainty(products):
    """Two standard errors of the mean of independent products, (n,), that are zero in the mean or little beside their spread."""
    return 2 * float(np.sqrt((products**2).mean() / len(products))) if len(products) else float("nan")


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
