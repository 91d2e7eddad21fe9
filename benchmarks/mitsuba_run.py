"""Renders an exported scene with mitsuba: run by jobs.py as `mitsuba_run.py -- JOB.json`; prints one line `BENCH {...}`.

Where mitsuba cannot express the scene, that line says why; mitsuba_scene.py tells what it can.
"""

import json
import sys
import tempfile
import time
from pathlib import Path

import drjit
import jobs
import mitsuba as mi
import numpy as np
from mitsuba_scene import scene_dict

_PASS_SAMPLES = 4  # per pixel between two looks at the clock


def main(job):
    mi.set_variant("scalar_rgb")
    drjit.set_thread_count(job["threads"])
    wall, cpu = time.perf_counter(), time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        try:
            scene = mi.load_dict(scene_dict(jobs.load_desc(job["desc"]), job["settings"], Path(folder)))
        except jobs.CannotExpressError as reason:
            _answer({"cannot_express": str(reason)})
            return
    pictures = []
    while not pictures or time.perf_counter() - wall < job["budget"]:
        seed = job["seed"] * 100_000 + len(pictures)
        pictures.append(np.array(mi.render(scene, spp=_PASS_SAMPLES, seed=seed), np.float64)[::-1, :, :3])
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    np.save(job["output"], np.mean(pictures, 0).astype(np.float32))
    _answer({"wall": wall, "cpu": cpu, "samples": _PASS_SAMPLES * len(pictures)})


def _answer(told):
    # Mitsuba's progress bar leaves its line open.
    print(f"\nBENCH {json.dumps(told)}", flush=True)


if __name__ == "__main__":
    main(json.loads(Path(sys.argv[sys.argv.index("--") + 1]).read_text()))
