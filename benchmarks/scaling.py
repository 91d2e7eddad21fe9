"""Does cost grow in proportion to what is asked for, and does a scene pay for what it does not use?

    ./dev bench scaling                                        # about six minutes on a quiet machine
    ./dev bench scaling pixels --sizes 256 512 1024 2048 4096  # one table, with pictures of 17 million pixels: 9 GB

CPU times are of one thread, of the second iteration of a session (the first finds the radii and the number of photons), the median of
several seeds where that is quick. What is compared runs in turns. "Times the least" is the cost of a pixel, a photon or a triangle in
proportion to the least in its table: 1 all over would be exactly linear. Threads are judged by wall time, so by a quiet machine only.
All is written to build/bench/scaling.md as well.
"""

import argparse
import ctypes
import os
import resource
import statistics
import subprocess
import time
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import environment
import jobs
import numpy as np
import scaling_scenes
from markdown_table import table_head, table_row
from sppm import native
from turns import in_turns, median_ratio
from variants import VARIANTS

_SCENES = ("cornell_glass", "pool")  # a closed room and an open one, both with caustics
_SIZE = 512  # of pictures where size is not the question
_FEW_PHOTONS = 1 / 64  # a pixel; what such an iteration costs is not the photons
_STEPS = ("camera", "photons", "grid", "gather")
_THREADS = (1, 2, 4, 8)
_TURNS = 6
_PHOTON_SEEDS = 3  # less where there are so many photons that it takes long
_TRIANGLES = 2_000_000
_BUILDS = 3


# ---------------------------------------------------------------- how it is measured


def second_iteration(desc, seeds, **settings):
    """Of the second iteration, medians over so many seeds: CPU seconds and the system's part of them, bytes told and at the peak,
    photons sent and stored."""
    with native.Scene(desc) as scene:
        told = [_second(scene, native.Settings(seed=seed, threads=1, **settings)) for seed in range(seeds)]
    return {name: statistics.median(one[name] for one in told) for name in told[0]}


def _second(scene, settings):
    before = _reset_peak()
    with native.Session(scene, settings) as session:
        session.step()
        first, begin = session.progress(), resource.getrusage(resource.RUSAGE_SELF)
        session.step()
        end, then = resource.getrusage(resource.RUSAGE_SELF), session.progress()
        system = end.ru_stime - begin.ru_stime
        return {"seconds": end.ru_utime - begin.ru_utime + system, "system": system,
                "bytes": then.memory_bytes, "peak": _memory("VmHWM") - before,
                "sent": then.photons_emitted - first.photons_emitted, "stored": then.photons_stored - first.photons_stored}


def _reset_peak():
    """Begins a new peak of this process's memory; its bytes now, without what earlier sessions freed."""
    ctypes.CDLL(None).malloc_trim(0)
    Path("/proc/self/clear_refs").write_text("5")
    return _memory("VmRSS")


def _memory(name):
    """Bytes, by a line of Linux's status of this process."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return 1024 * next(int(line.split()[1]) for line in lines if line.startswith(name))


def _clocks():
    """Seconds by the wall's clock and of CPU time."""
    return np.array([time.perf_counter(), time.process_time()])


def exported(name):
    """A scene of blend_scenes, as SceneDesc."""
    return jobs.export(name, _SIZE, 1)[0]


# ---------------------------------------------------------------- tables


def linear_table(what, unit, rows):
    """A row (label, count, seconds, *others) each: what a unit costs, and how many times the least of them.

    `what` names the label's column and those of the others.
    """
    least = min(seconds / count for _, count, seconds, *_ in rows)
    label, *others = what
    yield from table_head((label, f"{unit}s", "CPU s", f"ns a {unit}", "times the least", *others))
    for name, count, seconds, *rest in rows:
        cost = seconds / count
        yield table_row((name, f"{count:,.0f}", f"{seconds:.3g}", f"{1e9 * cost:.0f}", f"{cost / least:.2f}", *rest))


def pixels(options):
    """An iteration by the number of pixels."""
    for name in _SCENES:
        desc, rows = exported(name), []
        for size in options.sizes:
            told = second_iteration(scaling_scenes.at_size(desc, size), _seeds_for(size))
            count = size**2
            rows.append((f"{size}x{size}", count, told["seconds"], f"{told['system'] / told['seconds']:.1%}",
                         f"{told['sent'] / count:.2f}", f"{told['bytes'] / count:.0f}", f"{told['peak'] / count:.0f}"))
        yield from ("", f"### Pixels: `{name}`")
        yield from linear_table(("picture", "of it system", "photons a pixel", "bytes a pixel", "at the peak"), "pixel", rows)


def _seeds_for(size):
    return max(1, min(5, 2**21 // size**2))


def photons(options):
    """An iteration by the number of photons: what it takes beyond one with hardly any. AUTO would not use those few for all light."""
    yield from ("", f"### Photons: `{_SCENES[0]}`, {_SIZE}x{_SIZE}, beyond an iteration with {_FEW_PHOTONS:g} a pixel")
    desc, rows = exported(_SCENES[0]), []

    def with_photons(share, seeds):
        return second_iteration(desc, seeds, indirect="PHOTONS", photons_per_iteration=int(share * _SIZE**2))

    few = with_photons(_FEW_PHOTONS, _PHOTON_SEEDS)
    for share in options.photons:
        told = with_photons(share, _PHOTON_SEEDS if share < 16 else 1)
        sent = told["sent"] - few["sent"]
        rows.append((f"{share:g}", sent, told["seconds"] - few["seconds"], f"{told['stored'] / told['sent']:.2f}",
                     f"{(told['bytes'] - few['bytes']) / sent:.0f}", f"{(told['peak'] - few['peak']) / sent:.0f}"))
    yield from linear_table(("a pixel", "stored", "bytes a photon", "at the peak"), "photon", rows)


def threads(options):
    """Wall time of an iteration by threads, of the whole and of its steps."""
    yield from ("", f"### Threads: {_SIZE}x{_SIZE}, wall time, {os.cpu_count()} cores")
    yield from table_head(("scene", "threads", "ms", "speed-up", *_STEPS, "CPU time", "picture"))
    for name in _SCENES:
        for count, told in zip(_THREADS, _by_threads(exported(name))):
            yield table_row((name, count, f"{1e3 * told['wall']:.0f}", *(f"{value:.2f}" for value in told["gains"]),
                             f"{told['cpu']:.2f}", "same bits" if told["same"] else "DIFFERS"))


def _by_threads(desc):
    """What each number of threads brings: `gains` of the whole and each step, `cpu` time as a multiple of one thread's."""
    with ExitStack() as stack:
        scene = stack.enter_context(native.Scene(desc))
        sessions = [stack.enter_context(native.Session(scene, native.Settings(threads=count))) for count in _THREADS]
        both = in_turns(sessions, _TURNS, _clocks)
        told = [session.progress() for session in sessions]
        pictures = [session.read_pass("Combined") for session in sessions]
    walls, cpus = ([[pair[i] for pair in own] for own in both] for i in (0, 1))
    names = ("seconds", *(f"seconds_{step}" for step in _STEPS))
    for own, cpu, progress, picture in zip(walls, cpus, told, pictures):
        whole, *steps = (getattr(told[0], name) / getattr(progress, name) for name in names)
        yield {"wall": statistics.median(own), "gains": (1 / median_ratio(own, walls[0]), *steps),
               "cpu": median_ratio(cpu, cpus[0]), "same": np.array_equal(picture, pictures[0])}


def features(options):
    """What a scene without caustics and textures pays for either."""
    desc = exported("cornell_diffuse")
    plain = native.Settings(threads=1)
    yield from ("", f"### What is not used: `cornell_diffuse`, {_SIZE}x{_SIZE}, CPU time by that of the first line")
    yield from table_head(("variant", "ms", "ratio", "picture"))
    variants = {"as it is": (desc, plain), "caustics not asked for (`aim_photons` off)": (desc, replace(plain, aim_photons=False)),
                "UVs that nothing reads": (scaling_scenes.with_uvs(desc), plain),
                "white textures of one pixel": (scaling_scenes.textured(desc), plain)}
    yield from _compared(variants)
    with native.Scene(desc) as scene, native.Session(scene, replace(plain, indirect="PATHS")) as session:
        session.step()
        caustic = session.progress().photons_emitted
    uvs = sum(mesh.corner_uvs is not None for mesh in desc.meshes)
    yield from ("", f"Photons sent for caustics: {caustic}. Meshes exported with UVs: {uvs} of {len(desc.meshes)}.")


def _compared(variants):
    with ExitStack() as stack:
        sessions = [stack.enter_context(native.Session(stack.enter_context(native.Scene(desc)), settings))
                    for desc, settings in variants.values()]
        times = in_turns(sessions, 2 * _TURNS)
        pictures = [session.read_pass("Combined").astype(np.float64) for session in sessions]
    for name, own, picture in zip(variants, times, pictures):
        apart = np.sqrt(np.mean((picture - pictures[0]) ** 2)) / np.mean(pictures[0])
        shown = "same bits" if apart == 0 else f"apart {apart:.1e}"
        yield table_row((name, f"{1e3 * statistics.median(own):.0f}", f"{median_ratio(own, times[0]):.3f}", shown))


def start_up(options):
    """Building large meshes and many instances, and exporting them."""
    yield from ("", "### Start-up: one mesh")
    rows = []
    for share in (1 / 16, 1 / 4, 1):
        told = _built(share * _TRIANGLES, 1)
        count = told["triangles"]
        rows.append((f"{count / 1e6:.3g} million", count, told["cpu"], f"{told['bytes'] / count:.0f}", f"{told['peak'] / count:.0f}"))
    yield from linear_table(("mesh", "bytes a triangle", "at the peak"), "triangle", rows)
    yield from ("", f"### Start-up: instances of a mesh of {_TRIANGLES:,} triangles")
    yield from table_head(("instances", "export wall s", "build CPU s", "build wall s", "MB", "MB at the peak"))
    for count in (1, 2, 1000):
        told = _built(_TRIANGLES, count)
        yield table_row((count, f"{_exported_seconds(count):.2f}", f"{told['cpu']:.2f}", f"{told['wall']:.2f}",
                         f"{told['bytes'] / 1e6:.1f}", f"{told['peak'] / 1e6:.1f}"))


def _built(triangles, instances):
    """The build of a scene on one thread: seconds, bytes told and at the peak; medians of several builds."""
    desc = scaling_scenes.large(triangles, instances)
    builds = [_build(desc) for _ in range(_BUILDS)]
    return {name: statistics.median(one[name] for one in builds) for name in builds[0]}


def _build(desc):
    before, begin = _reset_peak(), _clocks()
    with native.Scene(desc, threads=1) as scene:
        wall, cpu = _clocks() - begin
        return {"wall": wall, "cpu": cpu, "bytes": scene.info()["memory_bytes"], "peak": _memory("VmHWM") - before,
                "triangles": len(desc.meshes[0].indices)}


def _exported_seconds(count):
    """Wall seconds of the export in the system's Blender."""
    blend = environment.OUT / "scenes" / "large.blend"
    maker = [*environment.blender_command("system"), str(Path(__file__).with_name("make_large.py")), "--"]
    subprocess.run([*maker, str(blend), str(_TRIANGLES), str(count)], check=True, stdout=subprocess.DEVNULL)
    _, told = jobs.render(VARIANTS["sppm"], blend, "", 16, 1, 0.01, 0, blend.with_suffix(".npy"))
    blend.unlink()
    return told["export"]


# ---------------------------------------------------------------- command

_TABLES = {"pixels": pixels, "photons": photons, "threads": threads, "features": features, "start_up": start_up}


def main():
    options = _options()
    lines = []
    for name in options.tables or _TABLES:
        for line in _TABLES[name](options):
            print(line, flush=True)
            lines.append(line)
    environment.OUT.mkdir(parents=True, exist_ok=True)
    (environment.OUT / "scaling.md").write_text("\n".join(lines) + "\n")


def _options():
    parser = argparse.ArgumentParser(prog="./dev bench scaling", description="Whether cost grows in proportion to what is asked for.")
    parser.add_argument("tables", nargs="*", metavar="TABLE", help=f"of {', '.join(_TABLES)}; without any, all")
    parser.add_argument("--sizes", nargs="+", type=int, default=[256, 512, 1024, 2048], help="of the square pictures")
    parser.add_argument("--photons", nargs="+", type=float, default=[0.25, 1, 4, 16, 64], metavar="COUNT", help="a pixel")
    options = parser.parse_args()
    unknown = set(options.tables) - set(_TABLES)
    if unknown:
        parser.error(f"no such table: {', '.join(sorted(unknown))}; there are {', '.join(_TABLES)}")
    return options


if __name__ == "__main__":
    main()
