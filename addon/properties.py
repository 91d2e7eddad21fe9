"""Every setting of the engine: name, default, range, unit, description. Names are those of SppmSettings."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty

# What a quality stands for. It is no setting of its own: it is read off the settings, so scripts and files need not know of it.
QUALITIES = {
    "DRAFT": {"iterations": 16, "photons_per_iteration": 0},
    "GOOD": {"iterations": 64, "photons_per_iteration": 0},
    "FINAL": {"iterations": 512, "photons_per_iteration": 0},
}
_CUSTOM = len(QUALITIES)
_FIRST_RADIUS = 0.01  # metres, to begin with where it is no longer automatic


def _get_quality(settings):
    """Position of the quality whose settings these are, else that of CUSTOM."""
    for position, values in enumerate(QUALITIES.values()):
        if all(getattr(settings, name) == value for name, value in values.items()):
            return position
    return _CUSTOM


def _set_quality(settings, position):
    """Writes what the quality stands for; CUSTOM leaves all as it is."""
    if position != _CUSTOM:
        for name, value in list(QUALITIES.values())[position].items():
            setattr(settings, name, value)


# What is read off other settings, and not stored.
DERIVED = {"quality", "use_auto_photons", "use_auto_radius"}


def _set_auto_photons(settings, is_on):
    """Where they shall be no longer automatic, as many as there are pixels: what the automatic ones begin with."""
    if is_on != (settings.photons_per_iteration == 0):
        render = settings.id_data.render
        pixels = round(render.resolution_x * render.resolution_y * (render.resolution_percentage / 100.0) ** 2)
        settings.photons_per_iteration = 0 if is_on else max(1, pixels)


def _set_auto_radius(settings, is_on):
    if is_on != (settings.initial_radius == 0.0):
        settings.initial_radius = 0.0 if is_on else _FIRST_RADIUS


class SppmSettings(bpy.types.PropertyGroup):
    """Settings of a scene, `scene.sppm`."""

    quality: EnumProperty(
        name="Quality", get=_get_quality, set=_set_quality, options=set(),
        items=(("DRAFT", "Draft", "Light and caustics in their places, with noise and blur: 16 iterations", 0),
               ("GOOD", "Good", "Clean where much light is, fine caustics still soft: 64 iterations", 1),
               ("FINAL", "Final", "Sharp caustics with little noise: 512 iterations", 2),
               ("CUSTOM", "Custom", "Other iterations or photons than those of a quality", _CUSTOM)),
        description="How good the picture shall be: sets iterations, and photons to automatic")
    iterations: IntProperty(
        name="Iterations", default=64, min=1, soft_max=4096,
        description="How often camera rays and photons are sent; noise and blur shrink with each")
    viewport_iterations: IntProperty(
        name="Viewport Iterations", default=64, min=1, soft_max=4096,
        description="Iterations after which a viewport in Rendered shading is done and rests")
    photons_per_iteration: IntProperty(
        name="Photons", default=0, min=0, soft_max=10_000_000,
        description="Photon paths started in each iteration; 0 for so many that their rays are about as many as the camera's")
    use_auto_photons: BoolProperty(
        name="Automatic", get=lambda settings: settings.photons_per_iteration == 0, set=_set_auto_photons, options=set(),
        description="Start so many photon paths in each iteration that their rays are about as many as the camera's")
    indirect: EnumProperty(
        name="Indirect Light", default="AUTO",
        items=(("AUTO", "Automatic", "Photons where a first iteration finds enough of them in most of the picture, else paths"),
               ("PHOTONS", "Photons", "From all lights to anywhere, gathered where the camera looks: for closed rooms"),
               ("PATHS", "Paths", "From the camera on, as a path tracer does it: for open scenes")),
        description="Who finds the light that is neither direct nor a caustic; caustics are always made of photons")
    radius_rule: EnumProperty(
        name="Radius Rule", default="DENSITY",
        items=(("DENSITY", "Density", "By the photons that earlier iterations found around a pixel"),
               ("PROGRESSIVE", "Progressive", "By the photons found, as the method was published: shrinks where there are many"),
               ("PASS_INDEXED", "Pass Indexed", "By the number of the iteration alone")),
        description="How the radius in which photons are gathered shrinks from iteration to iteration")
    initial_radius: FloatProperty(
        name="Initial Radius", default=0.0, min=0.0, soft_max=1.0, precision=4, subtype="DISTANCE", unit="LENGTH",
        description="Radius in which photons are gathered at first; 0 chooses it from the size of a pixel at what it sees")
    use_auto_radius: BoolProperty(
        name="Automatic", get=lambda settings: settings.initial_radius == 0.0, set=_set_auto_radius, options=set(),
        description="Choose the radius in which photons are gathered at first from the size of a pixel at what it sees")
    max_depth: IntProperty(
        name="Max Depth", default=24, min=1, max=1024, soft_max=128,
        description="Most vertices that a camera or photon path may have")
    gamma: FloatProperty(
        name="Gamma", default=0.7, min=0.01, max=0.99,
        description="How slowly the radius shrinks: smaller sharpens faster and leaves more noise")
    pixel_filter: EnumProperty(
        name="Pixel Filter", default="BLACKMAN_HARRIS",
        items=(("BLACKMAN_HARRIS", "Blackman-Harris", "Smooth, as in Cycles"), ("BOX", "Box", "The pixel's own square, sharp")),
        description="How a pixel weighs what lies around its centre")
    filter_width: FloatProperty(
        name="Filter Width", default=1.5, min=0.01, soft_min=0.5, max=10.0, subtype="PIXEL",
        description="Pixels that Blackman-Harris reaches to either side, or the whole width of Box, as in Cycles")
    seed: IntProperty(name="Seed", default=0, min=0, description="Another seed gives other noise")
    time_limit: FloatProperty(
        name="Time Limit", default=0.0, min=0.0, soft_max=3600.0, subtype="TIME_ABSOLUTE", unit="TIME_ABSOLUTE",
        description="Stop after the iteration in which this much time has passed; 0 for no limit")
    write_interval: IntProperty(
        name="Write Interval", default=0, min=0, soft_max=256, options=set(),
        description="Iterations between snapshots, written as an OpenEXR file next to the output; 0 for none")


def _pass_switch(name, description):
    """A switch that the compositor's Render Layers node hears of at once."""
    return BoolProperty(name=name, description=description,
                        update=lambda _self, context: context.view_layer.update_render_passes())


class SppmViewLayerSettings(bpy.types.PropertyGroup):
    """The engine's own passes of a view layer, `view_layer.sppm`."""

    use_pass_direct: _pass_switch("Direct", "Emission, environment and light that comes straight from lamps")
    use_pass_indirect: _pass_switch("Indirect", "Light that other surfaces scattered before, but for caustics")
    use_pass_caustics: _pass_switch("Caustics", "Photons that came from lights by mirrors and glass only")
    use_pass_radius: _pass_switch("Radius", "Search radius of each pixel, in metres")
    use_pass_photons: _pass_switch("Photons", "Photons that each pixel has gathered")
    denoising_store_passes: _pass_switch(
        "Denoising Data", "Albedo and normal for the Denoise node, seen through mirrors and glass; where Cycles is enabled, its "
        "own switch of this name counts instead")


def register():
    bpy.utils.register_class(SppmSettings)
    bpy.utils.register_class(SppmViewLayerSettings)
    bpy.types.Scene.sppm = PointerProperty(type=SppmSettings, name="SPPM")
    bpy.types.ViewLayer.sppm = PointerProperty(type=SppmViewLayerSettings, name="SPPM")


def unregister():
    del bpy.types.ViewLayer.sppm
    del bpy.types.Scene.sppm
    bpy.utils.unregister_class(SppmViewLayerSettings)
    bpy.utils.unregister_class(SppmSettings)
