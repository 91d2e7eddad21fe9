"""Where the benchmarks live and run: folders, the environment with their Python packages, the Blenders."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SCENES = ROOT / "blend_scenes"
STAGE = ROOT / "build" / "stage"
VENVS = ROOT / "build" / "venv"
OUT = ROOT / "build" / "bench"

_VENV = VENVS / "bench"
_PACKAGES = ("numpy", "matplotlib", "flip-evaluator", "mitsuba")

sys.path.insert(0, str(STAGE / "addons"))


def enter():
    """Goes on in the environment that has the packages, making it first; call it before anything else."""
    if Path(sys.prefix) == _VENV:
        return
    python = _VENV / "bin" / "python"
    installed = "import importlib.metadata as m, sys; [m.version(name) for name in sys.argv[1:]]"
    if not python.exists() or subprocess.run([python, "-c", installed, *_PACKAGES], stderr=subprocess.DEVNULL).returncode:
        print(f"making {_VENV.relative_to(ROOT)}", flush=True)
        subprocess.run(["/usr/bin/python3", "-m", "venv", _VENV], check=True)
        subprocess.run([python, "-m", "pip", "install", "-q", "--disable-pip-version-check", *_PACKAGES], check=True)
    os.execv(python, [python, *sys.argv])


def blender_command(version):
    """How to run a Python script in a Blender: "system", or the version of a bpy wheel. The script's path comes next.

    Raises:
        FileNotFoundError: `./dev test` has not made the wheel's environment yet.
    """
    if version == "system":
        return [os.environ.get("BLENDER", "blender"), "-b", "--factory-startup", "--python-exit-code", "1", "--python"]
    python = VENVS / f"bpy-{version}" / "bin" / "python"
    if not python.exists():
        raise FileNotFoundError(f"there is no {python.relative_to(ROOT)}: ./dev test makes it")
    return [str(python)]


def scene_file(name):
    """The file of a scene of blend_scenes."""
    path = SCENES / f"{name}.blend"
    if not path.is_file():
        raise FileNotFoundError(f"no scene {name}: there is no {path.relative_to(ROOT)}")
    return path
