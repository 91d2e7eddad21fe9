"""Whether two renderers agree, block of pixels by block, within their noise.

Each renders the picture with several seeds; the spread over the seeds says how sure the mean of a block is. Under the hypothesis
that both have the same expectation, Welch's t of a block follows Student's distribution, so each block and colour has a p-value,
and by Bonferroni's bound the chance that any of them falls below rate / count is at most the rate.
"""

from dataclasses import dataclass
from statistics import NormalDist

import blender_scene
import numpy as np

BLOCKS = 8
FALSE_ALARMS = 0.01  # of one comparison of two pictures, all its blocks and colours together


@dataclass(frozen=True)
class Comparison:
    """Of two sets of pictures. `z` (blocks, blocks, 3) is the normal deviate of the same p-value as the block's t."""

    ours: np.ndarray  # (blocks, blocks, 3) means
    theirs: np.ndarray
    error: np.ndarray  # standard error of their difference
    z: np.ndarray

    @property
    def limit(self):
        """The largest |z| that FALSE_ALARMS allows."""
        return NormalDist().inv_cdf(1 - FALSE_ALARMS / self.z.size / 2)

    @property
    def ratio(self):
        return self.ours.mean() / self.theirs.mean()

    @property
    def precision(self):
        """Median over the blocks that are not black of the standard error, as a share of the block."""
        lit = self.theirs > 0.01 * self.theirs.mean()
        return np.median(self.error[lit] / self.theirs[lit])

    def __str__(self):
        worst = np.abs(self.z).max()
        return (f"{self.z.size} blocks and colours, largest |z| {worst:.2f} (limit {self.limit:.2f}), "
                f"mean ratio {self.ratio:.4f}, median error of a block {self.precision:.2%}")


def compare(ours, theirs, allowance=0.0, blocks=BLOCKS):
    """Compares (seeds, height, width, 3+) pictures.

    Args:
        allowance: differences up to this share of the block are not counted.
    """
    (a, var_a), (b, var_b) = (statistics_of(pictures, blocks) for pictures in (ours, theirs))
    seeds_a, seeds_b = len(ours), len(theirs)
    variance = var_a / seeds_a + var_b / seeds_b
    spread = (var_a / seeds_a) ** 2 / (seeds_a - 1) + (var_b / seeds_b) ** 2 / (seeds_b - 1)
    freedom = np.divide(variance**2, spread, out=np.full_like(variance, seeds_a + seeds_b - 2.0), where=spread > 0)
    error = np.sqrt(variance)
    excess = np.maximum(np.abs(a - b) - allowance * b, 0.0)
    t = np.divide(excess, error, out=np.where(excess > 0, np.inf, 0.0), where=error > 0)
    return Comparison(a, b, error, np.sign(a - b) * normal_deviate(student_tail(t, freedom)))


def statistics_of(pictures, blocks):
    """Mean and variance over the seeds of the blocks' means."""
    means = np.array([blender_scene.region_means(picture, blocks) for picture in pictures])
    return means.mean(0), means.var(0, ddof=1)


def student_tail(t, freedom, steps=2000):
    """P(|T| > t). With T = sqrt(freedom) tan(angle) the density of the angle goes with cos(angle)^(freedom - 1)."""
    middles = (np.arange(steps) + 0.5) / steps

    def above(start):
        angles = start[..., None] + (np.pi / 2 - start[..., None]) * middles
        return (np.pi / 2 - start) * (np.cos(angles) ** (freedom[..., None] - 1)).mean(-1)

    return above(np.arctan(t / np.sqrt(freedom))) / above(np.zeros_like(t))


def normal_deviate(tail):
    """|z| with P(|Z| > |z|) = tail."""
    inverse = NormalDist().inv_cdf
    return np.vectorize(lambda p: inverse(1 - p / 2) if p > 1e-15 else 8.0, otypes=[float])(tail)
