"""An iteration's time against the bare Embree time of the rays that it traces.

The iteration is timed in the product's library, on one thread. The library with the recorder (native/) renders the same one,
notes its rays and traces them again through Embree alone. Both are repeated in turns and measured by CPU time, so that a busy
machine hurts little.
"""

import statistics
import subprocess
import time
from ctypes import byref, c_uint64
from dataclasses import dataclass

from environment import ROOT
from sppm import native
from sppm.native_library import library

_BUILD = ROOT / "build" / "release"
_LIBRARY = _BUILD / "benchmarks" / "native" / "libsppm_record.so"
_WARM_UP = 4  # iterations before the one that is recorded: the first ones find their radii and fill caches


@dataclass(frozen=True)
class Replay:
    """Of one iteration on one thread: rays, and CPU seconds of the iteration and of Embree alone, medians over the turns."""

    rays: int
    iteration_seconds: float
    embree_seconds: float

    @property
    def ratio(self):
        return self.iteration_seconds / self.embree_seconds


def build_recorder():
    """Builds the library with the recorder from the objects of the product's."""
    for arguments in ("--preset release -DSPPM_BENCHMARKS=ON", "--build --preset release --target sppm_record"):
        done = subprocess.run(["cmake", *arguments.split()], cwd=ROOT, text=True, capture_output=True)
        if done.returncode:
            raise RuntimeError(f"cmake failed:\n{done.stdout}{done.stderr}")


def replay(desc, settings, turns=5):
    """Times iterations of the scene and the replay of one; `settings` is a dict of native.Settings."""
    settings = native.Settings(**{**settings, "threads": 1})
    with _Recorded(desc, settings) as recorded, native.Scene(desc) as scene, native.Session(scene, settings) as session:
        for _ in range(_WARM_UP):
            session.step()
        steps, replays = [], []
        for _ in range(turns):
            steps.append(_cpu_seconds(session.step))
            replays.append(_cpu_seconds(recorded.replay))
        return Replay(recorded.rays, statistics.median(steps), statistics.median(replays))


def _cpu_seconds(work):
    begin = time.process_time()
    work()
    return time.process_time() - begin


class _Recorded:
    """One recorded iteration and the scene that its rays belong to."""

    def __init__(self, desc, settings):
        self._scene = native.Scene(desc, library_path=_LIBRARY)
        self._lib = library(_LIBRARY)
        self._lib.record_replay.restype = c_uint64
        with native.Session(self._scene, settings) as session:
            for _ in range(_WARM_UP):
                session.step()
            before = session.progress()
            self._lib.record_begin()
            session.step()
            self._lib.record_end()
            self.rays = self._check(before, session.progress())
        self._hits = None

    def _check(self, before, after):
        """The number of rays; every one that the renderer counted must have been recorded."""
        intersect, occluded = c_uint64(), c_uint64()
        self._lib.record_count(byref(intersect), byref(occluded))
        names = ("rays_camera", "rays_shadow", "rays_photon")
        counted = sum(getattr(after, name) - getattr(before, name) for name in names)
        recorded = intersect.value + occluded.value
        if recorded != counted:
            raise RuntimeError(f"the renderer counted {counted} rays, native/record.cpp {recorded}: a call that it lacks?")
        return recorded

    def replay(self):
        """Traces the recorded rays through Embree alone; they must hit as often as the time before."""
        hits = self._lib.record_replay()
        if self._hits not in (None, hits):
            raise RuntimeError(f"a replay hits {hits} times, the one before hit {self._hits} times")
        self._hits = hits

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._scene.close()
