"""Materials that renderers go wrong on: black, white and brighter than white, odd indices of refraction, rooms of mirrors."""

import time

import numpy as np
import pytest
from scenes import Scene, at, box, check, diffuse, emission, floor, glass, grey, look_at, means, render_all, sphere
from sppm.scene_desc import ClosureDesc, ClosureFlags, ClosureType, LightType, Param

DEEP = 1024  # vertices of a path: as good as endless


def metal(color, roughness=0.0, flags=ClosureFlags.NONE):
    return ClosureDesc(ClosureType.CONDUCTOR, flags=flags, color=Param(grey(color)), color2=Param(grey(color)),
                       roughness=Param(grey(roughness)))


def coat(color, ior=1.5, roughness=0.0):
    return ClosureDesc(ClosureType.COAT, flags=ClosureFlags.ATTENUATE, color=Param(grey(color)), roughness=Param(grey(roughness)),
                       ior=ior)


def transparent(color):
    return ClosureDesc(ClosureType.TRANSPARENT, color=Param(grey(color)))


def tinted_glass(color, ior=1.5, roughness=0.0):
    return ClosureDesc(ClosureType.DIELECTRIC, color=Param(grey(color)), color2=Param(grey(color)), ior=ior,
                       roughness=Param(grey(roughness)))


SURFACES = {
    "diffuse": diffuse, "retro": lambda c: ClosureDesc(ClosureType.DIFFUSE, ClosureFlags.RETRO, color=Param(grey(c)),
                                                       roughness=Param(grey(1))),
    "mirror": metal, "rough metal": lambda c: metal(c, 0.5),
    "metal that keeps energy": lambda c: metal(c, 1.0, ClosureFlags.PRESERVE_ENERGY),
    "coat": coat, "glass": tinted_glass, "rough glass": lambda c: tinted_glass(c, roughness=0.5), "transparent": transparent,
}


# ---------------------------------------------------------------- black, white, above white


@pytest.mark.parametrize("name", SURFACES)
def test_black_is_black(name):
    """Whatever the closure: of all the light around nothing comes back."""
    scene = Scene(world=1).add(sphere(1, divisions=3), SURFACES[name](0))
    scene.light(LightType.POINT, at(0, 0, 3), 9).camera(at(0, 0, 3), 0.2)
    assert not render_all(scene)["Combined"][..., :3].any()


@pytest.mark.parametrize("name", SURFACES)
def test_white_gains_nothing(name):
    """A ball in an even sky is at most as bright as the sky; smooth ones vanish in it."""
    scene = Scene(world=1).add(sphere(1, divisions=3), SURFACES[name](1)).camera(at(0, 0, 3), 0.2)
    picture = render_all(scene, iterations=64, max_depth=DEEP, photons_per_iteration=1)["Combined"][..., :3]
    # Disney's diffuse and its roughness of 1 give back up to 1.1 of the light by design.
    assert 0 < picture.mean() < (1.12 if name == "retro" else 1.01)
    if name in ("mirror", "glass", "transparent"):
        assert picture.mean() == pytest.approx(1, rel=1e-3)


@pytest.mark.parametrize("max_depth", [2, 5, 12])
@pytest.mark.parametrize("albedo", [1.0, 1.5, 4.0])
def test_room_that_loses_no_light(albedo, max_depth):
    """In a closed box whose walls emit 1 light is scattered until the last vertex: sum of albedo^k. None hangs or overflows."""
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), diffuse(albedo), emission(1)).camera(at(0, 0, 0), 0.3)
    expected = sum(albedo**k for k in range(max_depth + 1))
    found = means(scene, "Combined", iterations=8, photons_per_iteration=5000, max_depth=max_depth, initial_radius=0.3, seeds=4)
    # Photons: to how many bounces the last vertex is told apart from the one before is a matter of counting.
    assert sum(albedo**k for k in range(max_depth)) * 0.95 < found.mean() < expected * 1.05


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("color", [1.5, 30.0])
def test_brighter_than_white_ends(name, color):
    """What gives back more than it gets makes a bright picture, but one that ends and has no infinity."""
    surface = SURFACES[name](color)
    scene = Scene(world=1).add(box((-1, -1, -1), (1, 1, 1)), surface).add(sphere(0.3, divisions=2), surface)
    scene.light(LightType.POINT, at(0.5, 0.5, 0.5), 1).camera(at(-0.5, -0.5, 0.9), 0.3)
    started = time.monotonic()
    picture = render_all(scene, max_depth=8, photons_per_iteration=1000)["Combined"][..., :3]
    assert time.monotonic() - started < 20
    # Eight vertices of a camera path and eight of a photon, times the densest spot of photons.
    assert picture.mean() < 1e3 * color**16


@pytest.mark.parametrize("flags", [ClosureFlags.NONE, ClosureFlags.PRESERVE_ENERGY])
@pytest.mark.parametrize("color", [1.05, 2.0, 1e6])
def test_rough_metal_brighter_than_white(color, flags):
    """The multiple scattering between facets is a geometric series; above white it must not turn infinite or negative."""
    scene = Scene(world=1).add(floor(9), metal(color, 1.0, flags)).above(1, 0.5)
    picture = render_all(scene, iterations=64, photons_per_iteration=1)["Combined"][..., :3]
    assert 0.3 * color < picture.mean() < 1.5 * color


# ---------------------------------------------------------------- indices of refraction


@pytest.mark.parametrize("ior", [1.0, 1.0 + 1e-6, 1.001, 0.5, 1 / 1.5, 3.0, 10.0, 1e-3, 1e3])
def test_glass_of_any_index_gains_and_loses_nothing(ior):
    scene = Scene(world=1).add(sphere(1, divisions=3), glass(ior)).camera(at(0, 0, 3), 0.2)
    picture = render_all(scene, iterations=64, max_depth=DEEP, photons_per_iteration=1)["Combined"][..., :3]
    # At 10 a vertex lets out 0.3 % of what is inside: after 1024 of them 5 % of it still are there.
    assert picture.mean() == pytest.approx(1, rel=0.02)


@pytest.mark.parametrize("roughness", [0.0, 0.01, 0.1, 1.0])
@pytest.mark.parametrize("ior", [1.0, 1.0 + 1e-6, 0.5, 3.0])
@pytest.mark.parametrize("flags", [ClosureFlags.NONE, ClosureFlags.PRESERVE_ENERGY, ClosureFlags.REFRACTION_ONLY])
def test_rough_glass_of_any_index(ior, roughness, flags):
    """It gains nothing; and where index and roughness leave the light as it was, it loses nothing."""
    scene = Scene(world=1).add(sphere(1, divisions=3), glass(ior, roughness, flags)).add(floor(5, -1.5), diffuse(0.5))
    scene.light(LightType.POINT, at(0, 0, 3), 1).camera(at(0, 0, 3), 0.2)
    picture = render_all(scene, iterations=16, max_depth=64)["Combined"][..., :3]
    assert picture.mean() < 2.0
    if not flags & ClosureFlags.REFRACTION_ONLY or ior == 1.0:
        assert picture.mean() > 0.1


def test_index_one_bends_nothing():
    """A floor under a plate of air, by camera paths and by photons."""
    def scene():
        return Scene().add(floor(1), diffuse(0.5)).light(LightType.POINT, at(0.2, 0, 2), 1)

    view = dict(z=1.5, half=0.3)
    free = means(scene().above(**view), "Direct", iterations=8)
    plate = means(scene().add(box((-3, -3, 0.5), (3, 3, 0.7)), glass(1.0)).above(**view), "Combined", iterations=8,
                  photons_per_iteration=10000, initial_radius=0.1)
    check(plate, free.mean())


# ---------------------------------------------------------------- mirrors


def mirror_room(color, roughness=0.0):
    scene = Scene().add(box((-1, -1, -1), (1, 1, 1)), metal(color, roughness))
    scene.light(LightType.POINT, at(0.3, 0.2, 0.5), 1, radius=0.1)
    return scene.camera(look_at((0, -0.9, 0.1), (0, 1, 0)), 0.8, 16)


@pytest.mark.parametrize("roughness", [0.0, 0.2])
@pytest.mark.parametrize("color", [0.9, 1.0])
@pytest.mark.parametrize("max_depth", [1, 24, DEEP])
def test_room_of_mirrors_ends(color, roughness, max_depth):
    started = time.monotonic()
    picture = render_all(mirror_room(color, roughness), max_depth=max_depth, iterations=2, photons_per_iteration=500)["Combined"]
    assert time.monotonic() - started < 60
    # Radiance of the lamp's own surface, met at most once a vertex.
    assert picture[..., :3].max() <= 1 / (np.pi * 0.1**2) * max_depth


def test_room_of_mirrors_with_one_diffuse_ball():
    """All light ends at the ball, after however many mirrors: irradiance is power / area, reflections at the ball included."""
    albedo, scene = 0.5, mirror_room(1.0)
    scene.desc.lights.clear()
    scene.add(sphere(0.4, divisions=4), diffuse(albedo)).light(LightType.POINT, at(0.7, 0.6, 0.7), 1)
    found = render_all(scene, iterations=8, photons_per_iteration=5000, max_depth=DEEP, initial_radius=0.1)
    # Every point of the picture shows some point of the ball in the end; lit unevenly, so within a third.
    expected = 4 * np.pi / (4 * np.pi * 0.4**2) * albedo / (1 - albedo) / np.pi
    assert found["Combined"][..., :3].mean() == pytest.approx(expected, rel=1 / 3)


# ---------------------------------------------------------------- nothing to see


def test_only_glass_is_visible():
    """No visible point anywhere: the sky through the glass, and no photon that could be used."""
    scene = Scene(world=0.7).add(sphere(1, divisions=3), glass()).light(LightType.POINT, at(0, 0, 2), 5)
    found = render_all(scene.camera(at(0, 0, 3), 0.2), max_depth=DEEP)
    assert found["Combined"][..., :3].mean() == pytest.approx(0.7, rel=0.01)
    assert not found["Photons"].any() and not found["Radius"].any()


def test_nothing_but_lamps():
    scene = Scene()
    for kind in LightType:
        scene.light(kind, at(0, 0, 1), 1, radius=0.1, angle=0.1, size_x=1.0, size_y=1.0)
    assert not render_all(scene.camera(at(0, 0, 3), 0.2))["Combined"][..., :3].any()


@pytest.mark.parametrize("indirect", ["PATHS", "PHOTONS"])
@pytest.mark.parametrize("material", [diffuse(0.6), metal(1, roughness=0.6)], ids=["diffuse", "rough metal"])
def test_clear_sheet_changes_no_direct_light(material, indirect):
    """What a path meets behind a clear surface is weighed against the light samples where it was scattered."""
    def lit(with_sheet):
        scene = Scene().add(floor(0.5), material).add(floor(1.0, z=2.0), emission(1))
        return (scene.add(floor(5.0, z=1.0), transparent(1)) if with_sheet else scene).above(0.9, 0.1)

    bare, covered = (means(lit(sheet), "Direct", seeds=4, iterations=64, photons_per_iteration=10, indirect=indirect)
                     for sheet in (False, True))
    check(covered, bare.mean())


def test_many_transparent_sheets():
    """More of them than light is followed through: it counts as stopped, not as lost in an endless path."""
    for count, seen in ((50, True), (1000, False)):
        scene = Scene(world=1).add(floor(5, -1.0), diffuse(0.5))
        for i in range(count):
            scene.add(floor(5, i * 1e-3), transparent(1.0))
        picture = render_all(scene.camera(at(0, 0, 3), 0.2), iterations=2)["Combined"][..., :3]
        assert picture.any() == seen


def test_sixteen_closures():
    """As many lobes as a material may have, in parts that sum to a white one."""
    part = Param(grey(1 / 16))
    closures = [ClosureDesc(ClosureType.DIFFUSE, weight=part, color=Param(grey(1))) for _ in range(8)]
    closures += [ClosureDesc(ClosureType.CONDUCTOR, weight=part, color=Param(grey(1)), color2=Param(grey(1)),
                             roughness=Param(grey(r))) for r in np.linspace(0, 0.3, 8)]
    scene = Scene(world=1).add(sphere(1, divisions=3), *closures).camera(at(0, 0, 3), 0.2)
    assert render_all(scene, iterations=256, photons_per_iteration=1)["Combined"][..., :3].mean() == pytest.approx(1, rel=0.02)
