"""Every scene of blend_scenes against Cycles of the same Blender, block by block; the statistics are block_comparison's.

Cycles without caustics leaves out every path on which a glossy surface comes after a diffuse one, seen from the camera: not only
L S+ D, but also light that was a caustic, or was mirrored between two diffuse surfaces, before it bounced to where it is seen. No
sum of our passes is the same set of paths, and no path tracer finds caustics of lamps as small as these. So each scene is
compared thrice, and each comparison has the same set of paths on both sides:

- **Direct light**, the scene as it is: E S* L and E S* D L, which is our Direct pass and Cycles with no diffuse bounce and no
  caustics. Nothing here is gathered within a radius, so units, camera, lamps, sky and all that is seen in mirrors and through
  glass are compared without bias. One thing is changed: plastics lose their gloss. Cycles counts a path as glossy when it sampled
  a glossy closure, but weighs it by all closures of the surface, so the diffuse part of a plastic would leak through its limit of
  bounces.
- **Without mirrors and glass**: all light, with every specular material made matt (the pool: without its water): E D+ L.
- **All light under wide lamps**: all materials as they are, caustics on both sides; the lamps are made so wide that Cycles meets
  them by chance often enough for its noise to be known.
"""

import math
from pathlib import Path

import bpy
import make_scenes
import numpy as np
import pytest
from cycles_reference import assert_agree, cycles_pictures, our_pictures

SIZE = 64

# What a block may differ by, noise apart. Cycles 3.4 loses 1.5 % of the light where rays hit the shared edge of two triangles, up
# to 0.16 % of a block (the back wall of the Cornell box), and shows spherical lamps as disks: 0.02 % near the ring's.
ALLOWANCE = 0.002
# The median standard error of a block that still tests something.
PRECISION = 0.015

# How our light is estimated where all light is compared. Photons are gathered within a quarter of a pixel's width: what a kernel
# loses at an edge then stays below the noise of a block.
PHOTONS_PER_ITERATION = 32768
RADIUS_IN_PIXELS = 0.25
SETTINGS = {"indirect": "PATHS"}  # of the engine: other indirect light without any kernel

WIDTH = {  # of what the camera sees, metres
    "cornell_glass": 2.4, "cornell_diffuse": 2.4, "ring": 0.15, "pool": 4.0, "sun_glass": 0.2, "instances": 2.6,
    "dof_ortho": 1.25, "world": 0.75, "wineglass_hdri": 0.4,
}
NAMES = [scene.__name__ for scene in make_scenes.SCENES]
SPECULAR = [name for name in NAMES if name != "cornell_diffuse"]
FAST = ("cornell_glass", "ring")


def open_scene(name, iterations):
    bpy.ops.wm.open_mainfile(filepath=str(Path(make_scenes.__file__).parent / f"{name}.blend"))
    scene = bpy.context.scene
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.sppm.iterations = iterations
    scene.sppm.photons_per_iteration = PHOTONS_PER_ITERATION
    scene.sppm.initial_radius = RADIUS_IN_PIXELS * WIDTH[name] / SIZE
    for setting, value in SETTINGS.items():
        setattr(scene.sppm, setting, value)
    return scene


# ---------------------------------------------------------------- what is changed in a scene


def shaders():
    """All shader nodes of all materials."""
    return [node for material in bpy.data.materials if material.node_tree
            for node in material.node_tree.nodes if node.type.startswith("BSDF")]


def set_inputs(node, **values):
    """Sets those of the inputs, 3.4's names or 4.0's, that the node has."""
    for name, value in values.items():
        socket = node.inputs.get(name.replace("_", " "))
        if socket:
            socket.default_value = value


def take_gloss():
    """Plastics keep their diffuse base only."""
    for node in shaders():
        if node.type == "BSDF_PRINCIPLED" and not node.inputs["Metallic"].default_value:
            set_inputs(node, Specular=0.0, Specular_IOR_Level=0.0)


def make_matt():
    """Every surface is diffuse; water is taken away, for its sheet covers all the rest."""
    for node in shaders():
        if node.type == "BSDF_PRINCIPLED":
            set_inputs(node, Metallic=0.0, Transmission=0.0, Transmission_Weight=0.0, Clearcoat=0.0, Coat_Weight=0.0)
    take_gloss()
    for material in bpy.data.materials:
        glass = next((node for node in shaders() if node.id_data == material.node_tree and node.type == "BSDF_GLASS"), None)
        if glass:
            replace_by_diffuse(material.node_tree, glass)
    if "Goblet" in bpy.data.objects:  # photons of the sun would hardly meet two small matt things on this floor of 3 m
        bpy.data.objects["Floor"].scale = (0.2, 0.2, 1.0)
    if "Water" in bpy.data.objects:
        bpy.data.objects.remove(bpy.data.objects["Water"])


def replace_by_diffuse(tree, shader):
    matt = tree.nodes.new("ShaderNodeBsdfDiffuse")
    matt.inputs["Color"].default_value = (0.5, 0.6, 0.7, 1.0)
    tree.links.new(matt.outputs[0], shader.outputs[0].links[0].to_socket)
    tree.nodes.remove(shader)


def widen_lamps(scene, size):
    """Lamps become disks of that size [m], a sun 30 degrees wide, and a sky keeps nothing brighter than its window."""
    for lamp in [thing for thing in scene.objects if thing.type == "LIGHT"]:
        if lamp.data.type == "SUN":
            lamp.data.angle = math.radians(30)
            continue
        lamp.data.type = "AREA"  # the lamp's data has another class now
        lamp.data.shape, lamp.data.size = "DISK", size
        if lamp.name == "Point":
            make_scenes.aim(lamp, lamp.location, (0.0, 0.0, 0.0))
    sky = bpy.data.images.get("Sky") or bpy.data.images.get("Clear sky")
    if sky:
        pixels = np.empty(len(sky.pixels), np.float32)
        sky.pixels.foreach_get(pixels)
        sky.pixels.foreach_set(np.minimum(pixels, 9.0))
        sky.update()
        sky.pack()


# ---------------------------------------------------------------- rendering and comparing


@pytest.mark.parametrize("name", [name if name in FAST else pytest.param(name, marks=pytest.mark.slow) for name in NAMES])
def test_direct_light(name, tmp_path):
    scene = open_scene(name, iterations=64)
    scene.sppm.photons_per_iteration = 1
    take_gloss()
    ours = our_pictures(tmp_path, "Direct")
    theirs = cycles_pictures(tmp_path, 64, diffuse_bounces=0, caustics_reflective=False, caustics_refractive=False)
    assert_agree(f"{name}-direct", ours, theirs, ALLOWANCE, PRECISION)


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_without_mirrors_and_glass(name, tmp_path):
    open_scene(name, iterations=96)
    make_matt()
    assert_agree(f"{name}-matt", our_pictures(tmp_path), cycles_pictures(tmp_path, 96), ALLOWANCE, PRECISION)


LAMP_SIZE = {"cornell_glass": 0.5, "ring": 0.1, "pool": 2.0, "sun_glass": 0.2, "instances": 0.8, "dof_ortho": 0.6, "world": 0.0,
             "wineglass_hdri": 0.0}


# Bounces on either side: at 24 thick glass still has light to lose, and each program counts in its own way what it cuts off.
DEEP = 200


@pytest.mark.slow
@pytest.mark.parametrize("name", SPECULAR)
def test_all_light_under_wide_lamps(name, tmp_path):
    scene = open_scene(name, iterations=128)
    scene.sppm.max_depth = DEEP
    widen_lamps(scene, LAMP_SIZE[name])
    limits = dict(max_bounces=DEEP, diffuse_bounces=DEEP, glossy_bounces=DEEP, transmission_bounces=DEEP)
    assert_agree(f"{name}-wide", our_pictures(tmp_path), cycles_pictures(tmp_path, 512, **limits), ALLOWANCE, PRECISION)
