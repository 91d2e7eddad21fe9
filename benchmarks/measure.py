"""What the speed benchmark says of a picture: errors of the whole, inside and outside caustics."""

from dataclasses import dataclass

import numpy as np
from metrics import relative_products, smoothed, uncertainty, without_worst

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

    def products(self, first, second):
        """Products of two pictures' differences from the halves, (height, width), over the squared brightness.

        Noise of one half is independent of the other's. In the mean, this is so the square of what both pictures share beyond the
        truth, with no noise of the reference in it; a single one may be of either sign. The brightness is the mean over 3x3 pixels: by a
        pixel's own, errors would weigh most where noise has made it too small.
        """
        return relative_products((first, second), self.halves, smoothed(self.picture))

    def noise(self):
        """Variance of `picture` in each pixel, (height, width), relative as errors are. It is between the halves: hence the sign."""
        return -self.products(self.picture, self.picture)

    def least_error(self, inside):
        """The `uncertainty` of what `squared_errors` says of a perfect picture without its worst pixels, in the region `inside`.

        That would be the mean of products of both halves' noises. The products of the halves' difference in one pixel and in the next
        spread alike: they are as independent, and the variance of the difference is twice that of a half.
        """
        beside = [np.roll(half, 1, axis=1) for half in self.halves]
        products = relative_products((self.halves[0], beside[0]), (self.halves[1], beside[1]), smoothed(self.picture))[inside] / 2
        return uncertainty(products[without_worst(products)])


def caustic_mask(combined, caustics, share=0.2):
    """Where caustics give at least `share` of the light, (height, width) bool.

    Args:
        combined, caustics: (height, width, 3); both are averaged over 3x3 pixels first, so that noise does not speckle the mask.
    """
    light, caustic = smoothed(combined @ _LUMINANCE), smoothed(caustics @ _LUMINANCE)
    return (caustic > 0) & (caustic >= share * light)


def measure(picture, reference):
    """`COLUMNS` of a picture, (height, width, 3); NaN for a region without pixels."""
    return {**squared_errors(picture, reference), **_flips(picture, reference)}


def squared_errors(picture, reference):
    """relMSE with and without the worst 0.1 % of each region's pixels.

    The expectation is the error against the true picture. What is less than `Reference.least_error` may be noise, and negative.

    The worst are the largest products of either sign: of the squares of the differences from the mean of the halves those would be
    left out in which the reference is far off, and the mean of the others would be too small.
    """
    errors = reference.products(picture, picture)
    values = {}
    for region in REGIONS:
        inside = errors[reference.region(region)]
        values[f"relmse_{region}"] = mean(inside)
        values[f"relmse_trimmed_{region}"] = mean(inside[without_worst(inside)])
    return values


def _flips(picture, reference):
    """Mean HDR FLIP of each region, 0 to 1."""
    import flip_evaluator  # only the benchmarks' own environment has it

    pictures = [np.ascontiguousarray(np.maximum(array, 0.0), np.float32) for array in (reference.picture, picture)]
    flip = flip_evaluator.evaluate(*pictures, "HDR", applyMagma=False, computeMeanError=False)[0][..., 0]
    return {f"flip_{region}": mean(flip[reference.region(region)]) for region in REGIONS}


def mean(values):
    """NaN where there are none."""
    return float(values.mean()) if len(values) else float("nan")
