"""Runs inside Blender: installs the package, as an extension where this Blender has extensions, and says where it is.

    blender -b --python-exit-code 1 --python tools/install.py -- sppm-VERSION-linux-x64.zip
"""

import sys
from pathlib import Path

import bpy


def install(package):
    """Installs the zip in the user's folder in place of an older one; the name of its module."""
    if hasattr(bpy.ops, "extensions") and bpy.app.version >= (4, 2, 0):
        bpy.ops.extensions.package_install_files(filepath=str(package), repo="user_default", enable_on_install=False)
        return "bl_ext.user_default.sppm"
    bpy.ops.preferences.addon_install(filepath=str(package), overwrite=True)
    return "sppm"


def folder_of(module):
    """Where Blender will load the module from."""
    import addon_utils  # the bpy wheels have it only after bpy

    found = [addon.__file__ for addon in addon_utils.modules(refresh=True) if addon.__name__ == module]
    if not found:
        raise SystemExit(f"Blender {bpy.app.version_string} did not install {module}")
    return Path(found[0]).parent


if __name__ == "__main__":
    module = install(Path(sys.argv[-1]).resolve())
    print(f"Blender {bpy.app.version_string}: installed in {folder_of(module)}")
    print(f"To enable it: Edit > Preferences > Add-ons, tick 'SPPM Render Engine'; or start Blender with --addons {module}")
