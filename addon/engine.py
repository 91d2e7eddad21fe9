"""The RenderEngine: Blender's callbacks -> export, session loop, result; or a viewport's live view.

Every failure ends as a message to the user.
"""

import sys
import time
import traceback
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import replace
from pathlib import Path

import bpy

from . import advice, live_view, native, render_result, statistics
from .export_camera import CameraError
from .export_motion import shutter_of
from .export_scene import export_scene
from .native_library import Cancelled, SppmError
from .scene_validation import SceneError

_POLL_SECONDS = 0.03
_PREVIEW_SECONDS = 1.0
_STATUS_SECONDS = 0.25
_PREVIEW_ITERATIONS = 16  # of the small pictures of materials
_GOODBYE_SECONDS = 0.2  # for what Blender does with its engine after `render` has returned
_PATIENCE_SECONDS = 10.0

_under_way = set()  # every _Render that has not ended

# Failures whose message is all that the user needs.
_EXPECTED = (SppmError, CameraError, SceneError, MemoryError, OSError)


class SppmRenderEngine(bpy.types.RenderEngine):
    """Stochastic progressive photon mapping."""

    bl_idname = "SPPM"
    bl_label = "SPPM"
    bl_use_preview = True
    bl_use_postprocess = True
    bl_use_shading_nodes_custom = False
    bl_use_eevee_viewport = True

    _live = None
    _told = None

    def update_render_passes(self, scene=None, renderlayer=None):
        render_result.register_passes(self, scene, renderlayer)

    def render(self, depsgraph):
        # What is raised here Blender would answer with a saved picture and exit code 0; only a reported error stops it.
        try:
            # Blender makes one engine for all view layers of a picture.
            self._told = self._told or statistics.Told()
            _Render(self, depsgraph, self._told).run()
        except _EXPECTED as error:
            self.report({"ERROR"}, f"SPPM: {str(error) or type(error).__name__}")
        except Exception as error:  # a bug of ours: the trace is for the report of it
            traceback.print_exc()
            self.report({"ERROR"}, f"SPPM: {type(error).__name__}: {error}")

    def view_update(self, context, depsgraph):
        if self._live is None:
            self._live = live_view.LiveView(self)
        self._live.update(context, depsgraph, viewport_settings(depsgraph.scene))

    def view_draw(self, context, depsgraph):
        if self._live is not None:
            self._live.draw(context, depsgraph)


class _Render:
    """The render of one view layer."""

    def __init__(self, engine, depsgraph, told):
        self._engine, self._depsgraph, self._told = engine, depsgraph, told
        self._settings = session_settings(depsgraph)
        if engine.is_preview:
            self._settings = replace(self._settings, iterations=min(self._settings.iterations, _PREVIEW_ITERATIONS))
        self._next_preview, self._next_preview_iteration, self._next_status = 0.0, 1, 0.0
        self._is_stopped = False

    def run(self):
        _under_way.add(self)
        try:
            if self._engine.is_preview:
                self._run_quietly()
            else:
                self._run()
        finally:
            _under_way.discard(self)

    def stop(self):
        """As if the user cancelled; may be called by any thread."""
        self._is_stopped = True

    def _shall_stop(self):
        return self._is_stopped or self._engine.test_break()

    def _run(self):
        self._engine.update_stats("", "SPPM: exporting the scene")
        shutter = shutter_of(self._engine, self._depsgraph.scene)
        desc, warnings = export_scene(self._depsgraph, self._engine.camera_override, shutter)
        warnings += render_result.warnings(self._depsgraph.view_layer)
        self._settings.origin = desc.origin
        hints = advice.before_render(desc, self._settings.max_depth)
        self._tell(warnings, hints)
        self._engine.update_stats("", "SPPM: building the scene")
        with native.Scene(desc, self._settings.threads) as scene:
            del desc
            with native.Session(scene, self._settings) as session:
                self._render_into_result(session)
                _print_stamp(session.progress(), scene.info())
                self._tell_after(session, scene.info(), warnings + hints)

    def _run_quietly(self):
        """The picture of a material, lamp or world in Blender's interface: nobody asked for it, so nothing is told."""
        desc, _ = export_scene(self._depsgraph)
        with native.Scene(desc, self._settings.threads) as scene, native.Session(scene, self._settings) as session:
            self._render_into_result(session)

    def _tell(self, warnings, hints):
        """What the engine could not render is a warning, what it advises is only printed; both stay for the panel."""
        self._record(statistics.Report(warnings + hints))
        news = self._told.news(self._depsgraph.view_layer.name, warnings + hints)
        for message in news:
            print(f"SPPM: {message}")
        sys.stdout.flush()
        warnings = [message for message in warnings if message in news]
        if warnings:
            more = f" (and {len(warnings) - 1} more, see the console)" if len(warnings) > 1 else ""
            self._engine.report({"WARNING"}, f"SPPM: {warnings[0]}{more}")

    def _tell_after(self, session, info, messages):
        progress = session.progress()
        hints = advice.after_render(progress, info["has_specular"])
        shares = render_result.light_shares(session, self._settings.passes)
        parts = [f"{name.lower().rstrip('s')} light is {share:.1%} of the picture" for name, share in shares.items()]
        for message in hints + parts:
            print(f"SPPM: {message}", flush=True)
        self._record(statistics.Report(messages + hints, progress, progress.memory_bytes + info["memory_bytes"], shares))

    def _record(self, report):
        statistics.record(self._depsgraph.scene.name_full, self._depsgraph.view_layer.name, report)

    def _render_into_result(self, session):
        writer = render_result.ResultWriter(self._engine, session.size, self._depsgraph.view_layer.name)
        try:
            self._loop(session, writer)
            writer.write(session)
        except BaseException:
            # Iterations that were finished stay good whatever failed after them: a full disk must not cost the picture.
            kept = session.progress().iteration > 0
            try:
                if kept:
                    writer.write(session)
            finally:
                writer.close(cancel=not kept)
            raise
        writer.close()

    def _loop(self, session, writer):
        """Steps until done; what was rendered before the user cancels is kept."""
        with ThreadPoolExecutor(max_workers=1, thread_name_prefix="sppm") as worker:
            while not session.progress().finished and not self._shall_stop():
                if not self._step(session, worker):
                    break
                self._show(session, writer)

    def _step(self, session, worker):
        """One iteration on the worker while this thread keeps asking whether to go on; False if it was cancelled."""
        step = worker.submit(session.step)
        try:
            while not wait([step], timeout=_POLL_SECONDS).done:
                if self._shall_stop():
                    session.cancel()
                self._show_status(session.progress())
            step.result()
            return True
        except Cancelled:
            return False
        except BaseException:
            # Nothing may run on while the session is being closed.
            session.cancel()
            wait([step])
            raise

    def _show(self, session, writer):
        progress = session.progress()
        self._engine.update_progress(self._done(progress))
        self._show_status(progress)
        if not bpy.app.background and self._is_preview_due(progress.iteration):
            writer.show(session)
            # Counted from the end of showing it, so that previews of large pictures do not eat the render.
            self._next_preview = time.monotonic() + _PREVIEW_SECONDS

    def _is_preview_due(self, iteration):
        """After iterations 1, 2, 4, 8, ... and otherwise about once a second."""
        if iteration >= self._next_preview_iteration:
            self._next_preview_iteration = 2 * iteration
            return True
        return time.monotonic() >= self._next_preview

    def _done(self, progress):
        """Share of the work done, 0 to 1."""
        limit = self._settings.time_limit
        return min(1.0, max(progress.iteration / self._settings.iterations, progress.seconds / limit if limit > 0.0 else 0.0))

    def _show_status(self, progress):
        """Render farms read this line: its form is told in docs/install.md. The last one is always shown."""
        now = time.monotonic()
        if now < self._next_status and not progress.finished:
            return
        self._next_status = now + _STATUS_SECONDS
        self._engine.update_stats("", f"SPPM iteration {progress.iteration}/{self._settings.iterations}, "
                                      f"{progress.photons_emitted} photons, remaining {self._remaining(progress)}")

    def _remaining(self, progress):
        done = self._done(progress)
        if done <= 0.0:
            return "--:--"
        minutes, seconds = divmod(round(progress.seconds * (1.0 - done) / done), 60)
        return f"{minutes:02d}:{seconds:02d}"


def session_settings(depsgraph):
    """The scene's settings as the library's."""
    scene, view_layer = depsgraph.scene, depsgraph.view_layer
    own = scene.sppm
    return replace(
        _settings(scene),
        # An iteration is a sample a pixel.
        iterations=view_layer.samples or own.iterations,
        time_limit=own.time_limit, write_interval=own.write_interval, **render_result.data_settings(scene, view_layer),
        snapshot_path=_snapshot_path(scene, view_layer) if own.write_interval > 0 else "",
        passes=frozenset(render_result.requested_passes(view_layer) + render_result.measured_passes(own.write_interval > 0)))


def viewport_settings(scene):
    """Those for a viewport: its own iterations, and the picture alone."""
    return replace(_settings(scene), iterations=scene.sppm.viewport_iterations)


def _settings(scene):
    """What every picture of a scene shares."""
    names = ("photons_per_iteration", "indirect", "radius_rule", "initial_radius", "gamma", "max_depth", "pixel_filter",
             "filter_width", "seed")
    return native.Settings(
        **{name: getattr(scene.sppm, name) for name in names},
        # `blender -t N` makes the mode FIXED for Blender's own renderers by the same property.
        threads=scene.render.threads if scene.render.threads_mode == "FIXED" else 0,
        transparent_film=scene.render.film_transparent)


def _snapshot_path(scene, view_layer):
    """Beside the frame's output file: `NAME0001.exr` -> `NAME0001.sppm.exr`, with the layer's name where there are several."""
    path = Path(scene.render.frame_path(frame=scene.frame_current)).absolute()
    layer = f".{bpy.path.clean_name(view_layer.name)}" if len(scene.view_layers) > 1 else ""
    # Blender makes the output's folder only when it saves.
    path.parent.mkdir(parents=True, exist_ok=True)
    name = path.stem if scene.render.use_file_extension else path.name
    return str(path.with_name(f"{name}{layer}.sppm.exr"))


def _print_stamp(progress, info):
    """One line by which scripts tell that this engine rendered, and how much; one of where the time went."""
    megabytes = (progress.memory_bytes + info["memory_bytes"]) / 2**20
    print(f"SPPM: rendered {progress.iteration} iterations, {progress.photons_emitted} photons, {progress.seconds:.3f} s, "
          f"{megabytes:.1f} MB", flush=True)
    rays = progress.rays_camera + progress.rays_shadow + progress.rays_photon
    print(f"SPPM: camera {progress.seconds_camera:.2f} s, photons {progress.seconds_photons:.2f} s, "
          f"grid {progress.seconds_grid:.2f} s, gather {progress.seconds_gather:.2f} s; "
          f"{rays / max(progress.seconds, 1e-9) / 1e6:.2f} Mrays/s; indirect light by {progress.indirect.lower()}", flush=True)
    if progress.dropped_samples:
        print(f"SPPM: {progress.dropped_samples} samples were not finite and were left out", flush=True)


def _stop_renders():
    """Ends what renders in other threads: Blender crashes where the engine is taken from under a render."""
    if not _under_way:
        return
    for render in list(_under_way):
        render.stop()
    end = time.monotonic() + _PATIENCE_SECONDS
    while _under_way and time.monotonic() < end:
        time.sleep(_POLL_SECONDS)
    time.sleep(_GOODBYE_SECONDS)


def register():
    bpy.utils.register_class(SppmRenderEngine)


def unregister():
    live_view.stop_all()
    _stop_renders()
    bpy.utils.unregister_class(SppmRenderEngine)
