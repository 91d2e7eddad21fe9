"""What is compared: a table of renderers and their settings."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class Variant:
    """A renderer as it is run.

    Attributes:
        label: what plots and tables call it.
        engine: "SPPM", "CYCLES" or "MITSUBA".
        blender: "system" or the version of a bpy wheel; unused for mitsuba.
        settings: of native.Settings or scene.cycles; for mitsuba its integrator.
        photons_per_pixel: of an iteration; 0 leaves it to the engine.
        shadow_caustics: flag lights, glass and all that is not glass for Cycles' manifold next-event estimation.
    """

    label: str
    engine: str
    blender: str = "system"
    settings: dict = field(default_factory=dict)
    photons_per_pixel: int = 0
    shadow_caustics: bool = False


# All that Cycles leaves out or blurs to save time is switched on or off, so that it converges to the same picture.
_CYCLES = {
    "device": "CPU",
    "use_adaptive_sampling": False,
    "use_denoising": False,
    "caustics_reflective": True,
    "caustics_refractive": True,
    "blur_glossy": 0.0,
    "sample_clamp_direct": 0.0,
    "sample_clamp_indirect": 0.0,
    "light_sampling_threshold": 0.0,
    "max_bounces": 24,
    "diffuse_bounces": 24,
    "glossy_bounces": 24,
    "transmission_bounces": 24,
    "transparent_max_bounces": 24,
    "pixel_filter_type": "BLACKMAN_HARRIS",
    "filter_width": 1.5,
}

# Stochastic progressive photon mapping as the textbook has it.
_TEXTBOOK = {"indirect": "PHOTONS", "radius_rule": "PROGRESSIVE", "gamma": 2.0 / 3.0, "aim_photons": False}

_MITSUBA = {"max_depth": 24, "hide_emitters": True}

VARIANTS = {
    "sppm": Variant("SPPM", "SPPM"),
    "textbook": Variant("SPPM, textbook", "SPPM", settings=_TEXTBOOK, photons_per_pixel=1),
    "cycles": Variant("Cycles 3.4", "CYCLES", settings=_CYCLES),
    "cycles-4.5": Variant("Cycles 4.5", "CYCLES", "4.5", _CYCLES),
    "cycles-4.5-guided": Variant("Cycles 4.5, path guiding", "CYCLES", "4.5", {**_CYCLES, "use_guiding": True}),
    "cycles-4.5-mnee": Variant("Cycles 4.5, shadow caustics", "CYCLES", "4.5", _CYCLES, shadow_caustics=True),
    "mitsuba-path": Variant("Mitsuba, path", "MITSUBA", settings={"type": "path", **_MITSUBA}),
    "mitsuba-ptracer": Variant("Mitsuba, particles", "MITSUBA", settings={"type": "ptracer", **_MITSUBA}),
}

BASE = "sppm"  # the variant that others are compared with

# native.Settings for references, without bias but for the radius in which photons are found; see reference.py. With so large a gamma
# it does not shrink.
REFERENCE = {"indirect": "PATHS", "radius_rule": "PASS_INDEXED", "gamma": 1.0 - 1e-9}
