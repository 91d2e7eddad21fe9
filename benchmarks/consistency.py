"""How the error of a scene falls with the number of photons, also where it is hard: caustics, edges, corners, curves."""

from dataclasses import dataclass

import masks
import metrics
import numpy as np
from sppm import native

FACTORS = (1, 4, 16, 64)
LEAST_PIXELS = 10  # of a region, for its error to mean something


@dataclass(frozen=True)
class Falling:
    """RMSE by region, one a factor of FACTORS, relative to the region's mean radiance; and how many pixels the region has."""

    errors: dict
    pixels: dict

    def slope(self, region="all"):
        """Exponent by which the error falls with the photons, without the first: there the first radius decides."""
        return metrics.slope(FACTORS[1:], self.errors[region][1:])


def render(desc, iterations, seed, *passes, **settings):
    """The passes of a SceneDesc as float64."""
    settings = native.Settings(iterations=iterations, seed=seed, passes=frozenset(passes), **settings)
    with native.Scene(desc) as scene, native.Session(scene, settings) as session:
        for _ in range(iterations):
            session.step()
        return [session.read_pass(name).astype(np.float64) for name in passes]


def regions_of(desc, combined, caustics):
    """Masks by name, "all" among them, of regions large enough; geometry as the rays through the middle of pixels see it."""
    sharp = dict(pixel_filter="BOX", filter_width=0.01, photons_per_iteration=1)
    geometry = render(desc, 1, 0, "Depth", "Normal", **sharp)
    regions = {"all": np.ones(combined.shape[:2], bool), **masks.regions(*geometry, combined, caustics)}
    return {name: mask for name, mask in regions.items() if mask.sum() >= LEAST_PIXELS}


def size_of(name):
    """Pixels along a side for a file of blend_scenes. Knobs and beads of `instances` are too small for 64."""
    return 128 if name == "instances" else 64


def seeds_of(factor):
    """How many renders an error is the mean of. Rare glints decide it where mirrors are small: short renders need more."""
    return min(16, 4 * FACTORS[-1] // factor)


def squares_without_glints(picture, final):
    """Masked array of (height, width): squared differences, the worst pixels masked."""
    squares = ((picture[..., :3] - final) ** 2).mean(-1)
    worst = np.ones(squares.size, bool)
    worst[metrics.without_worst(squares.ravel())] = False
    return np.ma.array(squares, mask=worst.reshape(squares.shape))


def measure(desc, first=1, reference=16, **settings):
    """Renders with `first` times FACTORS iterations and compares with `reference` times the most, of another seed.

    The reference has a bias of its own: slopes come out a little steeper than they are. A lamp's rare glint in glass may be
    thousands of times as bright as all else and decide alone, whichever render meets it: each leaves its worst 0.1 % of the pixels
    out.
    """
    final, caustics = render(desc, first * FACTORS[-1] * reference, 999, "Combined", "Caustics", **settings)
    final = final[..., :3]
    regions = regions_of(desc, final, caustics)
    squares = [np.ma.stack([squares_without_glints(render(desc, first * factor, seed, "Combined", **settings)[0], final)
                           for seed in range(seeds_of(factor))]).mean(0) for factor in FACTORS]
    errors = {name: [np.sqrt(found[mask].mean()) / final[mask].mean() for found in squares]
              for name, mask in regions.items()}
    return Falling(errors, {name: int(mask.sum()) for name, mask in regions.items()})
