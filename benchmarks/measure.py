"""What the speed benchmark says of a picture: errors of the whole, inside and outside caustics, less the reference's noise."""

from dataclasses import dataclass

import numpy as np
from metrics import squared_relative_errors, without_worst

WHERE = {"all": "whole picture", "in": "inside caustics", "out": "outside caustics"}
REGIONS = tuple(WHERE)
METRICS = ("relmse", "relmse_trimmed", "flip")
COLUMNS = [f"{metric}_{region}" for region in REGIONS for metric in METRICS]

_LUMINANCE = np.array((0.2126, 0.7152, 0.0722))


@dataclass(frozen=True)
class Reference:
    """Two independent halves of a converged picture, (height, width, 3), and where its caustics are, (height, width) bool."""

    halves: tuple
    caustic: np.ndarray

    @property
    def picture(self):
        return (self.halves[0] + self.halves[1]) / 2

    def region(self, name):
        return {"all": np.ones_like(self.caustic), "in": self.caustic, "out": ~self.caustic}[name]

    def noise(self):
        """Variance of `picture` in each pixel, relative as errors are: half - mean is an error of the mean's own size."""
        return squared_relative_errors(self.halves[0], self.picture)


def caustic_mask(combined, caustics, share=0.2):
    """Where caustics give at least `share` of the light, (height, width) bool.

    Args:
        combined, caustics: (height, width, 3); both are averaged over 3x3 pixels first, so that noise does not speckle the mask.
    """
    light, caustic = _blurred(combined @ _LUMINANCE), _blurred(caustics @ _LUMINANCE)
    return (caustic > 0) & (caustic >= share * light)


def _blurred(values):
    height, width = values.shape
    padded = np.pad(values, 1, mode="edge")
    return sum(padded[y : y + height, x : x + width] for y in range(3) for x in range(3)) / 9


def measure(picture, reference):
    """`COLUMNS` of a picture, (height, width, 3); NaN for a region without pixels."""
    return {**squared_errors(picture, reference), **_flips(picture, reference)}


def squared_errors(picture, reference):
    """relMSE with and without the worst 0.1 % of each region's pixels.

    The noise of the reference is subtracted: the expectation is the error against the true picture. What is left of a picture
    that is better than the reference may be negative.
    """
    errors, noise = squared_relative_errors(picture, reference.picture), reference.noise()
    values = {}
    for region in REGIONS:
        inside = reference.region(region)
        own, excess = errors[inside], (errors - noise)[inside]
        values[f"relmse_{region}"] = _mean(excess)
        values[f"relmse_trimmed_{region}"] = _mean(excess[without_worst(own)])
    return values


def _flips(picture, reference):
    """Mean HDR FLIP of each region, 0 to 1."""
    import flip_evaluator  # only the benchmarks' own environment has it

    pictures = [np.ascontiguousarray(np.maximum(array, 0.0), np.float32) for array in (reference.picture, picture)]
    flip = flip_evaluator.evaluate(*pictures, "HDR", applyMagma=False, computeMeanError=False)[0][..., 0]
    return {f"flip_{region}": _mean(flip[reference.region(region)]) for region in REGIONS}


def _mean(values):
    return float(values.mean()) if len(values) else float("nan")
