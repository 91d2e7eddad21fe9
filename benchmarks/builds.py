"""Does a change make iterations faster? CPU time of an iteration in several builds of the library, in turns.

    ./dev bench builds old.so new.so --scenes cornell_glass pool --resolution 512

All builds render the same scene in this process, on one thread, one iteration after the other, so that a busy machine hurts them
alike. Each line tells the median of an iteration's CPU time, that of its ratio to the first build's in the same turn, and how far
the picture is from the first build's.
"""

import argparse
import statistics
from contextlib import ExitStack
from pathlib import Path

import jobs
import numpy as np
from sppm import native
from turns import in_turns, median_ratio

_WARM_UP = 4  # iterations that are not counted: the first ones find their radii and fill caches


def main():
    options = _options()
    for name in options.scenes:
        desc, _ = jobs.export(name, options.resolution, 1)
        times, pictures = _run(desc, options.libraries, options.turns)
        for library, own, picture in zip(options.libraries, times, pictures):
            ratio = median_ratio(own, times[0])
            apart = np.sqrt(np.mean((picture - pictures[0]) ** 2)) / np.mean(pictures[0])
            milliseconds = 1e3 * statistics.median(own)
            print(f"{name:16} {library.name:24} {milliseconds:8.1f} ms   ratio {ratio:.3f}   apart {apart:.1e}", flush=True)


def _run(desc, libraries, turns):
    """CPU seconds of each iteration, and the pictures, of each library."""
    settings = native.Settings(iterations=_WARM_UP + turns, threads=1)
    with ExitStack() as stack:
        scenes = [stack.enter_context(native.Scene(desc, library_path=library)) for library in libraries]
        sessions = [stack.enter_context(native.Session(scene, settings)) for scene in scenes]
        times = in_turns(sessions, turns, warm_up=_WARM_UP)
        pictures = [session.read_pass("Combined").astype(np.float64) for session in sessions]
    return times, pictures


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
