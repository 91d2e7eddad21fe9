"""Passes of what surfaces are, holdouts, what the camera does not see: closed forms, and that nothing is paid for what is off."""

from dataclasses import replace

import numpy as np
import pytest
from scenes import (Scene, at, box, diffuse, emission, floor, furnished_room, glass, grey, look_at, mirror, quad, render,
                    render_all)
from sppm import native
from sppm.scene_desc import ClosureDesc, ClosureFlags, ClosureType, InstanceFlags, LightType, MaterialDesc, MeshDesc, Param

DATA = ("Depth", "Normal", *native.PASS_NAMES[8:])
CHANNELS = {"Normal": 3, "Position": 3, "UV": 3, "Emission": 3, "Environment": 3, "Diffuse Color": 3, "Denoising Albedo": 3,
            "Denoising Normal": 3}  # the others have one
HALF, SIZE = 2.0, 8
CENTRES = (np.arange(SIZE) + 0.5) / SIZE * 2 * HALF - HALF  # of pixels of `Scene.above(_, HALF)`
BOX = {"pixel_filter": "BOX", "filter_width": 1.0}


def clear(opacity):
    """What is to be mixed with something of that weight."""
    return ClosureDesc(ClosureType.TRANSPARENT, color=Param(grey(1 - opacity)))


def half_clear(albedo):
    return clear(0.5), replace(diffuse(albedo), weight=Param(grey(0.5)))


def change_last(scene, **changes):
    """The last instance, otherwise."""
    scene.desc.instances[-1] = replace(scene.desc.instances[-1], **changes)
    return scene


# ---------------------------------------------------------------- what they cost


def memory(*passes):
    with native.Scene(furnished_room().desc) as scene:
        with native.Session(scene, native.Settings(passes=frozenset(passes), photons_per_iteration=100)) as session:
            session.step()
            return session.progress().memory_bytes


def test_a_pass_takes_eight_bytes_a_channel_and_the_others_nothing():
    plain = memory()
    assert memory("Direct", "Indirect", "Caustics", "Radius", "Photons") == plain
    for name in DATA:
        assert memory(name) == plain + 32 * 32 * 8 * CHANNELS.get(name, 1), name


def test_the_picture_is_the_same_with_all_passes():
    plain, full = render(furnished_room(), "Combined", iterations=3), render_all(furnished_room(), iterations=3)["Combined"]
    assert np.array_equal(plain, full)


def test_a_pass_is_the_same_alone():
    every = render_all(furnished_room(), iterations=3)
    for name in DATA:
        assert np.array_equal(render(furnished_room(), "Combined", name, iterations=3)[1], every[name]), name


# ---------------------------------------------------------------- the middle of a pixel


def test_depth_and_position():
    """With an origin that floats could not hold to a millimetre together with the scene."""
    depth, position = render(Scene().add(floor(10), diffuse(0.5)).above(3, HALF), "Depth", "Position", origin=(1e3, -2e3, 5.5))
    np.testing.assert_allclose(depth, 3, rtol=1e-6)
    expected = np.stack(np.broadcast_arrays(1e3 + CENTRES[None, :], -2e3 + CENTRES[:, None], 5.5), -1)
    np.testing.assert_allclose(position, expected, atol=1e-4)


def test_indices_of_instances_of_one_mesh():
    """Left and right halves, the left one hidden behind a surface that is not opaque enough."""
    scene = Scene().add(quad([(-2, -2, 0), (0, -2, 0), (0, 2, 0), (-2, 2, 0)]), diffuse(0.5))
    left = scene.desc.instances[0]
    moved = left.transform.copy()
    moved[0, 3] = 2
    scene.desc.materials[0] = replace(scene.desc.materials[0], index=4)
    scene.desc.instances[:] = [replace(left, index=7), replace(left, index=9, transform=moved)]
    scene.add(quad([(-2, -2, 1), (0, -2, 1), (0, 2, 1), (-2, 2, 1)]), *half_clear(0.5))
    objects, materials = render(scene.above(3, HALF), "Object Index", "Material Index", alpha_threshold=0.6)
    assert (objects[:, :4] == 7).all() and (objects[:, 4:] == 9).all() and (materials == 4).all()
    assert (render(scene, "Object Index", alpha_threshold=0.5)[:, :4] == 0).all(), "the one in front is opaque enough now"


def test_where_nothing_is():
    found = render_all(Scene(0.25).above(3, HALF))
    shown = {name: found[name] for name in DATA}
    assert (shown.pop("Depth") == 1e10).all() and (shown.pop("Mist") == 1).all()
    for name in ("Environment", "Denoising Albedo"):
        np.testing.assert_allclose(shown.pop(name), 0.25, rtol=1e-6)
    assert not any(pixels.any() for pixels in shown.values())


# ---------------------------------------------------------------- averages


def with_uvs(scene, size):
    """The last mesh gets the UVs of a square of half width `size` that is mapped to 0 to 1."""
    mesh = scene.desc.meshes[-1]
    uvs = (mesh.positions[:, :2] / (2 * size) + 0.5).astype(np.float32)
    scene.desc.meshes[-1] = replace(mesh, corners=mesh.indices, corner_uvs=uvs)
    return scene


def test_uv_is_the_mean_over_a_pixel():
    scene = with_uvs(Scene().add(floor(4), diffuse(0.5)), 4).above(3, HALF)
    uv = render(scene, "UV", iterations=64, **BOX)
    expected = np.stack(np.broadcast_arrays(CENTRES[None, :] / 8 + 0.5, CENTRES[:, None] / 8 + 0.5, 1), -1)
    # 64 well spread points in a pixel of 1/16: their mean is off by less than a thousandth of it.
    np.testing.assert_allclose(uv, expected, atol=1e-3 / 16 * 4)
    assert not render(Scene().add(floor(4), diffuse(0.5)).above(3, HALF), "UV").any(), "a mesh without UVs"


@pytest.mark.parametrize("power", [1.0, 2.0, 0.5])
def test_mist(power):
    """A floor at depth 3 behind a half clear sheet at depth 2, in mist from 1 to 6."""
    scene = Scene().add(floor(10), diffuse(0.5)).add(floor(10, 1.0), *half_clear(0.5)).above(3, HALF)
    mist = render(scene, "Mist", iterations=256, mist_start=1.0, mist_depth=5.0, mist_power=power)
    expected = 0.5 * 0.2**power + 0.5 * 0.4**power
    assert mist.mean() == pytest.approx(expected, abs=0.003)  # whether a path goes through the sheet is a choice of 64 x 256
    scene = Scene().add(floor(10), diffuse(0.5)).above(3, HALF)
    assert not render(scene, "Mist", mist_start=1.0, mist_depth=0.0).any(), "no mist"


def test_light_that_the_camera_sees():
    """An emitter fills the left half, a half clear sheet before it and the sky; mirrors show it in no pass but the denoiser's."""
    scene = Scene(0.2).add(quad([(-2, -2, 0), (0, -2, 0), (0, 2, 0), (-2, 2, 0)]), emission(3))
    scene.add(floor(10, 1.0), *half_clear(0.5)).above(3, HALF)
    emitted, sky, color = render(scene, "Emission", "Environment", "Diffuse Color", iterations=256, **BOX)
    assert emitted[:, :4].mean() == pytest.approx(1.5, rel=0.02) and not emitted[:, 4:].any()
    assert sky[:, 4:].mean() == pytest.approx(0.1, rel=0.02) and not sky[:, :4].any()
    np.testing.assert_allclose(color, 0.25, rtol=1e-5)
    shown = render_all(Scene(0.2).add(floor(10), mirror(0.5)).above(3, HALF))
    assert not shown["Emission"].any() and not shown["Environment"].any() and not shown["Diffuse Color"].any()
    np.testing.assert_allclose(shown["Denoising Albedo"], 0.2 * 0.5**2, rtol=1e-5)  # Cycles tints it twice


# ---------------------------------------------------------------- what denoisers want to know


def test_features_are_seen_through_glass():
    """Straight above a slab, all but what it reflects to the black sky, and all bounces between its faces: the floor's albedo."""
    scene = Scene().add(floor(10), diffuse(0.6)).add(box((-5, -5, 1), (5, 5, 2)), glass()).above(3, 0.5)
    albedo, normal = render(scene, "Denoising Albedo", "Denoising Normal", iterations=256)
    seen = normal[..., 2].mean()
    assert np.allclose(normal[..., :2], 0, atol=1e-3) and seen == pytest.approx(-(1 - 2 * 0.04 / 1.04), abs=0.01)
    assert albedo.mean() == pytest.approx(-0.6 * seen, rel=1e-3)


def test_features_in_a_mirror_are_in_the_camera_frame():
    """A mirror below an angle shows a wall; its normal points along -x of the world, which is the camera's right."""
    scene = Scene().add(quad([(-1, -1, -1), (1, -1, 1), (1, 1, 1), (-1, 1, -1)]), mirror(0.5))
    scene.add(quad([(-3, -3, -3), (-3, 3, -3), (-3, 3, 3), (-3, -3, 3)]), diffuse(0.8)).above(5, 0.5)
    albedo, normal = render(scene, "Denoising Albedo", "Denoising Normal")
    np.testing.assert_allclose(albedo, 0.5 * 0.8, rtol=1e-4)
    np.testing.assert_allclose(normal, np.broadcast_to((1.0, 0.0, 0.0), normal.shape), atol=1e-4)


def test_half_a_mirror_is_no_mirror():
    """A quarter of what is scattered makes a surface count for itself."""
    for share, expected in ((0.5, 0.5 * 0.6), (0.1, None)):
        closures = replace(mirror(0.9), weight=Param(grey(1 - share))), replace(diffuse(0.6), weight=Param(grey(share)))
        albedo = render(Scene(1.0).add(floor(10), *closures).above(3, HALF), "Denoising Albedo", iterations=16)
        if expected:
            np.testing.assert_allclose(albedo, expected, rtol=1e-5)
        else:
            assert albedo.mean() > 0.6, "the white sky, as the mirror shows it"


def at_an_angle(angle, *closures):
    """A floor of these under a white sky, seen at so many degrees from straight above."""
    t = np.radians(angle)
    view = look_at((np.sin(t), 0, np.cos(t)), (0, 0, 0), up=(0, 1, 0))
    return render_all(Scene(1.0).add(floor(100), *closures).camera(view, 0.01), iterations=256)


@pytest.mark.parametrize("angle", [0, 60, 80])
@pytest.mark.parametrize("roughness", [0.3, 0.6, 1.0])
@pytest.mark.parametrize("kind", ["coat", "metal"])
def test_albedo_of_what_is_rough_is_what_it_reflects_of_an_even_sky(kind, roughness, angle):
    """Within 4 %: it is read from a table of 16 x 16 places."""
    keep, rough = ClosureFlags.PRESERVE_ENERGY, Param(grey(roughness))
    closures = {
        "coat": (ClosureDesc(ClosureType.COAT, keep | ClosureFlags.ATTENUATE, roughness=rough, ior=1.5), diffuse(0.0)),
        "metal": (ClosureDesc(ClosureType.CONDUCTOR, keep, color=Param((0.9, 0.5, 0.2)), roughness=rough),),
    }[kind]
    found = at_an_angle(angle, *closures)
    picture = found["Combined"][..., :3].mean((0, 1))
    np.testing.assert_allclose(found["Denoising Albedo"].mean((0, 1)), picture, rtol=0.04)


@pytest.mark.parametrize("flags", [ClosureFlags.SMOOTH_ALBEDO | ClosureFlags.PRESERVE_ENERGY, ClosureFlags.NONE])
def test_albedo_of_rough_metal_without_what_is_lost(flags):
    """As a smooth one's where that is asked for; what multiple scattering does not give back is not missed."""
    metal = ClosureDesc(ClosureType.CONDUCTOR, flags, color=Param(grey(0.5)), roughness=Param(grey(1.0)))
    straight, grazing = (at_an_angle(angle, metal)["Denoising Albedo"].mean() for angle in (0, 85))
    smooth = 0.5 + 0.5 * (1 - np.cos(np.radians(85))) ** 5
    assert straight == pytest.approx(0.5, abs=0.01)
    if flags:
        assert grazing == pytest.approx(smooth, rel=0.02)
    else:
        assert 0.5 < grazing < 0.7 < smooth, "microfacets that are seen turn toward the viewer"


# ---------------------------------------------------------------- holdouts, and what the camera does not see


@pytest.mark.parametrize("transparent_film", [False, True])
def test_a_holdout_cuts_a_hole(transparent_film):
    """Also out of what lies behind it, and of the data; light that it reflects is there all the same."""
    scene = Scene(1.0).add(floor(10), diffuse(0.5)).add(box((0, -5, 1), (5, 5, 2)), diffuse(0.9), emission(1))
    change_last(scene, flags=InstanceFlags.HOLDOUT).above(3, HALF)
    found = render_all(scene, transparent_film=transparent_film, iterations=16, **BOX)
    assert not found["Combined"][:, 4:].any()
    assert (found["Combined"][:, :4, 3] == 1).all() and found["Combined"][:, :4, :3].min() > 0.1
    for name in DATA:
        nothing = {"Depth": 1e10, "Mist": 1}.get(name, 0)
        assert (found[name][:, 4:] == nothing).all(), name


def test_a_half_clear_holdout_cuts_out_its_half():
    scene = Scene().add(floor(10), emission(0.6)).add(floor(10, 1.0), *half_clear(0.9))
    combined = render(change_last(scene, flags=InstanceFlags.HOLDOUT).above(3, HALF), "Combined")
    np.testing.assert_allclose(combined, np.broadcast_to((0.3, 0.3, 0.3, 0.5), combined.shape), rtol=1e-5)


@pytest.mark.parametrize("place", ["alone", "instanced", "movable", "beside what is movable"])
def test_what_is_hidden_from_the_camera_still_shines_and_shadows(place):
    """A small glowing square between camera and floor; the floor has the light of a closed form, and mirrors show the square."""
    radiance, half, height = 5.0, 0.05, 1.0
    scene = Scene().add(floor(10), diffuse(0.5)).add(floor(half, height), emission(radiance))
    change_last(scene, flags=InstanceFlags.HIDDEN_FROM_CAMERA)
    if "movable" in place:
        number = 1 if place == "movable" else 0
        scene.desc.instances[number] = replace(scene.desc.instances[number], movable=True)
    if place == "instanced":  # a second, far away, makes both true instances of one mesh
        far = scene.desc.instances[-1].transform.copy()
        far[:, 3] = 1e3, 0, -1
        scene.desc.instances.append(replace(scene.desc.instances[-1], transform=far, flags=InstanceFlags.NONE))
    scene.above(3, 0.02)
    found = render_all(scene, iterations=32)
    np.testing.assert_allclose(found["Depth"], 3, rtol=1e-6)
    irradiance = radiance * (2 * half) ** 2 / height**2  # from a small square straight above, cosines 1
    assert found["Combined"][..., :3].mean() == pytest.approx(0.5 / np.pi * irradiance, rel=0.01)  # the square is 1/400 sr
    shadowed = Scene().add(floor(10), diffuse(0.5)).add(floor(1, 1.0), diffuse(0))
    change_last(shadowed, flags=InstanceFlags.HIDDEN_FROM_CAMERA).light(LightType.SUN, at(0, 0, 5), 1).above(3, 0.5)
    assert not render(shadowed, "Combined")[..., :3].any(), "in the shadow of what is not seen"
    reflected = Scene().add(floor(10), mirror(1.0)).add(floor(10, 4.0), emission(2))
    change_last(reflected, flags=InstanceFlags.HIDDEN_FROM_CAMERA).above(5, 0.5)
    np.testing.assert_allclose(render(reflected, "Combined")[..., :3], 2, rtol=1e-5)
