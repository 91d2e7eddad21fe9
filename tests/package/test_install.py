"""The zip is installed in an empty user folder, as a user would, and renders there."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import pytest
from blenders import ROOT, is_python

sys.path.insert(0, str(ROOT / "tools"))
from package import SYSTEM_LIBRARIES

CLOSED_FORM = 50.0 / (4 * math.pi**2 * 1.3**2)  # radiance of white Lambert 1.3 m below a point lamp of 50 W


def run_in_blender(blender, user_folder, script, *arguments, prefix=()):
    """What the script printed."""
    options = [] if is_python(blender) else ["-b", "--factory-startup", "--python-exit-code", "1", "--python"]
    environment = {name: value for name, value in os.environ.items() if not name.startswith("BLENDER_USER")}
    environment["BLENDER_USER_RESOURCES"] = str(user_folder)
    done = subprocess.run([*prefix, blender, *options, str(script), "--", *map(str, arguments)], env=environment,
                          capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def install(blender, user_folder, package, prefix=()):
    """The name of the installed module, and its folder."""
    output = run_in_blender(blender, user_folder, ROOT / "tools" / "install.py", package, prefix=prefix)
    module = output.split("--addons ")[1].split()[0]
    return module, Path(output.split("installed in ")[1].splitlines()[0])


@pytest.fixture
def prefix(blender, request):
    """Debian's Blender cannot live without the libraries that are hidden from the others."""
    return request.getfixturevalue("hidden") if is_python(blender) else ()


def test_installs_and_renders(blender, package, prefix, tmp_path):
    user_folder, pictures = tmp_path / "user", tmp_path / "pictures"
    for folder in (user_folder, pictures):
        folder.mkdir()
    module, folder = install(blender, user_folder, package, prefix)
    assert folder.is_relative_to(user_folder)
    output = run_in_blender(blender, user_folder, ROOT / "tests/package/render_installed.py", module, pictures, prefix=prefix)
    report = json.loads(next(line for line in output.splitlines() if line.startswith("{")))
    check_pictures(report, pictures)
    check_libraries(report, folder / "lib")


def check_pictures(report, folder):
    assert report["cycles"] == pytest.approx(CLOSED_FORM, rel=0.01)
    assert report["sppm"] == pytest.approx([CLOSED_FORM] * 2, rel=0.01)  # as in test_f12.py
    (snapshot,) = folder.glob("first*.sppm.exr")
    assert snapshot.read_bytes()[:4] == b"\x76\x2f\x31\x01", "written by our own OpenEXR"


def check_libraries(report, lib):
    """All that the render loaded comes from the package or is a part of every system."""
    assert report["add-on"] == str(lib)
    assert report["blenders"], "no library of Blender's to clash with: this test shows nothing"
    loaded = {Path(path) for path in report["loaded"]}
    assert {path for path in loaded if path.parent == lib} == set(lib.iterdir())
    others = {path.name for path in loaded if path.parent != lib and "/site-packages/" not in str(path)}
    assert others <= set(SYSTEM_LIBRARIES)


def test_installs_over_an_older_one(blender, package, tmp_path):
    _, folder = install(blender, tmp_path, package)
    stale = folder / "stale.py"
    stale.write_text("")
    install(blender, tmp_path, package)
    assert (folder / "__init__.py").is_file()
    assert not stale.exists()


def test_blender_finds_the_extension_valid(blender, package):
    if not is_python(blender):
        pytest.skip("only the bpy modules of these tests know extensions")
    (script,) = Path(blender).parents[1].glob("lib/python*/site-packages/bpy/*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    done = subprocess.run([blender, str(script), "validate", str(package)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
