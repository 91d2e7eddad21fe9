"""Panels: that each draws what exists, for every kind of lamp, and that Blender's own are there; in a real window as well."""

from pathlib import Path
from types import MethodType, SimpleNamespace

import blender_scene
import bpy
import in_window
import make_scenes
import pytest
from sppm import statistics, ui, ui_motion, ui_report, ui_shared
from sppm.properties import DERIVED, QUALITIES, SppmSettings, SppmViewLayerSettings

PANELS = [cls for module in (ui, ui_motion, ui_report, ui_shared) for cls in vars(module).values()
          if isinstance(cls, type) and issubclass(cls, bpy.types.Panel) and cls is not ui.SPPM_PT_presets]
ROOT = Path(__file__).resolve().parents[2]
SHARED = ["RENDER_PT_color_management", "RENDER_PT_format", "RENDER_PT_frame_range", "RENDER_PT_output", "RENDER_PT_stamp",
          "WORLD_PT_context_world", "EEVEE_WORLD_PT_surface", "DATA_PT_context_light", "DATA_PT_spot", "DATA_PT_lens",
          "DATA_PT_camera", "DATA_PT_camera_dof", "DATA_PT_camera_dof_aperture", "EEVEE_MATERIAL_PT_context_material",
          "MATERIAL_PT_preview", "MATERIAL_PT_custom_props", "DATA_PT_uv_texture", "OBJECT_PT_visibility", "VIEWLAYER_PT_layer",
          "EEVEE_WORLD_PT_mist"]


class Layout:
    """Stands for a UILayout where there is no window: refuses properties that do not exist and keeps what is drawn."""

    def __init__(self, drawn):
        self._drawn = drawn

    def _part(self, **_settings):
        return Layout(self._drawn)

    column = row = split = box = _part

    def separator(self):
        pass

    def prop(self, owner, name, text=None, **_settings):
        assert name in owner.bl_rna.properties, f"{owner} has no {name}"
        self._drawn.append(name)

    def prop_enum(self, owner, name, value):
        assert value in owner.bl_rna.properties[name].enum_items
        self._drawn.append(value)

    def label(self, text="", icon="NONE"):
        assert icon in bpy.types.UILayout.bl_rna.functions["label"].parameters["icon"].enum_items
        self._drawn.append(text)

    def template_node_view(self, tree, node, socket):
        assert socket.node == node and node.id_data == tree
        self._drawn.append(socket.name)

    def popover(self, panel, icon="NONE", text=None):
        assert hasattr(bpy.types, panel)
        self._drawn.append(panel)


def context(**more):
    scene = bpy.context.scene
    return SimpleNamespace(**{
        "scene": scene, "view_layer": bpy.context.view_layer, "engine": scene.render.engine, "light": None, "object": None,
        "world": scene.world, "material": None, "region": SimpleNamespace(width=300),
        "preferences": SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)), **more})


def draw(panel, **more):
    """What a panel draws, or None if it is not there."""
    if not panel.poll(context(**more)):
        return None
    drawn = []
    drawing = SimpleNamespace(layout=Layout(drawn))
    for name in ("draw_header", "draw_header_preset", "draw_properties", "draw"):
        if hasattr(panel, name):
            setattr(drawing, name, MethodType(getattr(panel, name), drawing))
    for name in ("draw_header", "draw_header_preset", "draw"):
        if hasattr(drawing, name):
            getattr(drawing, name)(context(**more))
    return drawn


@pytest.fixture
def rendered(empty_scene, tmp_path):
    """A rendered scene of a glass ball with flipped normals."""
    blender_scene.add_ball_on_floor().data.flip_normals()
    blender_scene.render(tmp_path / "ball.exr")
    return empty_scene


# ---------------------------------------------------------------- the engine's own


def test_every_panel_draws(rendered):
    """With a lamp, or a material and its object, or neither."""
    lamp = bpy.data.objects["Point"]
    seen = {}
    ball = {"material": bpy.data.materials["Glass"], "object": bpy.data.objects["Ball"]}
    for more in ({}, {"light": lamp.data, "object": lamp}, ball):
        for panel in PANELS:
            drawn = draw(panel, **more)
            if drawn is not None:
                seen[panel.__name__] = drawn
    without_cycles = {"SPPM_WORLD_PT_ray_visibility"} if not hasattr(rendered.world, "cycles_visibility") else set()
    assert set(seen) == {panel.__name__ for panel in PANELS} - without_cycles
    assert all(seen.values()), seen


def test_every_setting_is_in_a_panel(empty_scene):
    drawn = set()
    for is_automatic in (True, False):
        empty_scene.sppm.use_auto_photons = empty_scene.sppm.use_auto_radius = is_automatic
        drawn |= {name for panel in PANELS if panel.poll(context()) for name in draw(panel)}
    assert set(SppmSettings.__annotations__) - {"quality"} <= drawn
    assert set(SppmViewLayerSettings.__annotations__) <= drawn
    assert set(QUALITIES) <= drawn


def test_panels_are_for_this_engine_only(rendered):
    rendered.render.engine = "CYCLES"
    lamp = bpy.data.objects["Point"]
    for panel in PANELS:
        assert not panel.poll(context(light=lamp.data, object=lamp, material=bpy.data.materials["Glass"])), panel


def test_quality_comes_first_and_tells_what_it_sets(empty_scene):
    first = next(cls for cls in ui._CLASSES if issubclass(cls, bpy.types.Panel) and cls is not ui.SPPM_PT_presets)
    assert first is ui.SPPM_PT_quality
    empty_scene.sppm.quality = "FINAL"
    drawn = draw(first)
    assert [f"{QUALITIES['FINAL']['iterations']} iterations", "photons: automatic"] == drawn[-2:]
    empty_scene.sppm.photons_per_iteration = 2000
    assert draw(first)[-2:] == [f"custom: {QUALITIES['FINAL']['iterations']} iterations", "2.00 k photons in each"]


def test_numbers_of_zero_are_shown_as_automatic(empty_scene):
    settings = empty_scene.sppm
    settings.photons_per_iteration, settings.initial_radius = 0, 0.0
    assert not {"photons_per_iteration", "initial_radius"} & set(draw(ui.SPPM_PT_photons))
    settings.photons_per_iteration = 2000
    assert "photons_per_iteration" in draw(ui.SPPM_PT_photons)
    settings.initial_radius = 0.1
    assert "initial_radius" in draw(ui.SPPM_PT_photons)


@pytest.mark.parametrize("kind", ["POINT", "SPOT", "SUN", "AREA"])
def test_lamp_shows_what_is_read(empty_scene, kind):
    """The switch for shadows is the one that the exporter reads, with Cycles or without."""
    lamp = make_scenes.add_lamp(kind, (0, 0, 1), (0, 0, 0), 1.0)
    drawn = draw(ui_shared.SPPM_LIGHT_PT_light, light=lamp.data, object=lamp)
    assert {"type", "color", "energy"} <= set(drawn)
    assert ("cast_shadow" in drawn) != ("use_shadow" in drawn)
    size = {"POINT": "shadow_soft_size", "SPOT": "shadow_soft_size", "SUN": "angle", "AREA": "size"}[kind]
    assert size in drawn
    assert ("spread" in drawn) == (kind == "AREA")
    if hasattr(lamp.data, "use_temperature"):
        assert {"exposure", "normalize"} <= set(drawn) and "temperature" not in drawn
        lamp.data.use_temperature = True
        assert "temperature" in draw(ui_shared.SPPM_LIGHT_PT_light, light=lamp.data, object=lamp)
    lamp.data.use_nodes = True
    assert draw(ui_shared.SPPM_LIGHT_PT_nodes, light=lamp.data) == ["Surface"]
    lamp.data.use_nodes = False
    assert draw(ui_shared.SPPM_LIGHT_PT_nodes, light=lamp.data) == ["use_nodes"]


def test_material_shows_the_output_for_cycles(empty_scene):
    """Where a material has one for EEVEE as well, that is another."""
    material = make_scenes.diffuse("Both", make_scenes.WHITE)
    eevee = material.node_tree.nodes.new("ShaderNodeOutputMaterial")
    eevee.target = "EEVEE"
    shown = []

    class Kept(Layout):
        def template_node_view(self, tree, node, socket):
            shown.append(node)

    ui_shared._draw_surface(Kept([]), material)
    assert shown == [material.node_tree.get_output_node("CYCLES")] != [eevee]


# ---------------------------------------------------------------- after a render


def test_messages_are_wrapped_and_stay_until_the_next_render(rendered, tmp_path):
    drawn = draw(ui_report.SPPM_PT_messages)
    assert "'Ball'" in drawn[0] and len(drawn) > 1
    assert max(map(len, drawn)) < 45
    bpy.data.objects["Ball"].data.flip_normals()
    blender_scene.render(tmp_path / "again.exr")
    assert draw(ui_report.SPPM_PT_messages) is None


def test_statistics_are_those_of_the_render(rendered):
    drawn = draw(ui_report.SPPM_PT_statistics)
    rows = dict(zip(drawn[::2], drawn[1::2]))
    assert rows["Iterations"] == "4"
    assert rows["Photons sent"] == statistics.count(the_progress().photons_emitted)
    assert rows["Indirect by"] in ("photons", "paths")
    assert {"    Camera", "    Photons", "    Gathering", "Rays", "Rays/s", "Memory", "Caustics"} <= set(rows)
    assert max(map(len, rows)) <= 14, "cut in a narrow panel"


def the_progress():
    ((_, report),) = statistics.reports("Scene", ["ViewLayer"])
    return report.progress


def test_nothing_is_told_before_a_render_or_of_another_file(rendered):
    blender_scene.start(32, 32)
    assert draw(ui_report.SPPM_PT_statistics) is None
    assert draw(ui_report.SPPM_PT_messages) is None


def test_layers_are_told_apart(rendered, tmp_path):
    second = rendered.view_layers.new("Second")
    blender_scene.render(tmp_path / "both.exr")
    drawn = draw(ui_report.SPPM_PT_statistics)
    assert {"ViewLayer", "Second"} <= set(drawn)
    assert drawn.count("Iterations") == 2
    rendered.view_layers.remove(second)
    assert draw(ui_report.SPPM_PT_statistics).count("Iterations") == 1


# ---------------------------------------------------------------- Blender's own


@pytest.mark.parametrize("name", SHARED)
def test_blenders_panel_serves_this_engine(name):
    aliases = {name, name.replace("EEVEE_MATERIAL", "EEVEE_NEXT_MATERIAL")}
    found = [panel for panel in bpy.types.Panel.__subclasses__() if panel.__name__ in aliases and panel.is_registered]
    assert found
    assert all("SPPM" in panel.COMPAT_ENGINES for panel in found)


def test_panels_of_cycles_stay_with_cycles():
    """They share one set of engines: to add to it would add this engine to all of them."""
    import cycles.ui

    assert cycles.ui.CyclesButtonsPanel.COMPAT_ENGINES == {"CYCLES"}


# ---------------------------------------------------------------- presets


def test_preset_brings_all_settings_back(empty_scene, tmp_path, monkeypatch):
    monkeypatch.setattr(bpy.utils, "user_resource", lambda _kind, path="", create=False: str(folder(tmp_path / path)))
    settings = empty_scene.sppm
    settings.iterations, settings.pixel_filter, settings.gamma = 123, "BOX", 0.5
    assert bpy.ops.render.sppm_preset_add(name="Boxes") == {"FINISHED"}
    (file,) = tmp_path.rglob("Boxes.py")
    text = file.read_text()
    assert all(f"sppm.{name} = " in text for name in SppmSettings.__annotations__ if name not in DERIVED)
    settings.iterations, settings.pixel_filter, settings.gamma = 1, "BLACKMAN_HARRIS", 0.6
    bpy.ops.script.execute_preset(filepath=str(file), menu_idname="SPPM_PT_presets")
    assert (settings.iterations, settings.pixel_filter, settings.gamma) == (123, "BOX", pytest.approx(0.5))


def folder(path):
    path.mkdir(parents=True, exist_ok=True)
    return path


# ---------------------------------------------------------------- a real window


@in_window.needed
def test_panels_draw_in_a_window(tmp_path):
    """Blender draws each tab and prints the trace of every panel that fails."""
    output = in_window.run("draw_in_window.py", tmp_path, ROOT / "build" / "test" / "tabs")
    assert "rna_uiItem" not in output, output
    drawn = {line.split()[1] for line in output.splitlines() if line.startswith("DRAWN ")}
    assert drawn == {panel.__name__ for panel in PANELS}, output
