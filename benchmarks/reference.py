"""Converged pictures, what their own error is, and a file that keeps them.

A reference is ours with a small radius that does not shrink: nothing else here finds every scene's caustics. It is rendered twice
with different seeds; what `measure` says has no noise of either half in its mean. A coarser pair tells the bias of the radius.
"""

import hashlib
import json

import numpy as np
from environment import OUT, ROOT
from measure import REGIONS, Reference, caustic_mask, mean
from metrics import uncertainty, without_worst
from sppm import native, scene_desc
from variants import REFERENCE

_SEEDS = (1_000_001, 1_000_002)
_RADIUS_PIXELS = 1 / 3  # the radius, in footprints of a pixel at the median depth
_COARSE = 2.0  # the radius of the coarse pair, over that
_COARSE_TIME = 0.25  # its time over that of a half


def reference(name, blend, desc, seconds, threads):
    """The scene's reference, from the file if the scene and all settings are what they were.

    Args:
        blend: the scene's file; its content is part of the key.
        desc: the same scene, exported at the benchmark's resolution.
        seconds: of wall time for each half.

    Returns:
        (Reference, dict of `iterations` of both halves together, `caustic_share` of the pixels and, for each region without its worst
        0.1 %, `noise_REGION`, `bias_REGION` with its `bias_uncertainty_REGION`, and `least_REGION`, the least error that can be told
        from none).
    """
    settings = {**REFERENCE, "seconds": seconds, "width": desc.camera.width, "height": desc.camera.height,
                "radius_pixels": _RADIUS_PIXELS, "coarse": _COARSE, "coarse_time": _COARSE_TIME}
    key = hashlib.sha256(blend.read_bytes() + json.dumps(settings, sort_keys=True).encode()).hexdigest()[:16]
    path = OUT / "references" / f"{name}-{key}.npz"
    if not path.exists():
        print(f"rendering the reference of {name}: {2 * (1 + _COARSE_TIME) * seconds:.0f} s", flush=True)
        path.parent.mkdir(parents=True, exist_ok=True)
        pictures = _render_all(desc, seconds, threads)
        (path.parent / f"{path.stem}.json").write_text(json.dumps({"file": str(blend.relative_to(ROOT)), **settings}, indent=1))
        np.savez(path, **pictures)
    return judge(dict(np.load(path)))


def judge(pictures):
    """What `reference` returns, of its pictures: arrays of (2, ...) by name, of `combined`, `caustics`, `coarse` and `iterations`."""
    halves = pictures["combined"]
    result = Reference(tuple(halves), caustic_mask(halves.mean(0), pictures["caustics"].mean(0)))
    noise, bias = result.noise(), _squared_bias(result, pictures["coarse"])
    told = {"iterations": int(pictures["iterations"].sum())}
    for region in REGIONS:
        inside = result.region(region)
        # A single glint would pass for the bias of the whole picture.
        own, coarse = (errors[inside][without_worst(errors[inside])] for errors in (noise, bias))
        told |= {f"noise_{region}": mean(own), f"bias_{region}": mean(coarse), f"bias_uncertainty_{region}": uncertainty(coarse),
                 f"least_{region}": result.least_error(inside)}
    told["caustic_share"] = float(result.caustic.mean())
    return result, told


def _squared_bias(result, coarse):
    """Estimate of the squared relative bias of each pixel, (height, width), noisy and of either sign.

    Bias grows with the square of the radius, so the coarse pictures differ from ours by _COARSE^2 - 1 times our bias in the mean.
    """
    return result.products(*coarse) / (_COARSE**2 - 1) ** 2


def _render_all(desc, seconds, threads):
    """Both halves of both pairs; arrays of (2, height, width, channels)."""
    radius = _RADIUS_PIXELS * _footprint(desc)
    fine = [_render(desc, radius, seconds, threads, seed) for seed in _SEEDS]
    coarse = [_render(desc, _COARSE * radius, _COARSE_TIME * seconds, threads, seed + 2) for seed in _SEEDS]
    return {"combined": np.stack([half["Combined"][..., :3] for half in fine]),
            "caustics": np.stack([half["Caustics"] for half in fine]),
            "coarse": np.stack([half["Combined"][..., :3] for half in coarse]),
            "iterations": np.array([half["iterations"] for half in fine])}


def _render(desc, radius, seconds, threads, seed):
    passes = frozenset(("Combined", "Caustics"))
    settings = native.Settings(**REFERENCE, iterations=2**62, time_limit=seconds, initial_radius=radius, seed=seed,
                               threads=threads, passes=passes)
    with native.Scene(desc, threads) as scene, native.Session(scene, settings) as session:
        while not session.progress().finished:
            session.step()
        return {**{name: session.read_pass(name) for name in passes}, "iterations": session.progress().iteration}


def _footprint(desc):
    """Width of a pixel at the median depth of what the camera sees, metres."""
    camera = desc.camera
    width = (camera.window[1] - camera.window[0]) / camera.width
    if camera.projection == scene_desc.Projection.ORTHOGRAPHIC:
        return width
    settings = native.Settings(iterations=1, passes=frozenset(("Combined", "Depth")))
    with native.Scene(desc) as scene, native.Session(scene, settings) as session:
        session.step()
        depth = session.read_pass("Depth")
    return width * float(np.median(depth[depth < 1e9]))


def compare(result, first, second):
    """Squared relative difference in the mean between the reference and another renderer, without either's noise.

    Args:
        first, second: two independent pictures by that renderer, (height, width, 3).
    """
    return float(result.products(first, second).mean())
