"""Tests of the add-on, inside Blender or in a Python that has the bpy module; both enable the staged add-on the same way."""

import sys

import pytest

try:
    import bpy
except ModuleNotFoundError:  # nothing here can run, and pytest says that it found no test
    collect_ignore_glob = ["test_*.py"]


@pytest.fixture(scope="session", autouse=True)
def addon():
    """Enables the staged add-on for the whole run and disables it at the end (bpy 4.5 hangs at exit otherwise)."""
    import addon_utils

    module = addon_utils.enable("sppm", default_set=True, handle_error=_raise)
    assert module, "Blender did not find the staged add-on; BLENDER_USER_SCRIPTS must name build/stage before Blender starts"
    assert "stage" in module.__file__, f"Blender loaded another add-on: {module.__file__}"
    yield module
    addon_utils.disable("sppm", default_set=True)


def _raise(error=None):
    raise error or sys.exc_info()[1]


@pytest.fixture
def empty_scene():
    """A new file: no objects, a black world, 32x32 pixels, SPPM with 4 iterations."""
    import blender_scene

    return blender_scene.start(32, 32)


@pytest.fixture
def export(empty_scene, monkeypatch):
    """A function that exports the scene as a render would: (SceneDesc, warnings). Errors arrive as an operator's RuntimeError.

    Every export runs inside a render, where Blender evaluates for rendering: only there hide_render, render levels of modifiers
    and the instancers' flags count.
    """
    import make_scenes
    from sppm import engine, export_scene, scene_validation

    make_scenes.add_camera((0, -5, 3), (0, 0, 0))
    exported = []
    monkeypatch.setattr(engine._Render, "run", lambda self: exported.append(export_scene.export_scene(self._depsgraph)))

    def run():
        exported.clear()
        bpy.ops.render.render()
        desc, warnings = exported[0]
        scene_validation.validate(desc)
        return desc, warnings

    return run


@pytest.fixture
def bench():
    """A new material, and the exporter of it."""
    from material_bench import Bench

    return Bench()


def pytest_report_header():
    return f"Blender {bpy.app.version_string}" if "bpy" in globals() else "no Blender"
