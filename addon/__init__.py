"""SPPM, a render engine for Blender: stochastic progressive photon mapping. Nothing of Blender is imported before `register`."""

import atexit

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
    _unregister_at_exit()


def unregister():
    """Takes back what `register` added."""
    atexit.unregister(unregister)
    while _registered:
        _registered.pop().unregister()


def _unregister_at_exit():
    """As a Python module, Blender 4.5 hangs at exit while an engine is registered; as a program it tidies up by itself."""
    import bpy

    if not bpy.app.binary_path:
        atexit.register(unregister)
