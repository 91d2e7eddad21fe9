"""Lamps and world in radiometric units; nothing is rendered."""

import math

import bpy
import make_scenes
import numpy as np
import pytest
from sppm import scene_desc

DOWN = ((0, 0, 1.5), (0, 0, 0))


def exported_lamp(export, kind, **settings):
    lamp = make_scenes.add_lamp(kind, *DOWN, 10.0, **settings)
    lamp.data.color = (1.0, 0.5, 0.25)
    (light,), warnings = export()[0].lights, export()[1]
    assert warnings == []
    assert np.allclose(np.array(light.emission) / light.emission[0], (1.0, 0.5, 0.25))
    assert np.allclose(light.transform[:, 2], (0, 0, 1), atol=1e-6), "light goes along -z"
    assert np.allclose(light.transform[:, 3], DOWN[0])
    return light


def test_point_lamp(export):
    light = exported_lamp(export, "POINT", shadow_soft_size=0.25)
    assert (light.type, light.radius) == (scene_desc.LightType.POINT, 0.25)
    assert light.emission[0] == pytest.approx(10 / (4 * math.pi))


def test_spot_lamp(export):
    light = exported_lamp(export, "SPOT", shadow_soft_size=0.25, spot_size=1.0, spot_blend=0.5)
    assert (light.type, light.radius, light.blend) == (scene_desc.LightType.SPOT, 0.25, 0.5)
    assert light.angle == pytest.approx(1.0)
    assert light.emission[0] == pytest.approx(10 / (4 * math.pi))


def test_sun_lamp(export):
    light = exported_lamp(export, "SUN", angle=0.125)
    assert (light.type, light.angle) == (scene_desc.LightType.SUN, 0.125)
    cosine = math.cos(0.125 / 2)
    assert light.emission[0] == pytest.approx(10 if bpy.app.version >= (4, 0, 0) else 10 * 2 * cosine / (1 + cosine))


@pytest.mark.parametrize("shape, area", [("SQUARE", 4), ("RECTANGLE", 1), ("DISK", math.pi), ("ELLIPSE", math.pi / 4)])
@pytest.mark.parametrize("scale", [1.0, 2.0])
def test_area_lamp(export, shape, area, scale):
    """The power is that of the whole lamp, however it is scaled; Blender 3.4 divides by 4 A, later ones by pi A."""
    lamp = make_scenes.add_lamp("AREA", *DOWN, 10.0, shape=shape, size=2.0, size_y=0.5)
    lamp.scale = (scale, 1, 1)
    (light,) = export()[0].lights
    is_round = shape in ("DISK", "ELLIPSE")
    assert light.type == (scene_desc.LightType.ELLIPSE if is_round else scene_desc.LightType.RECTANGLE)
    assert (light.size_x, light.size_y) == (2.0, 0.5 if shape in ("RECTANGLE", "ELLIPSE") else 2.0)
    per_area = 4 if bpy.app.version < (4, 0, 0) else math.pi
    assert light.emission[0] == pytest.approx(10 / (per_area * area * scale))


@pytest.mark.parametrize("energy", [0.0, -5.0])
def test_lamp_without_light_is_left_out(export, energy):
    make_scenes.add_lamp("POINT", *DOWN, energy)
    desc, warnings = export()
    assert desc.lights == []
    assert len(warnings) == (energy < 0)


def test_world(export):
    background = bpy.context.scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (0.1, 0.2, 0.4, 1.0)
    background.inputs["Strength"].default_value = 2.0
    assert np.allclose(export()[0].world.radiance, (0.2, 0.4, 0.8))


def test_no_world_is_black(export):
    bpy.context.scene.world = None
    assert export()[0].world is None


@pytest.mark.skipif("exposure" not in bpy.types.Light.bl_rna.properties, reason="lamps have an exposure from Blender 4.5 on")
def test_exposure_temperature_and_normalisation_of_lamps(export):
    lamp = make_scenes.add_lamp("AREA", *DOWN, 10.0, shape="SQUARE", size=2.0).data
    usual = export()[0].lights[0].emission[0]
    lamp.exposure = 3.0
    assert export()[0].lights[0].emission[0] == pytest.approx(8 * usual)
    lamp.normalize = False
    assert export()[0].lights[0].emission[0] == pytest.approx(4 * 8 * usual), "as strong, of 4 square metres"
    lamp.use_temperature, lamp.temperature = True, 3000.0
    warm = export()[0].lights[0].emission
    assert warm[0] > warm[1] > warm[2]


def test_nodes_of_lamps(export):
    """A constant counts, anything else is named."""
    lamp = make_scenes.add_lamp("POINT", *DOWN, 10.0).data
    usual = export()[0].lights[0].emission[0]
    lamp.use_nodes = True
    emission = lamp.node_tree.nodes["Emission"]
    emission.inputs["Strength"].default_value = 3.0
    assert export()[0].lights[0].emission[0] == pytest.approx(3 * usual)
    body = lamp.node_tree.nodes.new("ShaderNodeBlackbody")
    body.inputs[0].default_value = 3000.0
    lamp.node_tree.links.new(body.outputs[0], emission.inputs["Color"])
    warm = export()[0].lights[0].emission
    assert warm[0] > warm[1] > warm[2]
    assert np.dot(warm, (0.2126, 0.7152, 0.0722)) == pytest.approx(3 * usual, rel=0.02), "of luminance 1"
    texture = lamp.node_tree.nodes.new("ShaderNodeTexNoise")
    lamp.node_tree.links.new(texture.outputs[0], emission.inputs["Strength"])
    assert any("'Point'" in warning and "Noise" in warning for warning in export()[1])


def test_sky_texture_is_named(export):
    tree = bpy.context.scene.world.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeTexSky").outputs[0], tree.nodes["Background"].inputs["Color"])
    assert any("Sky Texture" in warning for warning in export()[1])
