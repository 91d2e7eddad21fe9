"""Runs a script of this folder in a Blender of its own with a window, on a screen that is nowhere to be seen."""

import os
import shutil
import subprocess
from pathlib import Path

import bpy
import pytest

# That nothing may be written while a panel draws itself, Blender notes for all threads at once: the small picture of a material
# that begins to be rendered amid a drawing would leave the note behind, and no script could write any more. So drawings are not
# cut short.
_UNINTERRUPTED = "import sys; sys.setswitchinterval(1.0)"

needed = pytest.mark.skipif(not bpy.app.binary_path, reason="the bpy wheel has no window")


def run(script, folder, *arguments, size=(900, 800)):
    """What Blender prints until the script ends it; fails where it or the script does.

    Args:
        script: name of a file beside this one; Blender starts with its factory settings and the staged add-on.
        folder: for Blender's configuration.
        arguments: what the script finds after `--` in sys.argv.
    """
    assert shutil.which("xvfb-run"), "install xvfb"
    width, height = map(str, size)
    # `timeout` ends Blender and the X server too, and not only the script that started them.
    command = ["timeout", "300", "xvfb-run", "-a", "-s", f"-screen 0 {width}x{height}x24 +extension GLX", bpy.app.binary_path,
               "--factory-startup", "--window-geometry", "0", "0", width, height, "--addons", "sppm", "--python-exit-code", "1",
               "--python-expr", _UNINTERRUPTED, "-P", str(Path(__file__).with_name(script)), "--", *map(str, arguments)]
    done = subprocess.run(command, env={**os.environ, "LIBGL_ALWAYS_SOFTWARE": "1", "BLENDER_USER_CONFIG": str(folder)},
                          capture_output=True, text=True, check=False)
    output = done.stdout + done.stderr
    assert done.returncode == 0, output
    assert "Traceback" not in output, output
    return output
