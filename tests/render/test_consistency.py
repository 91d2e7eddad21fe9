"""Errors fall with the number of photons as theory has it, everywhere in the picture.

With the share gamma = 2/3 of photons kept, radii fall as N^(-1/6): bias, as r^2, and noise, as 1 / (r sqrt(N)), both fall as
N^(-1/3). Direct light falls as N^(-1/2) or faster; where a caustic is narrower than the first radius, the error starts flat; and
a reference that is not perfect adds to the slope. With noise that makes -0.2 to -0.6.
"""

import consistency
import numpy as np
import pytest
from scenes import SPLITS, furnished_room


@pytest.mark.parametrize("split", SPLITS, ids=str)
def test_error_falls_everywhere(split):
    found = consistency.measure(furnished_room().desc, photons_per_iteration=3000, **split)
    assert set(found.errors) == {"all", "caustic", "edges", "corners", "curved", "flat"}
    for region, errors in found.errors.items():
        assert all(np.diff(errors[1:]) < 0), region  # before that the first radius decides
        assert -0.6 < found.slope(region) < -0.2, f"{region}: {found.slope(region):.2f}"
