"""Error against time, for scenes, renderers and budgets; or where an iteration's time goes.

    ./dev bench speed [--scenes NAME ...] [--variants NAME ...] [--budgets SECONDS ...] [--repeats N]
    ./dev bench speed --split

The tables, plots and references go to build/bench; docs/performance.md tells the method.
"""

import argparse
import os

import environment
from variants import VARIANTS


def main():
    options = _options()
    environment.enter()
    if options.split:
        import split

        split.run(options.scenes, options.resolution, options.threads)
    else:
        import error_over_time

        error_over_time.run(options)


def _options():
    parser = argparse.ArgumentParser(prog="./dev bench speed", description="Error against time; see docs/performance.md.")
    scenes = sorted(path.stem for path in environment.SCENES.glob("*.blend"))
    parser.add_argument("--scenes", nargs="+", default=scenes, choices=scenes, metavar="NAME", help=", ".join(scenes))
    variants = list(VARIANTS)
    parser.add_argument("--variants", nargs="+", default=variants, choices=variants, metavar="NAME", help=", ".join(variants))
    parser.add_argument("--budgets", nargs="+", type=float, default=[5.0, 15.0, 60.0], metavar="SECONDS")
    parser.add_argument("--repeats", type=int, default=3, help="renders of each, with different seeds")
    parser.add_argument("--resolution", type=int, default=256, help="of the square pictures")
    parser.add_argument("--threads", type=int, default=os.cpu_count(), help="for every renderer")
    parser.add_argument("--reference-seconds", type=float, default=120.0, help="for each half of a reference")
    parser.add_argument("--cross-check", action="store_true", help="compare references without caustics with Cycles")
    parser.add_argument("--keep", action="store_true", help="keep what is in speed.csv and run only what is missing")
    parser.add_argument("--split", action="store_true", help="tell where an iteration's time goes, and nothing else")
    options = parser.parse_args()
    for variant in options.variants:
        environment.blender_command(VARIANTS[variant].blender)  # fails now, not after an hour, where one is missing
    return options


if __name__ == "__main__":
    main()
