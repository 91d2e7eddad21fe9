"""Panels of the Render tab that tell of the last render: what the scene cannot show, and where time and memory went."""

import textwrap

import bpy

from . import statistics
from .ui_shared import EnginePanel

_CHARACTER_WIDTH = 7.0  # pixels of the interface's font at scale 1, on average
_POLL_SECONDS = 0.5

_shown_version = -1


def _reports(context):
    scene = context.scene
    return statistics.reports(scene.name_full, [layer.name for layer in scene.view_layers])


class SPPM_PT_messages(EnginePanel, bpy.types.Panel):
    bl_label = "Messages"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and bool(statistics.messages(_reports(context)))

    def draw_properties(self, layout, context):
        width = _characters(context)
        for message in statistics.messages(_reports(context)):
            lines = textwrap.wrap(message, width)
            box = layout.column(align=True)
            box.label(text=lines[0], icon="INFO")
            for line in lines[1:]:
                box.label(text=line, icon="BLANK1")


def _characters(context):
    """How many characters fit into a line of the region."""
    scale = context.preferences.system.ui_scale
    return max(20, int((context.region.width / scale - 50) / _CHARACTER_WIDTH)) if context.region else 80


class SPPM_PT_statistics(EnginePanel, bpy.types.Panel):
    bl_label = "Statistics"

    @classmethod
    def poll(cls, context):
        return super().poll(context) and any(report.progress for _, report in _reports(context))

    def draw_properties(self, layout, context):
        found = [(name, report) for name, report in _reports(context) if report.progress]
        for name, report in found:
            box = layout.column(align=True)
            if len(found) > 1:
                box.label(text=name, icon="RENDERLAYERS")
            for what, how_much in statistics.lines(report):
                row = box.split(factor=0.5)
                row.label(text=what)
                row.label(text=how_much)


# ---------------------------------------------------------------- keeping them up to date


def start():
    bpy.app.handlers.load_pre.append(_clear)
    if not bpy.app.background:
        bpy.app.timers.register(_redraw_when_new, persistent=True)


def stop():
    bpy.app.handlers.load_pre.remove(_clear)
    if bpy.app.timers.is_registered(_redraw_when_new):
        bpy.app.timers.unregister(_redraw_when_new)


@bpy.app.handlers.persistent
def _clear(*_):
    statistics.clear()


def _redraw_when_new():
    """A render ends in a thread of its own, where the interface must not be touched: this timer is of the main thread."""
    global _shown_version
    if _shown_version != statistics.version():
        _shown_version = statistics.version()
        for window in bpy.context.window_manager.windows:
            for area in window.screen.areas:
                if area.type == "PROPERTIES":
                    area.tag_redraw()
    return _POLL_SECONDS
