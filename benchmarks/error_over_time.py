"""Runs all renders of the speed benchmark, measures them, and reports after every scene."""

import itertools

import jobs
import plots
import tables
from environment import OUT, ROOT, scene_file
from measure import REGIONS, measure
from reference import compare, reference
from results import Results
from variants import VARIANTS


def run(options):
    """Renders what is missing of `options.scenes`, `variants`, `budgets` and `repeats`; see speed.py for the others."""
    results = Results(options.keep)
    told = {}
    for name in options.scenes:
        told[name] = _run_scene(name, options, results)
        tables.write_references(told)
        tables.write_tables(results.rows)
        plots.draw_plots(results.rows, told)
    print(f"tables and plots are in {OUT.relative_to(ROOT)}")


def _run_scene(name, options, results):
    """All renders of one scene that are not there yet; what the reference tells of itself."""
    blend = scene_file(name)
    desc, desc_path = jobs.export(name, options.resolution, options.threads)
    truth, told = reference(name, blend, desc, options.reference_seconds, options.threads)
    place = {"blend": blend, "desc_path": desc_path, "resolution": options.resolution, "threads": options.threads}
    if options.cross_check and not truth.caustic.any():
        told["cycles"] = _cross_check(name, truth, place, options.reference_seconds)
    unable = set()
    for key in _plan(name, options):
        if results.has(**key) or key["variant"] in unable:
            continue
        try:
            _run_one(key, place, truth, results)
        except jobs.CannotExpressError as reason:
            print(f"{name:16} {key['variant']:18} cannot render this scene: {reason}", flush=True)
            unable.add(key["variant"])
    return told


def _plan(scene, options):
    """Keys of all renders: the variants take turns, and each round another one begins."""
    for number, (repeat, budget) in enumerate(itertools.product(range(options.repeats), options.budgets)):
        first = number % len(options.variants)
        for variant in options.variants[first:] + options.variants[:first]:
            yield {"scene": scene, "variant": variant, "resolution": options.resolution, "threads": options.threads,
                   "budget": budget, "repeat": repeat}


def _run_one(key, place, truth, results):
    output = OUT / "pictures" / key["scene"] / f"{key['variant']}-{key['budget']:g}.npy"
    output.parent.mkdir(parents=True, exist_ok=True)
    picture, told = jobs.render(VARIANTS[key["variant"]], budget=key["budget"], seed=key["repeat"] + 1, output=output, **place)
    row = {**key, "wall": told["wall"], "cpu": told["cpu"], **measure(picture, truth)}
    results.add(row)
    errors = ", ".join(f"{region} {row[f'relmse_trimmed_{region}']:.2e}" for region in REGIONS)
    print(f"{key['scene']:16} {key['variant']:18} {key['budget']:6g} s #{key['repeat']}: "
          f"wall {row['wall']:.1f} s, cpu {row['cpu']:.1f} s, relMSE {errors}, FLIP {row['flip_all']:.4f}", flush=True)


def _cross_check(name, truth, place, seconds):
    """Squared relative difference to Cycles of the same Blender, without noise."""
    pictures = []
    for seed in (101, 102):
        output = OUT / "references" / f"{name}-cycles-{place['resolution']}-{seconds:g}-{seed}.npy"
        pictures.append(jobs.render(VARIANTS["cycles"], budget=seconds, seed=seed, output=output, **place)[0])
    return compare(truth, *pictures)
