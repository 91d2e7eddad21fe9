"""Photons that make caustics leave toward the surfaces that throw them."""

import numpy as np
import scenes
from sppm import native
from sppm.scene_desc import LightType


def sheet(half, cells, z):
    """A square of cells x cells quads, one row after the other."""
    x, y = np.meshgrid(*2 * (np.linspace(-half, half, cells + 1),))
    corners = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = corners[:-1, :-1], corners[:-1, 1:], corners[1:, 1:], corners[1:, :-1]
    triangles = np.stack([a, b, c, a, c, d], -1).reshape(-1, 3)
    return np.stack([x, y, np.full_like(x, z)], -1).reshape(-1, 3).astype(np.float32), triangles.astype(np.uint32)


def share_that_lands(scene, aim):
    """Photons that were stored, for each path of caustic photons that was sent."""
    settings = native.Settings(iterations=2, indirect="PATHS", aim_photons=aim, photons_per_iteration=20_000)
    with native.Scene(scene.desc) as committed, native.Session(committed, settings) as session:
        for _ in range(settings.iterations):
            session.step()
        progress = session.progress()
    return progress.photons_stored / progress.photons_emitted


def test_a_wide_sheet_of_small_triangles_is_aimed_at():
    """One ball around the sheet would hold the lamp and leave no direction out; many small ones do.

    Its triangles stand in rows, so that in their order one end of the sheet follows on the other.
    """
    lamp = scenes.at(0, 0, 1.0)
    scene = scenes.Scene().add(scenes.floor(3.0, z=-0.3), scenes.diffuse(0.5)).add(sheet(1.0, 190, 0.0), scenes.glass(1.33))
    scene.light(LightType.POINT, lamp, 1.0).above(3.0, half=2.5, size=32)
    solid_angle = 4 * np.arcsin(0.5)  # of a square seen from half its width above: 4 asin(1 / (1 + 1))
    unaimed = share_that_lands(scene, aim=False)
    assert unaimed > 0.7 * solid_angle / (4 * np.pi)
    assert share_that_lands(scene, aim=True) > 3 * unaimed
