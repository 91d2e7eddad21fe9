"""Runs inside Blender, or in a Python that has the bpy module: opens a scene, renders or exports it, prints one line of JSON.

    blender -b --factory-startup --python blender_run.py -- JOB.json      (or: python blender_run.py -- JOB.json)

The job names `blend`, `resolution`, `threads` and `action`. "export" pickles the SceneDesc to `output`. "render" needs `engine`,
`seed`, `budget` in seconds, `settings` and `shadow_caustics`, and saves the picture, (height, width, 3) float32, rows from bottom
to top, as `output` (.npy). The last line printed is `BENCH {...}`.
"""

import dataclasses
import functools
import json
import os
import pickle
import resource
import sys
import time
from pathlib import Path

import bpy
import numpy as np

_MANY = 2**62


def main(job):
    if job["action"] == "export" or job["engine"] == "SPPM":
        _enable_addon()
    bpy.ops.wm.open_mainfile(filepath=job["blend"])
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = job["resolution"]
    scene.render.threads_mode, scene.render.threads = "FIXED", job["threads"]
    answer = {"export": _export, "render": _render}[job["action"]](scene, job)
    print(f"BENCH {json.dumps({**answer, 'blender': bpy.app.version_string})}", flush=True)


def _enable_addon():
    import addon_utils

    if not addon_utils.enable("sppm", default_set=True):
        raise RuntimeError("the staged add-on cannot be enabled; run ./dev stage")


# ---------------------------------------------------------------- export


def _export(scene, job):
    from sppm.export_scene import export_scene

    exported = {}

    class Exporter(bpy.types.RenderEngine):
        """A render's dependency graph differs from the viewport's, and only an engine gets it."""

        bl_idname, bl_label = "SPPM_BENCH_EXPORT", "Export"

        def render(self, depsgraph):
            begin = time.perf_counter()
            exported["desc"], exported["warnings"] = export_scene(depsgraph)
            exported["seconds"] = time.perf_counter() - begin

    bpy.utils.register_class(Exporter)
    scene.render.engine = Exporter.bl_idname
    bpy.ops.render.render()
    bpy.utils.unregister_class(Exporter)
    Path(job["output"]).write_bytes(pickle.dumps(exported.pop("desc")))
    return exported


# ---------------------------------------------------------------- render


def _render(scene, job):
    {"SPPM": _set_sppm, "CYCLES": _set_cycles}[job["engine"]](scene, job)
    phases = _watch_engine() if job["engine"] == "SPPM" else {}
    wall, cpu = time.perf_counter(), _cpu_seconds()
    bpy.ops.render.render()
    wall, cpu = time.perf_counter() - wall, _cpu_seconds() - cpu
    np.save(job["output"], _result_pixels(scene, Path(job["output"]).with_suffix(".exr")))
    return {"wall": wall, "cpu": cpu, **phases}


def _cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def _set_sppm(scene, job):
    """The engine makes its settings from the scene's; the job's take their place, also those that the add-on does not show."""
    from sppm import engine

    scene.render.engine = "SPPM"
    own = {"iterations": _MANY, "time_limit": job["budget"], "seed": job["seed"], **job["settings"]}
    original = engine.session_settings
    engine.session_settings = lambda depsgraph: dataclasses.replace(original(depsgraph), **own)


def _set_cycles(scene, job):
    scene.render.engine = "CYCLES"
    values = {"samples": 2**24, "time_limit": job["budget"], "seed": job["seed"], **job["settings"]}
    for name, value in values.items():
        if not hasattr(scene.cycles, name):
            raise AttributeError(f"Cycles has no setting {name}")
        setattr(scene.cycles, name, value)
    if job["shadow_caustics"]:
        _flag_caustics(scene)


def _flag_caustics(scene):
    """Flags all lights, casters and receivers of Cycles' shadow caustics."""
    for light in bpy.data.lights:
        light.cycles.is_caustics_light = True
    scene.world.cycles.is_caustics_light = True
    for thing in bpy.data.objects:
        if thing.type not in {"EMPTY", "CAMERA", "LIGHT"}:
            glass = any(_is_glass(slot.material) for slot in thing.material_slots)
            thing.cycles.is_caustics_caster, thing.cycles.is_caustics_receiver = glass, not glass


def _is_glass(material):
    nodes = material.node_tree.nodes if material and material.use_nodes else ()
    return any(node.type in {"BSDF_GLASS", "BSDF_REFRACTION"} for node in nodes)


def _result_pixels(scene, path):
    """The pixels of the render result; in the background Blender tells them by a file only."""
    settings = scene.render.image_settings
    settings.file_format, settings.color_mode, settings.color_depth, settings.exr_codec = "OPEN_EXR", "RGB", "32", "NONE"
    bpy.data.images["Render Result"].save_render(str(path), scene=scene)
    image = bpy.data.images.load(str(path))
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(image.size[0] * image.size[1] * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    path.unlink()
    return pixels.reshape(image.size[1], image.size[0], image.channels)[..., :3]


# ---------------------------------------------------------------- where the engine's time goes


def _watch_engine():
    """Makes the engine tell its phases: seconds of export, build and hand-over, and the session's own progress as `progress`."""
    from sppm import engine, native, render_result

    phases = {"export": 0.0, "build": 0.0, "hand_over": 0.0}

    def watch(owner, name, phase):
        original = getattr(owner, name)

        @functools.wraps(original)
        def timed(*arguments, **keywords):
            begin = time.perf_counter()
            try:
                return original(*arguments, **keywords)
            finally:
                phases[phase] += time.perf_counter() - begin

        setattr(owner, name, timed)

    watch(engine, "export_scene", "export")
    watch(native.Scene, "__init__", "build")
    for name in ("__init__", "write", "close"):
        watch(render_result.ResultWriter, name, "hand_over")
    _keep_progress(native.Session, phases)
    return phases


def _keep_progress(session_class, phases):
    close = session_class.close

    def close_and_keep(session):
        if session._handle:
            phases["progress"] = vars(session.progress())
        close(session)

    session_class.close = close_and_keep


if __name__ == "__main__":
    main(json.loads(Path(sys.argv[sys.argv.index("--") + 1]).read_text()))
    sys.stdout.flush()
    # A bpy module may hang at exit while engines are registered; everything is written.
    os._exit(0)
