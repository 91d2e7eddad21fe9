"""The error of every scene of blend_scenes falls with the number of photons, in each region of the picture that it has."""

from pathlib import Path

import bpy
import consistency
import make_scenes
import numpy as np
import pytest
from sppm import export_scene

FILES = sorted(Path(make_scenes.__file__).parent.glob("*.blend"))


def exported(file, size=64):
    """The SceneDesc of a file at size x size pixels."""
    bpy.ops.wm.open_mainfile(filepath=str(file))
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = size
    return export_scene.export_scene(bpy.context.evaluated_depsgraph_get())[0]


@pytest.mark.slow
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_error_falls_everywhere(file):
    """See tests/render/test_consistency.py for the slopes that are expected."""
    found = consistency.measure(exported(file), first=4)
    for region, errors in found.errors.items():
        assert all(np.diff(errors) < 0), region
        assert -0.6 < found.slope(region) < -0.2, f"{region}: {found.slope(region):.2f}"
