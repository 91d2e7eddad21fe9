"""The Blenders that the package is tested with: programs, and Pythons that have the bpy module."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "build" / "package"


def is_python(blender):
    return Path(blender).name.startswith("python")


def name_of(blender):
    """build/venv/bpy-4.5/bin/python -> bpy-4.5"""
    return Path(blender).parents[1].name if is_python(blender) else Path(blender).name
