"""Settings: the quality, animation, files and libraries."""

import re

import blender_scene
import bpy
import make_scenes
import pytest
from sppm.properties import DERIVED, QUALITIES, SppmSettings, SppmViewLayerSettings

NAMES = [name for name in SppmSettings.__annotations__ if name not in DERIVED]
NOT_ANIMATED = {*DERIVED, "write_interval"}


@pytest.fixture
def floor(empty_scene):
    make_scenes.add_floor(2.0, make_scenes.diffuse("White", make_scenes.WHITE))
    make_scenes.add_lamp("POINT", (0, 0, 1), (0, 0, 0), 50.0, shadow_soft_size=0.1)
    make_scenes.add_camera((0, 0, 2), (0, 0, 0))
    return empty_scene


def another_value(settings, name):
    """A legal value that is not the default."""
    prop = settings.bl_rna.properties[name]
    if prop.type == "ENUM":
        return next(item.identifier for item in prop.enum_items if item.identifier != prop.default)
    if prop.type == "BOOLEAN":
        return not prop.default
    return prop.default + 3 if prop.type == "INT" else prop.default / 2 or 1.25


# ---------------------------------------------------------------- quality


def test_a_new_scene_has_good_quality(empty_scene):
    assert bpy.data.scenes.new("New").sppm.quality == "GOOD"


@pytest.mark.parametrize("quality", QUALITIES)
def test_quality_sets_what_it_stands_for(empty_scene, quality):
    settings = empty_scene.sppm
    settings.iterations, settings.photons_per_iteration = 7, 1234
    settings.quality = quality
    assert {name: getattr(settings, name) for name in QUALITIES[quality]} == QUALITIES[quality]
    assert settings.quality == quality


def test_quality_tells_when_settings_are_others(empty_scene):
    settings = empty_scene.sppm
    settings.quality = "FINAL"
    settings.iterations += 1
    assert settings.quality == "CUSTOM"
    settings.iterations -= 1
    assert settings.quality == "FINAL"
    settings.photons_per_iteration = 1000
    assert settings.quality == "CUSTOM"


def test_custom_changes_nothing(empty_scene):
    settings = empty_scene.sppm
    settings.quality = "DRAFT"
    settings.quality = "CUSTOM"
    assert settings.quality == "DRAFT"


def test_tooltips_tell_the_iterations(empty_scene):
    items = empty_scene.sppm.bl_rna.properties["quality"].enum_items
    for name, values in QUALITIES.items():
        assert f"{values['iterations']} iterations" in items[name].description


# ---------------------------------------------------------------- automatic


def test_photons_are_automatic_or_as_many_as_pixels(empty_scene):
    settings, render = empty_scene.sppm, empty_scene.render
    render.resolution_x, render.resolution_y, render.resolution_percentage = 200, 100, 50
    assert settings.use_auto_photons
    settings.use_auto_photons = False
    assert settings.photons_per_iteration == 100 * 50
    settings.photons_per_iteration = 7
    settings.use_auto_photons = False
    assert settings.photons_per_iteration == 7
    settings.use_auto_photons = True
    assert settings.photons_per_iteration == 0


def test_radius_is_automatic_or_a_length(empty_scene):
    settings = empty_scene.sppm
    assert settings.use_auto_radius
    settings.use_auto_radius = False
    assert settings.initial_radius > 0
    settings.initial_radius = 0.5
    assert not settings.use_auto_radius
    settings.use_auto_radius = True
    assert settings.initial_radius == 0


# ---------------------------------------------------------------- what every setting has


@pytest.mark.parametrize("group", [SppmSettings, SppmViewLayerSettings], ids=["scene", "view layer"])
def test_everything_is_described(group):
    for name in group.__annotations__:
        prop = group.bl_rna.properties[name]
        assert len(prop.description) > 10, name
        assert prop.name and not prop.description.endswith("."), name


def test_lengths_and_times_have_units(empty_scene):
    properties = empty_scene.sppm.bl_rna.properties
    assert properties["initial_radius"].unit == "LENGTH"
    assert properties["time_limit"].unit == "TIME_ABSOLUTE"
    assert properties["filter_width"].subtype == "PIXEL"


@pytest.mark.parametrize("name", SppmSettings.__annotations__)
def test_animation(empty_scene, name):
    settings = empty_scene.sppm
    if name in NOT_ANIMATED:
        with pytest.raises(TypeError, match="not animatable"):
            settings.keyframe_insert(name)
        return
    default = getattr(settings, name)
    settings.keyframe_insert(name, frame=1)
    setattr(settings, name, another_value(settings, name))
    changed = getattr(settings, name)
    settings.keyframe_insert(name, frame=10)
    for frame, expected in ((1, default), (10, changed)):
        empty_scene.frame_set(frame)
        assert getattr(settings, name) == expected != (changed if frame == 1 else default)


def test_animated_iterations_are_rendered(floor, tmp_path, capsys):
    for frame, iterations in ((1, 2), (2, 5)):
        floor.sppm.iterations = iterations
        floor.sppm.keyframe_insert("iterations", frame=frame)
    floor.frame_start, floor.frame_end = 1, 2
    floor.render.filepath = str(tmp_path / "frame_")
    bpy.ops.render.render(animation=True)
    assert re.findall(r"rendered (\d+) iterations", capsys.readouterr().out) == ["2", "5"]


# ---------------------------------------------------------------- files and libraries


def change_all(scene):
    for settings, names in ((scene.sppm, NAMES), (scene.view_layers[0].sppm, SppmViewLayerSettings.__annotations__)):
        for name in names:
            setattr(settings, name, another_value(settings, name))


def values(scene):
    return {name: getattr(scene.sppm, name) for name in NAMES}, {
        name: getattr(scene.view_layers[0].sppm, name) for name in SppmViewLayerSettings.__annotations__}


def test_file_keeps_every_setting(empty_scene, tmp_path):
    before = values(empty_scene)
    change_all(empty_scene)
    changed = values(empty_scene)
    assert all(old != new for group in (0, 1) for old, new in zip(before[group].values(), changed[group].values()))
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "settings.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert values(bpy.context.scene)[0] != changed[0]
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "settings.blend"))
    assert values(bpy.context.scene) == changed
    assert bpy.context.scene.sppm.quality == "CUSTOM"


def test_copied_scene_keeps_every_setting(empty_scene):
    change_all(empty_scene)
    changed = values(empty_scene)
    assert values(empty_scene.copy()) == changed


@pytest.fixture
def library(floor, tmp_path):
    """A file with the floor's scene, called Lib, of 7 iterations; an empty file is open."""
    floor.name, floor.sppm.iterations = "Lib", 7
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    blender_scene.start(32, 32)
    return str(tmp_path / "library.blend")


def test_linked_scene_renders_with_its_own_settings(library, tmp_path, capsys):
    with bpy.data.libraries.load(library, link=True) as (found, wanted):
        wanted.scenes = found.scenes
    (scene,) = wanted.scenes
    assert scene.library and scene.sppm.iterations == 7
    bpy.ops.render.render(scene=scene.name)
    assert "rendered 7 iterations" in capsys.readouterr().out


def test_overridden_objects_of_a_library_render(library, tmp_path):
    """The linked floor, and half as bright where its override has a darker material of its own."""
    with bpy.data.libraries.load(library, link=True) as (found, wanted):
        wanted.objects = found.objects
    scene = bpy.context.scene
    for thing in wanted.objects:
        scene.collection.objects.link(thing)
    scene.camera = bpy.data.objects["Camera"]
    linked = blender_scene.render(tmp_path / "linked.exr")[..., :3].mean()
    floor = bpy.data.objects["Floor"].override_create(remap_local_usages=True)
    floor.material_slots[0].link = "OBJECT"
    floor.material_slots[0].material = make_scenes.diffuse("Half", (make_scenes.WHITE[0] / 2,) * 3)
    overridden = blender_scene.render(tmp_path / "overridden.exr")[..., :3].mean()
    # Without walls there is no light but direct light, which is in proportion to the albedo.
    assert overridden == pytest.approx(linked / 2, rel=1e-3)
