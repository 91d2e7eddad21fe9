"""Prints the tables of docs/accuracy.md, by the same measurements that the tests make.

    ./dev bench accuracy [--quick] [TABLE...]

README.md tells the method. Tables are written as Markdown; progress goes to stderr.
"""

import argparse
import os
import pickle
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests"), str(ROOT / "tests" / "render")]
import conftest  # noqa: E402, F401  # makes the staged add-on and the folders of the tree importable

import caustic_forms  # noqa: E402
import caustic_scenes  # noqa: E402
import consistency  # noqa: E402
import framings  # noqa: E402
import leaks  # noqa: E402
import numpy as np  # noqa: E402
from scenes import furnished_room, student_limit  # noqa: E402


def print_table(title, columns, rows):
    """Markdown; a row may come from a generator, so that it is seen as soon as it is known."""
    print(f"\n### {title}\n\n| {' | '.join(columns)} |\n|{'---|' * len(columns)}", flush=True)
    for row in rows:
        print(f"| {' | '.join(map(str, row))} |", flush=True)


# ---------------------------------------------------------------- tables


def caustics(quick):
    """Every source on every caster, against the light tracer."""
    settings = caustic_scenes.QUICK if quick else caustic_scenes.DETAILED

    def rows():
        for caster, surface in caustic_scenes.CASTERS.items():
            for source, lamp in caustic_scenes.SOURCES.items():
                found = caustic_scenes.compare(lamp, surface, **settings)
                limit = student_limit(found.expected.size, len(found.found) - 1)
                ratio, error = found.ratio()
                yield (caster, source, f"{ratio:.4f} ± {error:.4f}", f"{found.deviations().max():.1f} ({limit:.1f})",
                       f"{found.error().mean() / found.expected.mean():.1%}", f"{found.blur.mean() / found.expected.mean():.1%}")

    print_table("Caustics against a light tracer",
                ("caster", "source", "flux, rendered / traced", "largest block deviation, σ (limit)", "noise of a block",
                 "blur of a block"), rows())


def forms(quick):
    """Closed forms; quick and full are the same."""
    def rows():
        yield from (row(name, *measure()) for name, measure in (
            ("flux in a lens's focus", caustic_forms.flux_in_focus),
            ("the same, narrower than the first radius, 64 iterations", caustic_forms.flux_in_narrow_focus),
            ("irradiance halfway to the focus", caustic_forms.halfway_to_focus),
            ("irradiance in the sun's image", caustic_forms.image_of_the_sun)))
        for curve in (caustic_forms.nephroid, caustic_forms.cardioid):
            (cusps, place), (irradiance, one) = curve()
            yield row(f"{curve.__name__}: distance of the cusp from the axis, in radii", cusps / caustic_forms.RADIUS,
                      place / caustic_forms.RADIUS)
            yield row(f"{curve.__name__}: irradiance along the axis", irradiance, one)

    def row(name, values, expected):
        return name, f"{values.mean():.4g} ± {values.std(ddof=1) / np.sqrt(len(values)):.1g}", f"{expected:.4g}", \
            f"{values.mean() / expected - 1:+.1%}"

    print_table("Caustics with closed forms", ("what", "found", "expected", "off"), rows())


def consistent(quick):
    """A room, and every file of blend_scenes."""
    def rows():
        yield from regions("room of the tests", furnished_room().desc, 1)
        if not quick:
            for name, desc in blend_scenes():
                yield from regions(name, desc, 4)

    def regions(name, desc, first):
        settings = dict(photons_per_iteration=3000) if first == 1 else {}
        found = consistency.measure(desc, first=first, **settings)
        for region, errors in found.errors.items():
            yield name, region, found.pixels[region], *(f"{e:.3f}" for e in errors), f"{found.slope(region):.2f}"

    print_table("Relative RMSE by the number of photons", ("scene", "where", "pixels", "× 1", "× 4", "× 16", "× 64", "slope"),
                rows())


def blend_scenes():
    """(name, SceneDesc) of each file, exported by Blender."""
    blender = [os.environ.get("BLENDER", "blender"), "-b", "--factory-startup", "--python-exit-code", "1"]
    export = ["--python", str(ROOT / "benchmarks" / "export_scenes.py"), "--"]
    with tempfile.TemporaryDirectory() as folder:
        for file in sorted((ROOT / "blend_scenes").glob("*.blend")):
            size = str(consistency.size_of(file.stem))
            subprocess.run([*blender, *export, folder, size, str(file)], check=True, stdout=subprocess.DEVNULL)
            yield file.stem, pickle.loads(Path(folder, f"{file.stem}.pickle").read_bytes())


def leaking(quick):
    """Beside thin walls and in corners."""
    settings = dict(reach=1.0, seeds=2 if quick else 4)
    later = dict(settings, iterations=16 if quick else 64, photons_per_iteration=20_000, radius_rule="PASS_INDEXED")

    def rows():
        for thickness in (0.0, 0.25, 0.5, 0.75, 1.0):
            _, first = leaks.through_wall(thickness, **settings)
            _, last = leaks.through_wall(thickness, **later)
            shares = leaks.beyond(thickness), first[0], first.mean(), last[0], last.mean()
            yield thickness, *(f"{share:.1%}" for share in shares)

    print_table("Light on the dark side of a wall, as a share of the lit side's",
                ("thickness, radii", "geometry, at the wall", "first pass: at the wall", "mean of one radius",
                 f"after {later['iterations']} iterations: at the wall", "mean of one first radius"), rows())
    first, last = (leaks.in_corner(**s)[1] for s in (settings, later))
    print_table("Light in a corner, as a share of what is right", ("", "at the edge", "mean of one first radius"),
                ((name, f"{x[0]:.0%}", f"{x.mean():.0%}") for name, x in (("first pass", first), ("later", last))))


def radii(quick):
    """Scenes from 10 cm to 1 km, all settings as they come."""
    settings = dict() if quick else dict(iterations=64, seeds=4)

    def rows():
        for name, framing in framings.FRAMINGS.items():
            q = framings.quality(framing(), **settings)
            yield (name, f"{q.radius:.1f}", f"{q.picture:.4f}", f"{q.caustic:.4f}", f"{q.best:.4f} (× {q.best_factor:g})",
                   f"{q.picture / q.best:.2f}")

    print_table(f"The automatic first radius, relMSE after {settings.get('iterations', 16)} iterations",
                ("scene", "radius, pixels", "picture", "caustic", "best of five fixed radii", "ratio"), rows())


TABLES = {"caustics": caustics, "forms": forms, "consistency": consistent, "leaks": leaking, "radii": radii}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=f"{', '.join(TABLES)}; all if none is named")
    parser.add_argument("--quick", action="store_true", help="two minutes instead of twenty, with more noise")
    options = parser.parse_args()
    if unknown := set(options.tables) - set(TABLES):
        parser.error(f"no such table: {', '.join(sorted(unknown))}")
    for name in options.tables or TABLES:
        started = time.monotonic()
        TABLES[name](options.quick)
        print(f"accuracy: {name} took {time.monotonic() - started:.0f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
