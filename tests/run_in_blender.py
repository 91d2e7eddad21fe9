"""Runs pytest inside Blender and exits with its status.

    BLENDER_USER_SCRIPTS=build/stage \\
        blender -b --factory-startup --python-exit-code 1 --python tests/run_in_blender.py -- PYTEST ARGS...

tests/addon/conftest.py enables the add-on, here as in a Python that has the bpy module.
"""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def main(arguments):
    """Runs pytest from the top of the tree; the status is pytest's."""
    sys.path.insert(0, str(ROOT))
    os.chdir(ROOT)
    import pytest  # Blender's Python must have it: Debian's package python3-pytest

    return pytest.main(arguments)


if __name__ == "__main__":
    status = main(sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else ["tests/addon"])
    sys.stdout.flush()
    sys.stderr.flush()
    sys.exit(int(status))
