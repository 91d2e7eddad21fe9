"""Where the time of a render and of an iteration goes, and how far an iteration is from the bare time of its rays."""

import csv

import jobs
from environment import OUT, scene_file
from markdown_table import table_head, table_row
from replay import build_recorder, replay
from variants import VARIANTS

_SECONDS = 5.0  # of the render that is split
_STEPS = ("camera", "photons", "grid", "gather")
_COLUMNS = ("scene", "resolution", "threads", "export", "build", "hand_over", "iterations", *_STEPS, "mrays_per_second",
            "rays_per_iteration", "iteration_one_thread", "embree_one_thread", "ratio")


def run(scenes, resolution, threads):
    """Writes split.csv and split.md to build/bench."""
    build_recorder()
    rows = []
    for name in scenes:
        rows.append(_split(name, resolution, threads))
        print(", ".join(f"{key} {_shown(value)}" for key, value in rows[-1].items()), flush=True)
        _write(rows)


def _split(name, resolution, threads):
    desc, desc_path = jobs.export(name, resolution, threads)
    _, told = jobs.render(VARIANTS["sppm"], scene_file(name), desc_path, resolution, threads, _SECONDS, 1, desc_path.with_suffix(".npy"))
    progress = told["progress"]
    rays = sum(progress[f"rays_{kind}"] for kind in ("camera", "shadow", "photon"))
    bare = replay(desc, {})
    return {"scene": name, "resolution": resolution, "threads": threads, "export": told["export"], "build": told["build"],
            "hand_over": told["hand_over"], "iterations": progress["iteration"],
            **{step: progress[f"seconds_{step}"] / progress["iteration"] for step in _STEPS},
            "mrays_per_second": rays / progress["seconds"] / 1e6, "rays_per_iteration": bare.rays,
            "iteration_one_thread": bare.iteration_seconds, "embree_one_thread": bare.embree_seconds, "ratio": bare.ratio}


def _write(rows):
    with (OUT / "split.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, _COLUMNS)
        writer.writeheader()
        writer.writerows(rows)
    lines = ["Seconds for a picture", *_table(rows, ("scene", "export", "build", "hand_over")), "",
             f"Milliseconds an iteration, {rows[0]['threads']} threads, {rows[0]['resolution']}x{rows[0]['resolution']}",
             *_table([_in_milliseconds(row) for row in rows], ("scene", *_STEPS, "mrays_per_second")), "",
             "One thread, CPU milliseconds an iteration, and Embree alone for the same rays",
             *_table([_in_milliseconds(row) for row in rows],
                     ("scene", "rays_per_iteration", "iteration_one_thread", "embree_one_thread", "ratio"))]
    (OUT / "split.md").write_text("\n".join(lines) + "\n")


def _in_milliseconds(row):
    times = (*_STEPS, "iteration_one_thread", "embree_one_thread")
    return {name: 1e3 * value if name in times else value for name, value in row.items()}


def _table(rows, columns):
    yield from table_head([column.replace("_", " ") for column in columns])
    for told in rows:
        yield table_row(_shown(told[column]) for column in columns)


def _shown(value):
    return f"{value:.3g}" if isinstance(value, float) else str(value)
