"""SPPM, a render engine for Blender: stochastic progressive photon mapping. Nothing of Blender is imported before `register`."""

import atexit
import sys

bl_info = {
    "name": "SPPM Render Engine",
    "author": "The SPPM authors",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "description": "Stochastic progressive photon mapping: caustics and light through glass",
    "category": "Render",
}

_registered = []


def _modules():
    from . import engine, properties, ui

    return properties, engine, ui


def register():
    """Adds properties, engine and panels to Blender; all of them or, where one fails, none."""
    try:
        for module in _modules():
            module.register()
            _registered.append(module)
    except BaseException:
        unregister()
        raise
    import bpy

    if not bpy.app.binary_path:
        atexit.unregister(_leave)
        atexit.register(_leave)


def unregister():
    """Takes back what `register` added."""
    while _registered:
        _registered.pop().unregister()


def _leave():
    """Tidies up before Python ends where Blender is a Python module; as a program it does so by itself.

    Blender 4.5 hangs at exit while an engine is registered; 4.2 crashes where anything that it leaks, as the functions of a
    registered class are, still leads to `bpy`.
    """
    unregister()
    for name, module in list(sys.modules.items()):
        if name.startswith(f"{__name__}."):
            vars(module).pop("bpy", None)
