"""Errors fall with the number of photons as theory has it, everywhere in the picture.

With the share gamma = 2/3 of photons kept, radii fall as N^(-1/6): bias, as r^2, and noise, as 1 / (r sqrt(N)), both fall as
N^(-1/3). Direct light falls as N^(-1/2) or faster; where a caustic is narrower than the first radius, the error starts flat; and
a reference that is not perfect adds to the slope. With noise that makes -0.2 to -0.6.
"""

import consistency
import numpy as np
import pytest
from scenes import Scene, at, box, diffuse, glass, look_at, sphere
from sppm.scene_desc import LightFlags, LightType


def room():
    """Walls, a ball and a block of diffuse white, a ball of glass with its caustic, an area lamp.

    The lamp's rare glints in the glass, which no short render meets, would hide all else: it is hidden from specular rays.
    """
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(0.6))
    for center, material in (((0.4, 0.2, -0.5), glass()), ((-0.5, 0.3, -0.6), diffuse(0.7))):
        shape = sphere(0.35, center, divisions=4)
        scene.add(shape, material, normals=((shape[0] - center) / 0.35).astype(np.float32))
    scene.add(box((-0.3, -0.3, -1), (0.1, 0, -0.7)), diffuse(0.7))
    scene.light(LightType.RECTANGLE, at(-0.2, 0, 0.95), 50, size_x=0.1, size_y=0.1, flags=LightFlags.HIDDEN_FROM_SPECULAR)
    return scene.camera(look_at((0, -0.95, 0.1), (0, 0.4, -0.4)), 0.8, 32)


@pytest.mark.parametrize("split", [dict()], ids=str)
def test_error_falls_everywhere(split):
    found = consistency.measure(room().desc, photons_per_iteration=3000, **split)
    assert set(found.errors) == {"all", "caustic", "edges", "corners", "curved", "flat"}
    for region, errors in found.errors.items():
        assert all(np.diff(errors) < 0), region
        assert -0.6 < found.slope(region) < -0.2, f"{region}: {found.slope(region):.2f}"
