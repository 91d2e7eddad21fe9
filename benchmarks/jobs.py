"""Renders and exports in other processes: Blender of any version, and mitsuba."""

import json
import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from environment import OUT, STAGE, blender_command, scene_file

_HERE = Path(__file__).resolve().parent
_SLACK_SECONDS = 600  # of a process beyond its budget: start, export, and iterations that take longer than the budget


class JobError(RuntimeError):
    """A renderer failed; the message ends with what it printed last."""


class CannotExpressError(ValueError):
    """The scene has something that the renderer has not."""


def export(name, resolution, threads):
    """A scene of blend_scenes: (SceneDesc, the file that it is pickled in)."""
    output = OUT / "scenes" / f"{name}-{resolution}.pickle"
    output.parent.mkdir(parents=True, exist_ok=True)
    job = {"action": "export", "blend": str(scene_file(name)), "resolution": resolution, "threads": threads, "output": str(output)}
    _run([*blender_command("system"), str(_HERE / "blender_run.py")], job, 0.0)
    return load_desc(output), output


def load_desc(path):
    """A SceneDesc that `export` wrote."""
    return pickle.loads(Path(path).read_bytes())


def render(variant, blend, desc_path, resolution, threads, budget, seed, output):
    """Renders for about `budget` seconds.

    Args:
        desc_path: what `export` wrote of the same scene; mitsuba reads it.
        output: the picture, .npy.

    Returns:
        ((resolution, resolution, 3) float32, dict of what the renderer told; `wall` and `cpu` are seconds).

    Raises:
        CannotExpressError: this renderer cannot render this scene.
    """
    settings = dict(variant.settings)
    if variant.photons_per_pixel:
        settings["photons_per_iteration"] = variant.photons_per_pixel * resolution**2
    job = {"action": "render", "blend": str(blend), "desc": str(desc_path), "resolution": resolution, "threads": threads,
           "engine": variant.engine, "budget": budget, "seed": seed, "settings": settings,
           "shadow_caustics": variant.shadow_caustics, "output": str(output)}
    if variant.engine == "MITSUBA":
        command = [sys.executable, str(_HERE / "mitsuba_run.py")]
    else:
        command = [*blender_command(variant.blender), str(_HERE / "blender_run.py")]
    told = _run(command, job, budget)
    if "cannot_express" in told:
        raise CannotExpressError(told["cannot_express"])
    return np.load(output), told


def _run(command, job, budget):
    """Gives the job to the command as a file; the dict of its last line `BENCH {...}`."""
    OUT.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=OUT) as folder:
        path = Path(folder) / "job.json"
        path.write_text(json.dumps(job))
        done = subprocess.run([*command, "--", str(path)], env={**os.environ, "BLENDER_USER_SCRIPTS": str(STAGE)}, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=10 * budget + _SLACK_SECONDS)
    lines = done.stdout.splitlines()
    answers = [line for line in lines if line.startswith("BENCH ")]
    if done.returncode or not answers:
        raise JobError(f"{' '.join(command)} failed with {done.returncode}:\n" + "\n".join(lines[-20:]))
    return json.loads(answers[-1][len("BENCH "):])
