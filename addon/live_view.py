"""Viewports in Rendered shading: what each has exported, what is rendered for it, and drawing that."""

import traceback
import weakref
from dataclasses import replace

import bpy

from . import compat
from .export_cache import ExportCache
from .export_camera import CameraError
from .export_scene import export_viewport, moved
from .export_view import export_view
from .live_render import Job, LiveRender
from .scene_change import equal, is_unchanged

_POLL_SECONDS = 0.03

_views = weakref.WeakSet()


class LiveView:
    """One viewport, as long as its RenderEngine lives: Blender frees that when the viewport wants no more pictures.

    Attributes:
        drawn: the Picture that is on the screen, or None.
    """

    def __init__(self, engine):
        # Weak, for the engine owns this: nothing may keep it from being freed.
        self._engine = weakref.ref(engine)
        self._cache, self._render = ExportCache(), LiveRender()
        self._scene, self._settings, self._view, self._job = None, None, None, None
        self._error, self._failed, self._told = "", "", None  # of the view, of the export, what the last redraw was for
        self._texture, self.drawn = None, None
        _views.add(self)

    def __del__(self):
        self._render.stop()

    def update(self, context, depsgraph, settings):
        """Exports what has changed (RenderEngine.view_update), and begins the picture again if that shows."""
        space = context.space_data
        try:
            scene = export_viewport(depsgraph, lambda obj: obj.visible_in_viewport_get(space), self._cache)
        except Exception as error:  # whatever a mesh or a node tree may hold: raised further, it would keep this alive in Blender
            traceback.print_exc()
            self._failed = f"{type(error).__name__}: {error}"
            return
        self._failed = ""
        if self._scene is None or settings != self._settings or not is_unchanged(self._scene, scene):
            self._scene, self._settings, self._view = scene, settings, None
        self._look(context, depsgraph)

    def draw(self, context, depsgraph):
        """Draws the newest picture (RenderEngine.view_draw), and begins it again if the view is another."""
        self._look(context, depsgraph)
        picture = self._render.picture
        if picture is not None and self._view is not None:
            if self._texture is None or picture is not self.drawn:
                self._texture = compat.texture(picture.pixels)
            camera = picture.job.camera
            compat.draw_texture(self._texture, self._view.x, self._view.y, camera.width, camera.height)
        self.drawn = picture
        self._tell(picture)

    def _look(self, context, depsgraph):
        try:
            view = export_view(context.region, context.space_data, context.region_data, depsgraph)
            self._error = ""
        except CameraError as error:
            view, self._error = None, str(error)
        if self._scene is None or view is None:
            self._view = None
            self._render.stop()
        elif self._view is None or not equal(view.camera, self._view.camera):
            self._begin(view)
        else:
            self._view = view

    def _begin(self, view):
        camera = replace(view.camera, transform=moved(view.camera.transform, self._scene.origin))
        self._view, self._job = view, Job(self._scene, camera, self._settings)
        self._render.start(self._job)
        _watch()

    def _tell(self, picture):
        """The line in the viewport's corner."""
        engine, error = self._engine(), self._error or self._failed or self._render.error
        if error:
            engine.update_stats("SPPM", error)
        elif picture is not None:
            engine.update_stats("SPPM", f"iteration {0 if picture.is_reduced else picture.iteration}/{self._settings.iterations}")

    def redraw_if_new(self):
        """Asks Blender for a redraw if there is something new to be seen; whether more may come."""
        is_running = self._render.is_running  # asked first: what comes last must not be missed
        engine, news = self._engine(), (self._render.picture, self._render.error)
        if engine is not None and news != self._told:
            self._told = news
            try:
                engine.tag_redraw()
            except ReferenceError:  # Blender has freed it
                self._render.stop()
        return is_running

    def stop(self):
        """Ends its rendering before it returns."""
        self._render.stop()
        self._render.wait()


def _watch():
    if not bpy.app.timers.is_registered(_redraw_where_new):
        bpy.app.timers.register(_redraw_where_new, first_interval=_POLL_SECONDS, persistent=True)


def _redraw_where_new():
    """Blender may be told to redraw from its own thread only: that of this timer, not that of the rendering."""
    is_running = [view.redraw_if_new() for view in _views]
    return _POLL_SECONDS if any(is_running) else None


def stop_all():
    """Ends all rendering, for the add-on is to be disabled."""
    for view in list(_views):
        view.stop()
    if bpy.app.timers.is_registered(_redraw_where_new):
        bpy.app.timers.unregister(_redraw_where_new)
