"""The error of every scene of blend_scenes falls with the number of photons, in each region of the picture that it has."""

from pathlib import Path

import bpy
import consistency
import export_scenes
import make_scenes
import numpy as np
import pytest

FILES = sorted(Path(make_scenes.__file__).parent.glob("*.blend"))


@pytest.mark.slow
@pytest.mark.skipif(not bpy.app.binary_path, reason="errors do not depend on which Blender exports the scene: once is enough")
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_error_falls_everywhere(file):
    """See tests/render/test_consistency.py for the slopes that are expected.

    Where most is seen straight or in mirrors and glass, the errors of well spread samples fall faster: up to N^(-1).
    """
    found = consistency.measure(export_scenes.exported(file, consistency.size_of(file.stem)), first=4)
    for region, errors in found.errors.items():
        assert all(np.diff(errors[1:]) < 0), region  # before that the first radius decides
        assert -1 < found.slope(region) < -0.2, f"{region}: {found.slope(region):.2f}"
