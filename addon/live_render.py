"""A progressive picture of a scene that changes, rendered in a thread of its own; no Blender here.

Whatever is asked for, a picture comes soon: a reduced one where the full one would take too long, which then follows, iteration
by iteration. What is asked for meanwhile cancels the iteration under way; only the first one, which is quick, is let finish, so
that a picture follows however fast changes come.
"""

import threading
import time
import traceback
from dataclasses import dataclass, replace

import numpy as np

from . import native
from .native_library import Cancelled, SppmError
from .scene_change import KeptScene, same_things
from .scene_desc import CameraDesc, SceneDesc
from .scene_validation import SceneError

_REDUCTIONS = (1, 2, 4, 8)  # pixels of the full picture to a side of a reduced one
_FIRST_REDUCTION = 4
_QUICK_SECONDS = 0.1  # that a reduced iteration may take, and a view must rest before the full picture begins
_SHOW_SECONDS = 0.2  # between pictures
_BRIGHTEST = 65504.0  # that a half float can hold


@dataclass(frozen=True, eq=False)
class Job:
    """What is to be rendered: `scene` without its camera."""

    scene: SceneDesc
    camera: CameraDesc
    settings: native.Settings


@dataclass(frozen=True, eq=False)
class Picture:
    """What a job gives after some iterations.

    Attributes:
        pixels: (height, width, 4) float32, premultiplied, bottom row first; fewer than the camera's if `is_reduced`.
    """

    pixels: np.ndarray
    job: Job
    iteration: int
    is_reduced: bool


class LiveRender:
    """Renders the newest job; `picture` and `error` tell how far it has come, and may be read from any thread."""

    def __init__(self):
        self.picture, self.error = None, ""
        self._lock = threading.RLock()  # for whatever Python frees in between may stop another one
        # What it guards:
        self._next, self._session, self._thread = None, None, None
        self._is_stopped, self._is_first = False, False
        # What only the thread touches:
        self._scene = KeptScene()
        self._seconds_per_pixel = 0.0
        self._decided = None  # (SceneDesc, how its indirect light is found)

    def start(self, job):
        """Begins a job in place of the one before. Returns at once."""
        with self._lock:
            self._next, self._is_stopped = job, False
            if not self._is_first:
                self._cancel()
            if self._thread is None:
                self._thread = threading.Thread(target=self._run, name="sppm live")
                self._thread.start()

    def stop(self):
        """Ends the rendering soon and frees the scene. Returns at once."""
        with self._lock:
            self._next, self._is_stopped = None, True
            self._cancel()
            if self._thread is None:
                self._scene.close()

    def wait(self):
        """Returns when nothing is being rendered any more."""
        thread = self._thread
        if thread:
            thread.join()

    @property
    def is_running(self):
        return self._thread is not None

    def _cancel(self):
        if self._session:
            self._session.cancel()

    # ------------------------------------------------ in the thread

    def _run(self):
        while True:
            with self._lock:
                job, self._next = self._next, None
                if job is None or self._is_ended():
                    if self._is_stopped:
                        self._scene.close()
                    self._thread = None
                    return
            try:
                self._render(job)
            except Cancelled:
                pass
            except (SppmError, SceneError, MemoryError) as error:
                self.error = str(error) or type(error).__name__
            except Exception as error:  # a bug of ours: the trace is for the report of it
                traceback.print_exc()
                self.error = f"{type(error).__name__}: {error}"

    def _is_ended(self):
        # Python waits for its threads at exit; it must not wait for this one to finish a picture that nobody will see.
        return self._is_stopped or not threading.main_thread().is_alive()

    def _is_over(self):
        """Whether the job under way is of no more use."""
        return self._next is not None or self._is_ended()

    def _render(self, job):
        self.error = ""
        reduction = self._reduction(job.camera)
        self._render_picture(job, reduction, is_first=True)
        if reduction > 1 and not self._is_over():
            self._render_picture(job, 1, is_first=False)

    def _settings(self, job, reduction):
        """Those of the job. Where things only moved, it is not decided again how indirect light is found: that takes time."""
        settings = job.settings
        if settings.indirect == "AUTO" and self._decided and same_things(self._decided[0], job.scene):
            settings = replace(settings, indirect=self._decided[1])
        return replace(settings, photons_per_iteration=-(-settings.photons_per_iteration // reduction**2))

    def _reduction(self, camera):
        """The least by which a picture must be smaller to take no longer than is quick."""
        if not self._seconds_per_pixel:
            return _FIRST_REDUCTION
        seconds = self._seconds_per_pixel * camera.width * camera.height
        return next((by for by in _REDUCTIONS if seconds / by**2 <= _QUICK_SECONDS), _REDUCTIONS[-1])

    def _render_picture(self, job, reduction, is_first):
        """All iterations of the full picture, or those of a reduced one that are quick."""
        settings = self._settings(job, reduction)
        scene = self._scene.get(job.scene, reduced(job.camera, reduction), settings.threads)
        with native.Session(scene, settings) as session:
            with self._lock:
                if self._is_ended() or (self._is_over() and not is_first):
                    return
                self._session, self._is_first = session, is_first
            try:
                self._iterate(session, job, reduction)
                if job.settings.indirect == "AUTO":
                    self._decided = job.scene, session.progress().indirect
            finally:
                with self._lock:
                    self._session, self._is_first = None, False

    def _iterate(self, session, job, reduction):
        begin = shown = time.monotonic()
        while True:
            session.step()
            progress, now = session.progress(), time.monotonic()
            if progress.iteration == 1:
                self._seconds_per_pixel = (now - begin) / (session.size[0] * session.size[1])
            is_last = progress.finished or self._is_over() or (reduction > 1 and now - begin > _QUICK_SECONDS)
            if progress.iteration == 1 or is_last or now - shown > _SHOW_SECONDS:
                pixels = np.minimum(session.read_pass("Combined"), _BRIGHTEST)
                self.picture = Picture(pixels, job, progress.iteration, reduction > 1)
                shown = time.monotonic()
            self._is_first = False
            if is_last:
                return


def reduced(camera, by):
    """The camera, which has no region, with so many times fewer pixels to a side of the same view."""
    return replace(camera, width=max(1, -(-camera.width // by)), height=max(1, -(-camera.height // by)))
