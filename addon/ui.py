"""Panels: the engine's own, which draw `properties`, and Blender's, which are told that they serve this engine too."""

import bpy

ENGINE = "SPPM"

# Panels for Blender's own renderers that show nothing this engine can do, or that are replaced here.
_EXCLUDED = {"VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes", "RENDER_PT_post_processing",
             "DATA_PT_light", "DATA_PT_falloff_curve", "MATERIAL_PT_preview", "WORLD_PT_preview", "DATA_PT_preview"}

# Panels made for EEVEE that show what every shader-node engine needs.
_INCLUDED = {"DATA_PT_EEVEE_light", "DATA_PT_spot", "DATA_PT_area", "DATA_PT_camera_dof", "DATA_PT_camera_dof_aperture",
             "EEVEE_MATERIAL_PT_context_material", "EEVEE_MATERIAL_PT_surface", "EEVEE_WORLD_PT_surface",
             "EEVEE_NEXT_MATERIAL_PT_context_material", "EEVEE_NEXT_MATERIAL_PT_surface"}


class _EnginePanel:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {ENGINE}

    @classmethod
    def poll(cls, context):
        return context.engine in cls.COMPAT_ENGINES

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        self.draw_properties(layout.column(), context)


class SPPM_PT_sampling(_EnginePanel, bpy.types.Panel):
    bl_label = "Sampling"

    def draw_properties(self, layout, context):
        for name in ("iterations", "photons_per_iteration", "indirect", "time_limit", "max_depth", "seed"):
            layout.prop(context.scene.sppm, name)


class SPPM_PT_progressive(_EnginePanel, bpy.types.Panel):
    bl_label = "Photon Radius"

    def draw_properties(self, layout, context):
        for name in ("radius_rule", "initial_radius", "gamma"):
            layout.prop(context.scene.sppm, name)


class SPPM_PT_film(_EnginePanel, bpy.types.Panel):
    bl_label = "Film"

    def draw_properties(self, layout, context):
        for name in ("pixel_filter", "filter_width"):
            layout.prop(context.scene.sppm, name)
        layout.prop(context.scene.render, "film_transparent", text="Transparent")


class SPPM_PT_performance(_EnginePanel, bpy.types.Panel):
    bl_label = "Performance and Snapshots"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_properties(self, layout, context):
        render = context.scene.render
        layout.prop(render, "threads_mode")
        threads = layout.column()
        threads.enabled = render.threads_mode == "FIXED"
        threads.prop(render, "threads")
        layout.prop(context.scene.sppm, "write_interval")


class SPPM_PT_passes(_EnginePanel, bpy.types.Panel):
    bl_label = "Passes"
    bl_context = "view_layer"

    def draw_properties(self, layout, context):
        view_layer = context.view_layer
        layout.prop(view_layer, "use_pass_z")
        layout.prop(view_layer, "use_pass_normal")
        for name in ("direct", "indirect", "caustics", "radius", "photons"):
            layout.prop(view_layer.sppm, f"use_pass_{name}")


_CLASSES = (SPPM_PT_sampling, SPPM_PT_progressive, SPPM_PT_film, SPPM_PT_performance, SPPM_PT_passes)


def register():
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    for panel in _blender_panels():
        panel.COMPAT_ENGINES.add(ENGINE)


def unregister():
    for panel in _blender_panels():
        panel.COMPAT_ENGINES.discard(ENGINE)
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)


def _blender_panels():
    """Registered panels of Blender that this engine shares."""
    for panel in bpy.types.Panel.__subclasses__():
        # The shader editor's copy of a panel shares the original's set of engines.
        name, engines = panel.__name__.removeprefix("NODE_"), getattr(panel, "COMPAT_ENGINES", ())
        if name in _INCLUDED or ("BLENDER_RENDER" in engines and name not in _EXCLUDED and "freestyle" not in name):
            yield panel
