"""Panels of motion blur, in place of those that only Cycles shows."""

import bpy

from . import compat
from .ui_shared import EnginePanel


class SPPM_PT_motion_blur(EnginePanel, bpy.types.Panel):
    bl_label = "Motion Blur"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context):
        self.layout.prop(context.scene.render, "use_motion_blur", text="")

    def draw_properties(self, layout, context):
        layout.active = context.scene.render.use_motion_blur
        layout.prop(*compat.motion_blur_position(context.scene), text="Position")
        layout.prop(context.scene.render, "motion_blur_shutter")


class SPPM_OBJECT_PT_motion_blur(EnginePanel, bpy.types.Panel):
    """Only where Cycles is there to store it."""

    bl_label = "Motion Blur"
    bl_context = "object"
    bl_options = {"DEFAULT_CLOSED"}
    shows = "object"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and hasattr(context.object, "cycles")

    def draw_header(self, context):
        self.layout.prop(context.object.cycles, "use_motion_blur", text="")

    def draw_properties(self, layout, context):
        layout.active = context.object.cycles.use_motion_blur
        layout.prop(context.object.cycles, "motion_steps", text="Steps")


CLASSES = (SPPM_PT_motion_blur, SPPM_OBJECT_PT_motion_blur)
