"""Imports and includes follow the one-way order of docs/architecture.md."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def places(what):
    """{name: position} in the order that docs/architecture.md lists for `what`, leftmost first."""
    text = (ROOT / "docs" / "architecture.md").read_text()
    line = re.search(rf"\n- {what}: (.*?)\n(?:- |\n)", text, re.S).group(1)
    groups = [group.split() for group in re.sub(r"[`\n]", " ", line).split("<")]
    return {name: i for i, group in enumerate(groups) for name in group}


def test_every_native_file_is_in_the_order():
    files = {path.stem for path in (ROOT / "native" / "src").iterdir()}
    assert files == set(places("native"))


def test_native_includes_point_left():
    place = places("native")
    wrong = []
    for path in (ROOT / "native" / "src").iterdir():
        for included in re.findall(r'#include "(\w+)\.h"', path.read_text()):
            if place[included] > place[path.stem]:
                wrong.append(f"{path.name} includes {included}.h")
    assert not wrong


@pytest.mark.parametrize(
    ("library", "door"), [("embree", "accel.cpp"), ("tbb/", "parallel.cpp"), ("Imf", "image.cpp")]
)
def test_one_door_for_each_library(library, door):
    users = [p.name for p in (ROOT / "native" / "src").iterdir() if re.search(rf"#include <{library}", p.read_text())]
    assert users == [door]


def imports_of(path):
    """Modules of the add-on, and others, that a file imports anywhere."""
    own, others = set(), set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level:
            own |= {node.module} if node.module else {a.name for a in node.names}
        elif isinstance(node, ast.ImportFrom):
            others.add(node.module.split(".")[0])
        elif isinstance(node, ast.Import):
            others |= {a.name.split(".")[0] for a in node.names}
    return own, others


def test_plain_modules_need_neither_blender_nor_ctypes():
    plain = {"scene_desc": set(), "scene_validation": {"scene_desc"},
             "native_abi": set(), "native_library": {"native_abi"}, "native_structs": {"native_abi"},
             "native": {"native_abi", "native_library", "native_structs", "scene_desc", "scene_validation"},
             "bounds": set(), "shell": set(), "wording": set(), "advice": {"scene_desc", "bounds", "shell", "wording"},
             "statistics": {"native"}, "scene_change": {"native"},
             "live_render": {"native", "native_library", "scene_change", "scene_desc", "scene_validation"}}
    for name, allowed in plain.items():
        own, others = imports_of(ROOT / "addon" / f"{name}.py")
        assert own <= allowed
        assert "bpy" not in others


def test_exporters_never_import_native():
    for path in exporters():
        own, _ = imports_of(path)
        assert not own & {"engine", "ui", "properties"} and not any(name.startswith("native") for name in own), path.name


def exporters():
    return [path for kind in ("export", "material", "nodes") for path in (ROOT / "addon").glob(f"{kind}_*.py")]


def test_modules_of_materials_import_to_the_left():
    place = places("material nodes")
    files = {path.stem for path in exporters() if not path.stem.startswith("export")}
    assert files <= set(place)
    wrong = [f"{name} imports {other}" for name in place for other in imports_of(ROOT / "addon" / f"{name}.py")[0]
             if place.get(other, len(place)) >= place[name]]
    assert not wrong


def test_ctypes_lives_in_native_only():
    users = [p.name for p in (ROOT / "addon").glob("*.py") if "ctypes" in imports_of(p)[1]]
    assert sorted(users) == ["native.py", "native_abi.py", "native_library.py", "native_structs.py"]
