"""Film passes -> Blender's RenderResult."""

from operator import attrgetter

import numpy as np

from . import compat

_DENOISING = "denoising"  # the switch that compat.denoising_switch finds

# The library's name of a pass: channels, their letters, Blender's type, and the switch on the view layer (None: always there).
_PASSES = {
    "Combined": (4, "RGBA", "COLOR", None),
    "Depth": (1, "Z", "VALUE", "use_pass_z"),
    "Normal": (3, "XYZ", "VECTOR", "use_pass_normal"),
    "Direct": (3, "RGB", "COLOR", "sppm.use_pass_direct"),
    "Indirect": (3, "RGB", "COLOR", "sppm.use_pass_indirect"),
    "Caustics": (3, "RGB", "COLOR", "sppm.use_pass_caustics"),
    "Radius": (1, "X", "VALUE", "sppm.use_pass_radius"),
    "Photons": (1, "X", "VALUE", "sppm.use_pass_photons"),
    "Position": (3, "XYZ", "VECTOR", "use_pass_position"),
    "UV": (3, "UVA", "VECTOR", "use_pass_uv"),
    "Object Index": (1, "X", "VALUE", "use_pass_object_index"),
    "Material Index": (1, "X", "VALUE", "use_pass_material_index"),
    "Mist": (1, "Z", "VALUE", "use_pass_mist"),
    "Emission": (3, "RGB", "COLOR", "use_pass_emit"),
    "Environment": (3, "RGB", "COLOR", "use_pass_environment"),
    "Diffuse Color": (3, "RGB", "COLOR", "use_pass_diffuse_color"),
    "Denoising Albedo": (3, "RGB", "COLOR", _DENOISING),
    "Denoising Normal": (3, "XYZ", "VECTOR", _DENOISING),
}

# Switches that stand among those of passes and need no answer.
_NO_PASSES = {"use_pass_combined", "use_pass_cryptomatte_accurate", "use_pass_grease_pencil"}

_MIST_POWERS = {"QUADRATIC": 2.0, "LINEAR": 1.0, "INVERSE_QUADRATIC": 0.5}

_SHARES = ("Caustics", "Indirect")


def requested_passes(view_layer):
    """Names of the passes that a view layer asks for, in the order in which they are shown."""
    return [name for name, (*_, switch) in _PASSES.items() if switch is None or _is_on(view_layer, switch)]


def _is_on(view_layer, switch):
    return getattr(*compat.denoising_switch(view_layer)) if switch == _DENOISING else attrgetter(switch)(view_layer)


def warnings(view_layer):
    """A message that names the passes which Blender lets a view layer ask for and the engine does not have, if there are any."""
    known = {switch for *_, switch in _PASSES.values()} | _NO_PASSES
    owners = [owner for owner in (view_layer, getattr(view_layer, "cycles", None)) if owner]
    missing = [item.name for owner in owners for item in owner.bl_rna.properties
               if item.identifier.startswith("use_pass_") and item.identifier not in known and getattr(owner, item.identifier)]
    missing += [f"AOV '{aov.name}'" for aov in view_layer.aovs]
    return [f"view layer '{view_layer.name}': there are no passes {', '.join(missing)}"] if missing else []


def register_passes(engine, scene, view_layer):
    """Tells Blender which passes there will be (RenderEngine.update_render_passes)."""
    for name in requested_passes(view_layer):
        channels, letters, kind, _ = _PASSES[name]
        engine.register_pass(scene, view_layer, compat.pass_name(name), channels, letters, kind)


def data_settings(scene, view_layer):
    """How data passes are made: the fields of native.Settings."""
    settings = {"alpha_threshold": view_layer.pass_alpha_threshold}
    world = compat.world_of(scene, view_layer)
    if world:
        mist = world.mist_settings
        settings.update(mist_start=mist.start, mist_depth=mist.depth, mist_power=_MIST_POWERS[mist.falloff])
    return settings


def measured_passes(writes_snapshots):
    """Names of the passes that `light_shares` reads; a snapshot would write them, so none where there are snapshots."""
    return [] if writes_snapshots else list(_SHARES)


def light_shares(session, passes):
    """{name: its share of the light in the picture, 0 to 1}, for what is among `passes`; the film keeps these sums anyway."""
    total = session.read_pass("Combined")[..., :3].sum(dtype=np.float64)
    if total <= 0.0:
        return {}
    return {name: float(session.read_pass(name).sum(dtype=np.float64) / total) for name in _SHARES if name in passes}


class ResultWriter:
    """Blender's result of one view layer, from `begin_result` to `end_result`; close it exactly once, also after a failure."""

    def __init__(self, engine, size, view_layer_name):
        self._engine = engine
        self._result = engine.begin_result(0, 0, *size, layer=view_layer_name)
        self._names = {compat.pass_name(name): name for name in _PASSES}

    def write(self, session):
        """Copies every pass that Blender made room for."""
        for render_pass in self._result.layers[0].passes:
            if render_pass.name in self._names:
                compat.set_pass_pixels(render_pass, session.read_pass(self._names[render_pass.name]))

    def show(self, session):
        """Writes and shows a preview; 40 to 150 ms at 1920 x 1080."""
        self.write(session)
        self._engine.update_result(self._result)

    def close(self, cancel=False):
        """Hands the result over, or drops it."""
        self._engine.end_result(self._result, cancel=cancel)
