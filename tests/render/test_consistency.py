"""Errors fall with the number of photons as theory has it, everywhere in the picture.

Squared radii fall as N^(-0.3) (gamma = 0.7): so does the bias, and noise, as 1 / (r sqrt(N)), falls as N^(-0.35); direct light and
paths as N^(-1/2). A reference that is not perfect adds to the slope. With noise that makes -0.2 to -0.6.
"""

import consistency
import numpy as np
import pytest
from scenes import SPLITS, furnished_room


@pytest.mark.parametrize("split", SPLITS[:2], ids=str)
def test_error_falls_everywhere(split):
    found = consistency.measure(furnished_room().desc, photons_per_iteration=3000, **split)
    assert set(found.errors) == {"all", "caustic", "edges", "corners", "curved", "flat"}
    for region, errors in found.errors.items():
        assert all(np.diff(errors[1:]) < 0), region  # before that the first radius decides
        assert -0.6 < found.slope(region) < -0.2, f"{region}: {found.slope(region):.2f}"
