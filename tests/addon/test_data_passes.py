"""Passes that show data of surfaces: a row of patches of one material each, beside Cycles' passes of the same file."""

import blender_scene
import bpy
import make_scenes
import numpy as np
import pytest
from cycles_reference import PICTURES, UNBIASED
from exr_layers import render_layers
from sppm import compat

WIDTH, HEIGHT = 60, 10  # pixels; a patch is 5 wide with a gap between it and the next
ITERATIONS = 64
SKY = (0.2, 0.4, 0.6)
MIDDLE = (slice(2, 8), slice(1, 4))  # pixels of a patch that show nothing else
GAP = slice(59, 60)  # the last column: sky
SWITCHES = ("z", "mist", "position", "normal", "uv", "object_index", "material_index", "diffuse_color", "emit", "environment")
PASSES = ("Depth", "Mist", "Position", "Normal", "UV", "Object Index", "Material Index", "Diffuse Color", "Emission",
          "Environment",
          "Denoising Albedo", "Denoising Normal")


def half_clear(name, opacity):
    """Grey diffuse, mixed with what is transparent."""
    material = make_scenes.node_material(name, "ShaderNodeBsdfDiffuse", {"Color": (0.5, 0.5, 0.5)})
    tree = material.node_tree
    mix, clear = tree.nodes.new("ShaderNodeMixShader"), tree.nodes.new("ShaderNodeBsdfTransparent")
    mix.inputs["Fac"].default_value = opacity
    output = tree.get_output_node("CYCLES")
    tree.links.new(output.inputs["Surface"].links[0].from_socket, mix.inputs[2])
    tree.links.new(clear.outputs[0], mix.inputs[1])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return material


MATERIALS = {
    "diffuse": lambda: make_scenes.diffuse("Diffuse", (0.8, 0.4, 0.2)),
    "plastic": lambda: make_scenes.principled("Plastic", (0.5, 0.3, 0.2), Roughness=0.5),
    "emitter": lambda: make_scenes.node_material("Glow", "ShaderNodeEmission", {"Color": (1.0, 0.5, 0.25), "Strength": 3.0}),
    "mirror": lambda: make_scenes.node_material("Mirror", "ShaderNodeBsdfGlossy", {"Color": (0.9, 0.8, 0.7), "Roughness": 0.0}),
    "glass": lambda: make_scenes.glass("Glass"),
    "metal": lambda: make_scenes.metal("Metal", (0.8, 0.6, 0.4), 0.4),
    "nearly clear": lambda: half_clear("Nearly clear", 0.3),
    "half clear": lambda: half_clear("Half clear", 0.7),
    "without material": lambda: None,
    "holdout": lambda: make_scenes.diffuse("Holdout", (0.1, 0.2, 0.3)),
}
X = {name: 6 * index for index, name in enumerate(MATERIALS)}  # first pixel of each patch


def add_patch(name, index, material):
    """A tilted rectangle over pixels 6 index to 6 index + 5, of glass a slab; every second one has UVs."""
    left, right = 1.2 * index, 1.2 * index + 1.0
    corners = [(left, 0, 0), (right, 0, 0), (right, 2, 0.5), (left, 2, 0.5)]
    faces = [(0, 1, 2, 3)]
    if name == "glass":
        corners += [(x, y, z - 0.2) for x, y, z in corners]
        faces += [(7, 6, 5, 4), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0)]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(corners, [], faces)
    if index % 2 == 0:
        layer = mesh.uv_layers.new(name="UV")
        for corner, uv in enumerate([(0, 0), (2, 0), (2, 3), (0, 3)]):
            layer.data[corner].uv = uv
    if material:
        material.pass_index = 10 + index
        mesh.materials.append(material)
    patch = bpy.data.objects.new(name, mesh)
    patch.pass_index = 100 + index
    patch.is_holdout = name == "holdout"
    bpy.context.collection.objects.link(patch)


@pytest.fixture
def patches():
    """Under a blue sky, seen from above; a floor behind the left half of each patch only where one can see through."""
    scene = blender_scene.start(WIDTH, HEIGHT, ITERATIONS, SKY)
    for index, (name, make) in enumerate(MATERIALS.items()):
        add_patch(name, index, make())
    floor = make_scenes.add_box("Floor", (0.2 * X["nearly clear"] + 0.5, 1, -2), (1.1, 4, 0.1), bpy.data.materials["Diffuse"])
    floor.pass_index = 7
    scene.sppm.pixel_filter, scene.sppm.filter_width = "BOX", 1.0
    mist = scene.world.mist_settings
    mist.start, mist.depth, mist.falloff = 1.0, 5.0, "LINEAR"
    camera = make_scenes.add_camera((6, 1, 4), (6, 1, 0))
    camera.type, camera.ortho_scale = "ORTHO", 12
    for name in SWITCHES:
        setattr(bpy.context.view_layer, f"use_pass_{name}", True)
    setattr(*compat.denoising_switch(bpy.context.view_layer), True)
    return scene


def render_passes(path, engine="SPPM"):
    """{our name of a pass: (height, width, channels)}"""
    scene = bpy.context.scene
    scene.render.engine = engine
    for name, value in {**UNBIASED, "samples": ITERATIONS, "pixel_filter_type": "BOX"}.items():
        setattr(scene.cycles, name, value)
    try:
        found = {name.partition(".")[2]: pixels for name, pixels in render_layers(path).items()}
    finally:
        scene.render.engine = "SPPM"
    return {name: found.get(compat.pass_name(name)) for name in ("Combined", *PASSES)}


def both(folder):
    return render_passes(folder / "sppm.exr"), render_passes(folder / "cycles.exr", "CYCLES")


def save_pictures(ours, theirs):
    PICTURES.mkdir(parents=True, exist_ok=True)
    for name in PASSES:
        pictures = [as_colors(passes[name]) for passes in (ours, theirs)]
        blender_scene.save_side_by_side(PICTURES / f"pass-{name}-{bpy.app.version_string}.png", *pictures, zoom=6)


def as_colors(pixels):
    """To be looked at: signs dropped, the depth of nothing as black."""
    pixels = np.abs(np.where(pixels > 1e9, 0, pixels))
    return pixels if pixels.shape[2] == 3 else pixels.repeat(3, 2)


def patch(pixels, name):
    rows, columns = MIDDLE
    return pixels[rows, X[name] + columns.start:X[name] + columns.stop]


def test_what_the_middle_of_a_pixel_shows_is_that_of_cycles(patches, tmp_path):
    """Edges too. By the table of its filter Cycles looks 1/2048 of a pixel, which is 0.2 m, beside the middle."""
    ours, theirs = both(tmp_path)
    certain = np.ones(WIDTH, bool)
    certain[X["nearly clear"]:X["nearly clear"] + 6] = False
    for name in ("Depth", "Position", "Object Index", "Material Index"):
        assert ours[name].shape == theirs[name].shape
        np.testing.assert_allclose(ours[name][:, certain], theirs[name][:, certain], rtol=1e-6, atol=2e-4, err_msg=name)
    behind = [patch(ours["Object Index"], "nearly clear").max(), patch(ours["Object Index"], "half clear").max()]
    assert behind == [7, 107], "the first surface that is half opaque"


def test_averages_are_those_of_cycles(patches, tmp_path):
    """Over the middle of each patch: 18 pixels of 64 paths.

    Tolerances: where one may see through, chance decides at each path, in a stratified way; elsewhere it only moves places within
    a pixel, and what is rough reflects by tables, ours and Cycles'.
    """
    ours, theirs = both(tmp_path)
    save_pictures(ours, theirs)
    for name in ("Normal", "UV", "Mist", "Emission", "Environment", "Diffuse Color", "Denoising Albedo", "Denoising Normal"):
        assert ours[name].shape == theirs[name].shape
        for kind in MATERIALS:
            if kind == "nearly clear" and "Denoising" in name:
                continue  # see the next test
            our, their = (patch(passes[name], kind).mean((0, 1)) for passes in (ours, theirs))
            np.testing.assert_allclose(our, their, atol=0.03 if "clear" in kind else 0.01, err_msg=f"{name} of {kind}")


def strips(make, roughnesses, angle):
    """Strips of a material of these roughnesses in the dark, seen in parallel at so many degrees from straight above.

    Smooth ones show the albedo of a white ceiling.
    """
    blender_scene.start(WIDTH, HEIGHT, ITERATIONS)
    make_scenes.add_floor(1e4, make_scenes.diffuse("White", (1.0, 1.0, 1.0)), z=20.0)
    for index, roughness in enumerate(roughnesses):
        mesh = bpy.data.meshes.new("Strip")
        mesh.from_pydata([(x, index + y, 0) for x, y in ((-99, 0), (99, 0), (99, 1), (-99, 1))], [], [(0, 1, 2, 3)])
        mesh.materials.append(make(roughness))
        bpy.context.collection.objects.link(bpy.data.objects.new("Strip", mesh))
    middle, t = len(roughnesses) / 2, np.radians(angle)
    camera = make_scenes.add_camera((9 * np.sin(t), middle, 9 * np.cos(t)), (0, middle, 0))
    camera.type, camera.ortho_scale = "ORTHO", len(roughnesses)
    setattr(*compat.denoising_switch(bpy.context.view_layer), True)


def assert_albedos_are_those_of_cycles(folder, count):
    """Of so many strips, without their borders."""
    means = [passes["Denoising Albedo"].reshape(HEIGHT, count, -1, 3)[:, :, 3:-3].mean((0, 2)) for passes in both(folder)]
    np.testing.assert_allclose(*means, atol=0.01)


@pytest.mark.parametrize("angle", [20, 60, 75, 85])
def test_albedo_of_plastic_is_that_of_cycles(empty_scene, tmp_path, angle):
    """What is reflected toward grazing falls with roughness from 4.0 on, by tables, Cycles' and ours; not in 3.4."""
    roughnesses = (0.25, 0.4, 0.6, 0.8, 1.0)
    strips(lambda roughness: make_scenes.principled("Plastic", (0.5, 0.3, 0.2), Roughness=roughness), roughnesses, angle)
    assert_albedos_are_those_of_cycles(tmp_path, len(roughnesses))


def glossy(color, roughness, distribution):
    material = make_scenes.node_material("Glossy", "ShaderNodeBsdfGlossy", {"Color": color, "Roughness": roughness})
    next(n for n in material.node_tree.nodes if n.type == "BSDF_GLOSSY").distribution = distribution
    return material


METALS = {
    "grey": lambda roughness: make_scenes.metal("Metal", (0.5, 0.5, 0.5), roughness),
    "tinted": lambda roughness: make_scenes.metal("Metal", (0.9, 0.6, 0.2), roughness),
    "glossy": lambda roughness: glossy((0.9, 0.6, 0.2), roughness, "MULTI_GGX"),
    "single scattering": lambda roughness: glossy((0.9, 0.6, 0.2), roughness, "GGX"),
}


@pytest.mark.parametrize("angle", [20, 60, 75, 85])
@pytest.mark.parametrize("make", METALS.values(), ids=METALS.keys())
def test_albedo_of_metal_is_that_of_cycles(empty_scene, tmp_path, make, angle):
    """From 4.0 on, by tables, without what is lost between facets; in 3.4 that of a smooth one."""
    roughnesses = (0.1, 0.3, 0.6, 1.0)
    strips(make, roughnesses, angle)
    assert_albedos_are_those_of_cycles(tmp_path, len(roughnesses))


def test_features_are_of_what_a_path_waits_at(patches, tmp_path):
    """Where a path is scattered by a surface that counts as clear, Cycles leaves features out or takes them from elsewhere."""
    normal = patch(render_passes(tmp_path / "sppm.exr")["Denoising Normal"], "nearly clear")
    assert np.linalg.norm(normal, axis=-1).min() > 0.95


def test_environment_shows_on_a_transparent_film(patches, tmp_path):
    patches.render.film_transparent = True
    ours, theirs = both(tmp_path)
    assert not ours["Combined"][:, GAP].any()
    for name in ("Combined", "Environment", "Denoising Albedo"):
        np.testing.assert_allclose(ours[name][:, GAP], theirs[name][:, GAP], atol=1e-5, err_msg=name)
    np.testing.assert_allclose(ours["Environment"][:, GAP], np.broadcast_to(SKY, (HEIGHT, 1, 3)), atol=1e-5)


@pytest.mark.parametrize("falloff", ["LINEAR", "QUADRATIC", "INVERSE_QUADRATIC"])
def test_mist_is_that_of_cycles(patches, tmp_path, falloff):
    """A perspective camera measures along its rays, not along its axis."""
    make_scenes.add_floor(40.0, bpy.data.materials["Diffuse"], z=1.0)
    patches.camera.data.type, patches.camera.data.lens = "PERSP", 12.0
    patches.world.mist_settings.falloff = falloff
    ours, theirs = both(tmp_path)
    assert np.ptp(ours["Mist"]) > 0.2
    # Within a pixel, over which mist changes by up to 0.03, Cycles' 64 places are others than ours.
    np.testing.assert_allclose(ours["Mist"], theirs["Mist"], atol=3e-3)
    np.testing.assert_allclose(ours["Depth"], 3.0, rtol=1e-5)


def test_positions_far_from_the_origin(patches, tmp_path):
    """The scene is rendered about its own middle, and shown where it is."""
    for thing in bpy.data.objects:
        thing.location.x += 50000
    ours, theirs = both(tmp_path)
    seen = patch(ours["Position"], "diffuse")
    assert seen[..., 0].min() >= 50000 and not ours["Position"][:, GAP].any()
    np.testing.assert_allclose(seen, patch(theirs["Position"], "diffuse"), atol=0.01)  # Cycles computes in floats of 0.004


def test_what_is_not_asked_for_is_not_there(patches, tmp_path):
    for name in SWITCHES:
        setattr(bpy.context.view_layer, f"use_pass_{name}", False)
    setattr(*compat.denoising_switch(bpy.context.view_layer), False)
    assert list(render_layers(tmp_path / "plain.exr")) == ["ViewLayer.Combined"]


def test_passes_that_there_are_not_are_named(patches, tmp_path, capsys):
    """Once, in one line; what is there is not."""
    bpy.context.view_layer.use_pass_vector = bpy.context.view_layer.use_pass_glossy_direct = True
    bpy.context.view_layer.aovs.add().name = "Wear"
    blender_scene.render(tmp_path / "sppm.exr")
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("SPPM:") and "passes" in line]
    assert lines == ["SPPM: view layer 'ViewLayer': there are no passes Vector, Glossy Direct, AOV 'Wear'"]
