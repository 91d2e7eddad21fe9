"""The user guide tells of what exists: messages, settings, pictures, pages."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "guide.md").read_text()


def words(path):
    """Every text that a module holds, f-strings with nothing for their values."""
    tree = ast.parse(path.read_text())
    joined = [node for node in ast.walk(tree) if isinstance(node, ast.JoinedStr)]
    parts = [[v.value for v in node.values if isinstance(v, ast.Constant)] for node in joined]
    return ["".join(part) for part in parts] + [node.value for node in ast.walk(tree)
                                                if isinstance(node, ast.Constant) and isinstance(node.value, str)]


def told_messages():
    """Pieces of the messages that the guide explains."""
    table = TEXT.split("| message | what it means")[1].split("\n\n")[0]
    found = re.findall(r"^\| \*(.*?)\* \|", table, re.MULTILINE)
    return [piece.strip(" ,…") for message in found for piece in message.split("…") if piece.strip(" ,")]


@pytest.mark.parametrize("piece", told_messages())
def test_messages_of_the_guide_exist(piece):
    # The number of metres is a value, not a part of the text.
    piece = piece.split("1e+11")[0].strip()
    assert any(piece in text for path in (ROOT / "addon").glob("*.py") for text in words(path))


def test_every_message_of_advice_is_in_the_guide():
    """Each begins with what it is about: 'object', 'light', 'max depth' or 'none of'."""
    said = [text for text in words(ROOT / "addon" / "advice.py") if re.match(r"(object|light) :|max depth|none of ", text)]
    assert len(said) >= 7
    assert all(any(piece in text for piece in told_messages()) for text in said), said


def test_every_setting_is_in_the_guide():
    tree = ast.parse((ROOT / "addon" / "properties.py").read_text())
    (group,) = [node for node in tree.body if isinstance(node, ast.ClassDef) and node.name == "SppmSettings"]
    names = {node.target.id for node in group.body if isinstance(node, ast.AnnAssign)}
    stored = {name for name in names if not name.startswith("use_auto_")} - {"quality"}
    assert stored == set(re.findall(r"`([a-z_]+)`", TEXT.split("| panel | setting")[1].split("\n\n")[0]))


@pytest.mark.parametrize("page", ["guide.md", "blender.md", "install.md"])
def test_links_and_pictures_exist(page):
    for target in re.findall(r"\]\(([^)#:]+)[^)]*\)", (ROOT / "docs" / page).read_text()):
        assert (ROOT / "docs" / target).is_file(), target


def test_pictures_are_small():
    """So that a page of them loads at once."""
    sizes = {name: (ROOT / "docs" / name).stat().st_size for name in re.findall(r"\]\((images/[^)]+)\)", TEXT)}
    assert len(sizes) >= 5 and max(sizes.values()) < 300_000, sizes
