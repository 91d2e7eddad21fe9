"""Panels of Blender that serve this engine too, and those that show what only Cycles' own panels would."""

import bpy

from . import compat

ENGINE = "SPPM"

# Panels for Blender's own renderers that show nothing this engine can do, or that are replaced here.
_EXCLUDED = {"VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes", "RENDER_PT_post_processing", "RENDER_PT_simplify",
             "RENDER_PT_simplify_viewport", "RENDER_PT_simplify_render", "RENDER_PT_simplify_greasepencil", "DATA_PT_light",
             "DATA_PT_area", "DATA_PT_falloff_curve", "DATA_PT_preview"}

# Panels made for EEVEE that show what every shader-node engine needs.
_INCLUDED = {"DATA_PT_spot", "DATA_PT_camera_dof", "DATA_PT_camera_dof_aperture", "EEVEE_MATERIAL_PT_context_material",
             "EEVEE_NEXT_MATERIAL_PT_context_material", "EEVEE_WORLD_PT_surface", "EEVEE_WORLD_PT_mist", "MATERIAL_PT_preview"}


class EnginePanel:
    """A panel that is there while this engine is chosen; `draw_properties` fills a column of labels and values.

    `shows` names what of the context a panel is about: without one, such as a light, the panel is not there.
    """

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = {ENGINE}
    shows = "scene"

    @classmethod
    def poll(cls, context):
        return context.engine in cls.COMPAT_ENGINES and getattr(context, cls.shows) is not None

    def draw(self, context):
        layout = self.layout
        layout.use_property_split = True
        layout.use_property_decorate = False
        self.draw_properties(layout.column(), context)


class SPPM_LIGHT_PT_light(EnginePanel, bpy.types.Panel):
    """What the exporter reads of a lamp: EEVEE's panel has, in 3.4, factors that are its own."""

    bl_label = "Light"
    bl_context = "data"
    shows = "light"

    def draw_properties(self, layout, context):
        light, lamp = context.light, context.object
        row = layout.row()
        row.use_property_split = False
        row.prop(light, "type", expand=True)
        for name in compat.light_strength(light):
            layout.prop(light, name)
        layout.separator()
        for name, text in _SIZES[light.type]:
            layout.prop(light, name, text=text)
        if light.type == "AREA":
            _draw_area(layout, light)
        layout.separator()
        owner, name = compat.shadow_switch(light)
        layout.column(heading="Cast").prop(owner, name, text="Shadow")
        if lamp is not None and lamp.type == "LIGHT":
            seen = layout.column(heading="Seen in")
            seen.prop(lamp, "visible_glossy", text="Mirrors")
            seen.prop(lamp, "visible_transmission", text="Glass")


_SIZES = {"POINT": [("shadow_soft_size", "Radius")], "SPOT": [("shadow_soft_size", "Radius")], "SUN": [("angle", "Angle")],
          "AREA": [("shape", "Shape")]}


def _draw_area(layout, light):
    has_two = light.shape in ("RECTANGLE", "ELLIPSE")
    layout.prop(light, "size", text="Size X" if has_two else "Size")
    if has_two:
        layout.prop(light, "size_y", text="Y")
    layout.prop(light, "spread")


class SPPM_LIGHT_PT_nodes(EnginePanel, bpy.types.Panel):
    bl_label = "Nodes"
    bl_context = "data"
    bl_options = {"DEFAULT_CLOSED"}
    shows = "light"

    def draw_properties(self, layout, context):
        _draw_surface(layout, context.light)


class SPPM_MATERIAL_PT_surface(EnginePanel, bpy.types.Panel):
    """EEVEE's panel would show EEVEE's output; what is rendered is that for Cycles."""

    bl_label = "Surface"
    bl_context = "material"
    shows = "material"

    def draw_properties(self, layout, context):
        if not _draw_surface(layout, context.material):
            layout.prop(context.material, "diffuse_color", text="Color")


def _draw_surface(layout, owner):
    """The shader of a material or lamp as the exporter finds it; False where it is not described by nodes."""
    if not compat.uses_nodes(owner):
        layout.prop(owner, "use_nodes", icon="NODETREE")
        return False
    output = owner.node_tree.get_output_node("CYCLES")
    if output is None:
        layout.label(text="No output node", icon="ERROR")
    else:
        layout.template_node_view(owner.node_tree, output, output.inputs["Surface"])
    return True


class SPPM_WORLD_PT_ray_visibility(EnginePanel, bpy.types.Panel):
    """Only where Cycles is there to store it: in its files the world may be hidden from the camera."""

    bl_label = "Ray Visibility"
    bl_context = "world"
    bl_options = {"DEFAULT_CLOSED"}
    shows = "world"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and hasattr(context.world, "cycles_visibility")

    def draw_properties(self, layout, context):
        layout.prop(context.world.cycles_visibility, "camera")


class SPPM_OBJECT_PT_ray_visibility(EnginePanel, bpy.types.Panel):
    """How the camera sees an object; all other rays meet whatever is rendered."""

    bl_label = "Ray Visibility"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}
    shows = "object"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and context.object.type in cls._SOLID

    _SOLID = {"MESH", "CURVE", "SURFACE", "META", "FONT"}

    def draw_properties(self, layout, context):
        layout.prop(context.object, "visible_camera", text="Camera")
        layout.prop(context.object, "is_holdout")


class SPPM_MATERIAL_PT_index(EnginePanel, bpy.types.Panel):
    bl_label = "Pass Index"
    bl_context = "material"
    bl_options = {"DEFAULT_CLOSED"}
    shows = "material"

    def draw_properties(self, layout, context):
        layout.prop(context.material, "pass_index")


CLASSES = (SPPM_LIGHT_PT_light, SPPM_LIGHT_PT_nodes, SPPM_MATERIAL_PT_surface, SPPM_MATERIAL_PT_index,
           SPPM_OBJECT_PT_ray_visibility, SPPM_WORLD_PT_ray_visibility)


def share_panels():
    for panel in _blender_panels():
        panel.COMPAT_ENGINES.add(ENGINE)


def take_back_panels():
    for panel in _blender_panels():
        panel.COMPAT_ENGINES.discard(ENGINE)


def _blender_panels():
    """Registered panels of Blender that this engine shares."""
    for panel in bpy.types.Panel.__subclasses__():
        # The shader editor's copy of a panel shares the original's set of engines.
        name, engines = panel.__name__.removeprefix("NODE_"), getattr(panel, "COMPAT_ENGINES", ())
        if name in _INCLUDED or ("BLENDER_RENDER" in engines and name not in _EXCLUDED and "freestyle" not in name):
            yield panel
