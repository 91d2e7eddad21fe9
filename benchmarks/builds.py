"""Does a change make iterations faster? CPU time of an iteration in several builds of the library, in turns.

    ./dev bench builds old.so new.so --scenes cornell_glass pool --resolution 512

All builds render the same scene in this process, on one thread, one iteration after the other, so that a busy machine hurts them
alike. Each line tells the median of an iteration's CPU time, that of its ratio to the first build's in the same turn, and how far
the picture is from the first build's.
"""

import argparse
import statistics
import time
from contextlib import ExitStack
from pathlib import Path

import environment
import jobs
import numpy as np
from sppm import native

_WARM_UP = 4  # iterations that are not counted: the first ones find their radii and fill caches


def main():
    options = _options()
    for name in options.scenes:
        desc_path = environment.OUT / "scenes" / f"{name}-{options.resolution}.pickle"
        desc_path.parent.mkdir(parents=True, exist_ok=True)
        desc = jobs.export(environment.scene_file(name), options.resolution, 1, desc_path)
        times, pictures = _run(desc, options.libraries, options.turns)
        for library, own, picture in zip(options.libraries, times, pictures):
            ratio = statistics.median(mine / first for mine, first in zip(own, times[0]))
            apart = np.sqrt(np.mean((picture - pictures[0]) ** 2)) / np.mean(pictures[0])
            milliseconds = 1e3 * statistics.median(own)
            print(f"{name:16} {library.name:24} {milliseconds:8.1f} ms   ratio {ratio:.3f}   apart {apart:.1e}", flush=True)


def _run(desc, libraries, turns):
    """CPU seconds of each iteration, and the pictures, of each library."""
    settings = native.Settings(iterations=_WARM_UP + turns, threads=1)
    with ExitStack() as stack:
        scenes = [stack.enter_context(native.Scene(desc, library_path=library)) for library in libraries]
        sessions = [stack.enter_context(native.Session(scene, settings)) for scene in scenes]
        times = [[] for _ in libraries]
        for turn in range(_WARM_UP + turns):
            order = list(zip(sessions, times))
            for session, own in order if turn % 2 else reversed(order):
                begin = time.process_time()
                session.step()
                own.append(time.process_time() - begin)
        pictures = [session.read_pass("Combined").astype(np.float64) for session in sessions]
    return [own[_WARM_UP:] for own in times], pictures


def _options():
    about = "CPU time of an iteration in several builds, in turns."
    parser = argparse.ArgumentParser(prog="./dev bench builds", description=about)
    first = "the first is what the others are compared with"
    parser.add_argument("libraries", nargs="+", type=Path, metavar="LIBSPPM.SO", help=first)
    parser.add_argument("--scenes", nargs="+", default=["cornell_glass", "pool"], metavar="NAME", help="of blend_scenes")
    parser.add_argument("--resolution", type=int, default=512, help="of the square pictures")
    parser.add_argument("--turns", type=int, default=10, help="iterations of each build")
    return parser.parse_args()


if __name__ == "__main__":
    main()
