"""The engine's own panels in the Render and View Layer tabs, which draw `properties`; and the registration of all panels."""

import bpy
from bl_operators.presets import AddPresetBase
from bl_ui.utils import PresetPanel

from . import compat, statistics, ui_motion, ui_report, ui_shared
from .properties import DERIVED, QUALITIES, SppmSettings
from .ui_shared import ENGINE, EnginePanel

# ---------------------------------------------------------------- presets


class SPPM_PT_presets(PresetPanel, bpy.types.Panel):
    bl_label = "SPPM Presets"
    preset_subdir = "sppm/render"
    preset_operator = "script.execute_preset"
    preset_add_operator = "render.sppm_preset_add"
    COMPAT_ENGINES = {ENGINE}


class SPPM_OT_preset_add(AddPresetBase, bpy.types.Operator):
    """Add or remove a preset of all settings of SPPM"""

    bl_idname = "render.sppm_preset_add"
    bl_label = "Add SPPM Preset"
    preset_menu = "SPPM_PT_presets"
    preset_subdir = SPPM_PT_presets.preset_subdir
    preset_defines = ["sppm = bpy.context.scene.sppm"]
    preset_values = [f"sppm.{name}" for name in SppmSettings.__annotations__ if name not in DERIVED]


# ---------------------------------------------------------------- the Render tab


class SPPM_PT_quality(EnginePanel, bpy.types.Panel):
    bl_label = "Quality"

    def draw_header_preset(self, _context):
        SPPM_PT_presets.draw_panel_header(self.layout)

    def draw_properties(self, layout, context):
        settings = context.scene.sppm
        row = layout.row(align=True)
        row.use_property_split = False
        for name in QUALITIES:
            row.prop_enum(settings, "quality", name)
        summary = layout.column(align=True)
        # Custom is nothing to choose, but what the settings below have become.
        custom = "custom: " if settings.quality == "CUSTOM" else ""
        summary.label(text=f"{custom}{settings.iterations} iterations")
        photons = settings.photons_per_iteration
        summary.label(text=f"{statistics.count(photons)} photons in each" if photons else "photons: automatic")


class SPPM_PT_sampling(EnginePanel, bpy.types.Panel):
    bl_label = "Sampling"

    def draw_properties(self, layout, context):
        settings = context.scene.sppm
        layout.prop(settings, "iterations")
        layout.prop(settings, "viewport_iterations", text="Viewport")
        layout.prop(settings, "time_limit")
        layout.prop(settings, "seed")


class SPPM_PT_light_paths(EnginePanel, bpy.types.Panel):
    bl_label = "Light Paths"

    def draw_properties(self, layout, context):
        layout.prop(context.scene.sppm, "max_depth")
        layout.prop(context.scene.sppm, "indirect", text="Indirect")


class SPPM_PT_photons(EnginePanel, bpy.types.Panel):
    bl_label = "Photons"

    def draw_properties(self, layout, context):
        settings = context.scene.sppm
        layout.column(heading="Photons").prop(settings, "use_auto_photons")
        if not settings.use_auto_photons:
            layout.prop(settings, "photons_per_iteration", text="Number")
        layout.column(heading="Radius").prop(settings, "use_auto_radius")
        if not settings.use_auto_radius:
            layout.prop(settings, "initial_radius", text="At First")
        layout.prop(settings, "radius_rule", text="Shrinks by")
        layout.prop(settings, "gamma")


class SPPM_PT_film(EnginePanel, bpy.types.Panel):
    bl_label = "Film"

    def draw_properties(self, layout, context):
        layout.prop(context.scene.sppm, "pixel_filter", text="Filter")
        layout.prop(context.scene.sppm, "filter_width", text="Width")
        layout.prop(context.scene.render, "film_transparent", text="Transparent")


class SPPM_PT_performance(EnginePanel, bpy.types.Panel):
    bl_label = "Performance"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_properties(self, layout, context):
        render = context.scene.render
        layout.prop(render, "threads_mode", text="Threads")
        threads = layout.column()
        threads.enabled = render.threads_mode == "FIXED"
        threads.prop(render, "threads", text="Number")


class SPPM_PT_output(EnginePanel, bpy.types.Panel):
    bl_label = "Snapshots"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_properties(self, layout, context):
        layout.prop(context.scene.sppm, "write_interval", text="Interval")
        path = layout.column()
        path.active = context.scene.sppm.write_interval > 0
        path.prop(context.scene.render, "filepath", text="Beside")


class SPPM_PT_simplify(EnginePanel, bpy.types.Panel):
    """Of Blender's own what the depsgraph does for every engine; Blender's would stand above the quality."""

    bl_label = "Simplify"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context):
        self.layout.prop(context.scene.render, "use_simplify", text="")

    def draw_properties(self, layout, context):
        render = context.scene.render
        layout.active = render.use_simplify
        for what, name in (("Subdivision", "simplify_subdivision"), ("Children", "simplify_child_particles")):
            column = layout.column(align=True)
            column.prop(render, f"{name}_render", text=what)
            column.prop(render, name, text="Viewport")


# ---------------------------------------------------------------- the View Layer tab


class SPPM_PT_override(EnginePanel, bpy.types.Panel):
    """What a view layer renders otherwise than the scene."""

    bl_label = "Override"
    bl_context = "view_layer"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_properties(self, layout, context):
        view_layer = context.view_layer
        layout.prop(view_layer, "material_override")
        if hasattr(view_layer, "world_override"):
            layout.prop(view_layer, "world_override")
        layout.prop(view_layer, "samples", text="Iterations")
        column = layout.column(heading="Include")
        column.prop(view_layer, "use_sky", text="Environment")
        column.prop(view_layer, "use_solid", text="Surfaces")


class SPPM_PT_passes(EnginePanel, bpy.types.Panel):
    bl_label = "Passes"
    bl_context = "view_layer"

    def draw_properties(self, layout, context):
        view_layer = context.view_layer
        data = layout.column(heading="Data")
        for name in ("z", "mist", "position", "normal", "uv"):
            data.prop(view_layer, f"use_pass_{name}")
        owner, name = compat.denoising_switch(view_layer)
        data.prop(owner, name, text="Denoising Data")
        indices = layout.column(heading="Indexes", align=True)
        indices.prop(view_layer, "use_pass_object_index")
        indices.prop(view_layer, "use_pass_material_index")
        layout.prop(view_layer, "pass_alpha_threshold")
        light = layout.column(heading="Light")
        for name in ("direct", "indirect", "caustics"):
            light.prop(view_layer.sppm, f"use_pass_{name}")
        light.prop(view_layer, "use_pass_emit", text="Emission")
        light.prop(view_layer, "use_pass_environment")
        light.prop(view_layer, "use_pass_diffuse_color", text="Diffuse Color")
        photons = layout.column(heading="Photons")
        for name in ("radius", "photons"):
            photons.prop(view_layer.sppm, f"use_pass_{name}")


_CLASSES = (SPPM_PT_presets, SPPM_OT_preset_add, SPPM_PT_quality, ui_report.SPPM_PT_messages, SPPM_PT_sampling,
            SPPM_PT_light_paths, SPPM_PT_photons, SPPM_PT_film, SPPM_PT_performance, SPPM_PT_output, SPPM_PT_simplify,
            ui_report.SPPM_PT_statistics, SPPM_PT_passes, SPPM_PT_override, *ui_motion.CLASSES, *ui_shared.CLASSES)


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    ui_shared.share_panels()
    ui_report.start()


def unregister():
    ui_report.stop()
    ui_shared.take_back_panels()
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
