"""What all Python tests share: they use the staged add-on, never the sources beside it.

`./dev stage` makes it. BLENDER_USER_SCRIPTS must be set before bpy is imported, so it is set here.
"""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
STAGE = ROOT / "build" / "stage"

if not (STAGE / "addons" / "sppm" / "__init__.py").is_file():
    raise RuntimeError(f"no staged add-on in {STAGE}: run ./dev stage")

os.environ["BLENDER_USER_SCRIPTS"] = str(STAGE)
for folder in (STAGE / "addons", ROOT / "blend_scenes", ROOT / "benchmarks"):
    sys.path.insert(0, str(folder))


def pytest_addoption(parser):
    parser.addoption("--slow", action="store_true", help="also run the tests that take minutes")


def pytest_collection_modifyitems(config, items):
    """Leaves out what is marked slow, without listing it as skipped."""
    if config.getoption("--slow"):
        return
    slow = [item for item in items if item.get_closest_marker("slow")]
    config.hook.pytest_deselected(items=slow)
    items[:] = [item for item in items if item not in slow]
