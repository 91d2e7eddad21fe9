"""Nodes of values, colours and textures become numbers and textures; what cannot be said becomes a warning."""

import math

import pytest
from material_bench import RED, close
from sppm.export_material import MaterialExporter
from sppm.material_params import luminance
from sppm.nodes_closure import f0_from_ior, ior_from_f0
from sppm.nodes_walk import Needs
from sppm.scene_desc import Blend, Extension, Interpolation, TextureType


def test_value_and_color_to_number(bench):
    diffuse, color = bench.surface(bench.node("BsdfGlossy")), bench.node("RGB")
    diffuse.distribution = "GGX"
    color.outputs[0].default_value = (1, 0, 0, 1)
    bench.link(color.outputs[0], diffuse.inputs["Roughness"])
    assert close(bench.export()[0].roughness.value[0], 0.2126)


def test_value(bench):
    node = bench.node("Value")
    node.outputs[0].default_value = 0.3
    assert close(bench.emitted(node.outputs[0]).value, (0.3,) * 3)


@pytest.mark.parametrize("extension", ["REPEAT", "EXTEND", "CLIP", "MIRROR"])
def test_image(bench, extension):
    node = bench.image()
    if extension not in node.bl_rna.properties["extension"].enum_items:
        pytest.skip("not in this Blender")
    node.extension, node.interpolation = extension, "Closest"
    texture = bench.texture(bench.emitted(node.outputs["Color"]))
    assert (texture.type, texture.image, texture.mapping) == (TextureType.IMAGE, 7, None)
    assert texture.extension is Extension[extension] and texture.interpolation is Interpolation.CLOSEST
    assert bench.exporter.needs[1] == Needs(uv_map="") and not bench.warnings


def test_missing_image_is_magenta(bench):
    assert bench.emitted(bench.node("TexImage").outputs[0]).value == (1, 0, 1) and "magenta" in bench.warnings[0]


def test_box_projection_warns(bench):
    node = bench.image()
    node.projection = "BOX"
    bench.emitted(node.outputs[0])
    assert "projection Box" in bench.warnings[0]


@pytest.mark.parametrize("kind, expected", [("POINT", (0, -3, 0, 10, 2, 0, 0, 20, 0, 0, 1, 0)),
                                            ("TEXTURE", (0, 0.5, 0, -10, -1 / 3, 0, 0, 10 / 3, 0, 0, 1, 0)),
                                            ("VECTOR", (0, -3, 0, 0, 2, 0, 0, 0, 0, 0, 1, 0))])
def test_mapping(bench, kind, expected):
    image, uv, mapping = bench.image(), bench.node("UVMap"), bench.node("Mapping")
    uv.uv_map, mapping.vector_type = "Second", kind
    mapping.inputs["Rotation"].default_value[2] = math.pi / 2
    mapping.inputs["Scale"].default_value = (2, 3, 1)
    if kind != "VECTOR":
        mapping.inputs["Location"].default_value = (10, 20, 0)
    bench.link(uv.outputs[0], mapping.inputs["Vector"])
    bench.link(mapping.outputs[0], image.inputs["Vector"])
    texture = bench.texture(bench.emitted(image.outputs[0]))
    assert texture.mapping == pytest.approx(expected, abs=1e-5) and bench.exporter.needs[1].uv_map == "Second"


def test_texture_coordinates(bench):
    image, coordinates = bench.image(), bench.node("TexCoord")
    bench.link(coordinates.outputs["UV"], image.inputs["Vector"])
    bench.emitted(image.outputs[0])
    assert not bench.warnings
    bench.link(coordinates.outputs["Generated"], image.inputs["Vector"])
    MaterialExporter(bench.scene, bench.warnings.append, lambda image: 1).export(bench.material)
    assert "Generated" in bench.warnings[0]


def test_two_uv_maps_warn(bench):
    mix = bench.node("MixRGB")
    for socket, name in ((1, "A"), (2, "B")):
        image, uv = bench.image(), bench.node("UVMap")
        uv.uv_map = name
        bench.link(uv.outputs[0], image.inputs["Vector"])
        bench.link(image.outputs[0], mix.inputs[socket])
    bench.emitted(mix.outputs[0])
    assert bench.exporter.needs[1].uv_map == "A" and "one UV map" in bench.warnings[0]


@pytest.mark.parametrize("name, field", [("VertexColor", "layer_name"), ("Attribute", "attribute_name")])
def test_colors(bench, name, field):
    node = bench.node(name)
    setattr(node, field, "Col")
    assert bench.texture(bench.emitted(node.outputs["Color"])).type is TextureType.ATTRIBUTE
    assert bench.exporter.needs[1] == Needs(colors="Col")


@pytest.mark.parametrize("blend, expected", [("MIX", 0.35), ("MULTIPLY", 0.3), ("ADD", 0.75), ("SUBTRACT", 0.25), ("SCREEN", 0.6),
                                             ("DIFFERENCE", 0.4), ("DARKEN", 0.35), ("LIGHTEN", 0.5)])
@pytest.mark.parametrize("name", ["MixRGB", "Mix"])
def test_mix_color(bench, name, blend, expected):
    node, a, b = bench.node(name), (0.5, 0.5, 0.5, 1), (0.2, 0.2, 0.2, 1)
    if name == "Mix":
        node.data_type = "RGBA"
        sockets = {s.identifier: s for s in node.inputs}
        factor, first, second = sockets["Factor_Float"], sockets["A_Color"], sockets["B_Color"]
        out = next(s for s in node.outputs if s.type == "RGBA")
    else:
        factor, first, second, out = *node.inputs, node.outputs[0]
    node.blend_type, factor.default_value, first.default_value, second.default_value = blend, 0.5, a, b
    expected = {"MULTIPLY": 0.3, "ADD": 0.6, "SUBTRACT": 0.4, "SCREEN": 0.55}.get(blend, expected)
    assert close(bench.emitted(out).value[0], expected)


def test_mix_of_textures(bench):
    node = bench.node("MixRGB")
    node.blend_type, node.inputs[0].default_value = "SCREEN", 0.5
    bench.link(bench.image().outputs[0], node.inputs[1])
    texture = bench.texture(bench.emitted(node.outputs[0]))
    assert texture.type is TextureType.MIX and texture.blend is Blend.SCREEN
    assert bench.scene.textures[texture.factor - 1].value[0] == 0.5


def test_mix_float(bench):
    node = bench.node("Mix")
    node.data_type = "FLOAT"
    for identifier, value in (("Factor_Float", 0.25), ("A_Float", 1.0), ("B_Float", 3.0)):
        next(s for s in node.inputs if s.identifier == identifier).default_value = value
    assert close(bench.emitted(node.outputs[0]).value[0], 1.5)


def test_unsupported_blend_warns(bench):
    node = bench.node("MixRGB")
    node.blend_type, node.inputs[1].default_value = "OVERLAY", RED
    assert close(bench.emitted(node.outputs[0]).value, RED[:3]) and "Overlay" in bench.warnings[0]


@pytest.mark.parametrize("name, inputs, expected", [
    ("Invert", {"Color": RED}, (0.2, 0.8, 0.9)),
    ("Gamma", {"Color": RED, "Gamma": 2.0}, (0.64, 0.04, 0.01)),
    ("HueSaturation", {"Color": RED, "Value": 0.5}, (0.4, 0.1, 0.05)),
    ("HueSaturation", {"Color": RED, "Saturation": 0.0}, (0.8, 0.8, 0.8)),
    ("BrightContrast", {"Color": RED, "Bright": 0.1}, (0.9, 0.3, 0.2)),
    ("Clamp", {"Value": 2.0}, (1, 1, 1)),
    ("MapRange", {"Value": 0.5, "To_Max": 4.0}, (2, 2, 2)),
    ("RGBToBW", {"Color": (1, 1, 1, 1)}, (1, 1, 1)),
    ("CombineColor", {"Red": 0.1, "Green": 0.2, "Blue": 0.3}, (0.1, 0.2, 0.3)),
    ("SeparateColor", {"Color": RED}, (0.8, 0.8, 0.8)),
    ("ValToRGB", {"Fac": 0.25}, (0.25, 0.25, 0.25)),
])
def test_constants_are_folded(bench, name, inputs, expected):
    node = bench.node(name)
    for key, value in inputs.items():
        socket = node.inputs.get(key.replace("_", " ")) or node.inputs["Factor"]
        socket.default_value = value
    assert close(bench.emitted(node.outputs[0]).value, expected) and not bench.scene.textures and not bench.warnings


@pytest.mark.parametrize("operation, expected", [
    ("ADD", 2.5), ("SUBTRACT", 1.5), ("MULTIPLY", 1), ("DIVIDE", 4), ("POWER", 2 ** 0.5), ("GREATER_THAN", 1), ("MINIMUM", 0.5),
    ("SQRT", 2 ** 0.5)])
def test_math(bench, operation, expected):
    node = bench.node("Math")
    node.operation, node.inputs[0].default_value, node.inputs[1].default_value = operation, 2.0, 0.5
    assert close(bench.emitted(node.outputs[0]).value[0], expected)


def test_math_of_texture(bench):
    node = bench.node("Math")
    node.operation, node.inputs[1].default_value = "MULTIPLY", 0.5
    bench.link(bench.image().outputs["Color"], node.inputs[0])
    param = bench.emitted(node.outputs[0])
    assert param.value == (0.5,) * 3 and bench.texture(param).type is TextureType.IMAGE


def test_math_of_texture_unsupported_warns(bench):
    node = bench.node("Math")
    node.operation = "POWER"
    bench.link(bench.image().outputs["Color"], node.inputs[0])
    assert bench.emitted(node.outputs[0]).texture and "Power" in bench.warnings[0]


def test_ramp_of_texture(bench):
    node = bench.node("ValToRGB")
    bench.link(bench.image().outputs["Color"], node.inputs[0])
    assert bench.texture(bench.emitted(node.outputs[0])).blend is Blend.MIX and not bench.warnings


@pytest.mark.parametrize("name", ["Gamma", "HueSaturation", "RGBToBW", "SeparateColor", "RGBCurve"])
def test_textures_pass_through_with_warning(bench, name):
    node = bench.node(name)
    image = bench.image().outputs["Color"]
    bench.link(image, node.inputs["Color"])
    for key, value in (("Gamma", 2.0), ("Hue", 0.3)):
        if node.inputs.get(key):
            node.inputs[key].default_value = value
    param = bench.emitted(node.outputs[0])
    assert bench.texture(param).type is TextureType.IMAGE and len(bench.warnings) == 1


def test_blackbody_is_normalised(bench):
    node = bench.node("Blackbody")
    node.inputs[0].default_value = 6500
    color = bench.emitted(node.outputs[0]).value
    assert luminance(color) == pytest.approx(1, abs=0.01) and max(color) / min(color) < 1.1


def test_unknown_texture_keeps_the_consumers_value(bench):
    diffuse = bench.surface(bench.node("BsdfDiffuse", Color=RED))
    bench.link(bench.node("TexNoise").outputs[0], diffuse.inputs["Color"])
    assert close(bench.export()[0].color.value, RED[:3]) and "not supported" in bench.warnings[0]


def test_unknown_texture_with_colours_gives_its_first(bench):
    node = bench.node("TexChecker", Color1=RED)
    assert close(bench.emitted(node.outputs[0]).value, RED[:3]) and bench.warnings


def test_same_textures_are_added_once(bench):
    image, mix = bench.image(), bench.node("MixRGB")
    mix.blend_type, mix.inputs[0].default_value = "ADD", 1.0
    bench.link(image.outputs[0], mix.inputs[1])
    bench.link(image.outputs[0], mix.inputs[2])
    bench.emitted(mix.outputs[0])
    assert [t.type for t in bench.scene.textures].count(TextureType.IMAGE) == 1


def test_ior_and_f0_are_inverse():
    assert ior_from_f0(f0_from_ior(1.7)) == pytest.approx(1.7)
