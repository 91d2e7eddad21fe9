"""Shader nodes become closures and textures; what cannot be said becomes a warning. Runs inside any Blender."""

import math
import sys
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy")
sys.path.insert(0, str(Path(__file__).parents[2]))

from addon.compat_nodes import principled_input, principled_is_v2  # noqa: E402
from addon.export_material import MaterialExporter  # noqa: E402
from addon.material_params import ZERO, luminance  # noqa: E402
from addon.nodes_closure import f0_from_ior, ior_from_f0  # noqa: E402
from addon.nodes_walk import Needs  # noqa: E402
from addon.scene_desc import Blend, ClosureFlags, ClosureType, Extension, Interpolation, SceneDesc, TextureType  # noqa: E402

V2 = bpy.app.version >= (4, 0, 0)
GGX = ClosureFlags.NONE if V2 else ClosureFlags.SEPARABLE  # without multiple scattering
RED = (0.8, 0.2, 0.1, 1.0)


class Bench:
    """One material whose tree a test builds, and the exporter with its warnings."""

    def __init__(self):
        self.material = bpy.data.materials.new("Test")
        self.material.use_nodes = True
        self.tree = self.material.node_tree
        self.tree.nodes.clear()
        self.output = self.node("OutputMaterial")
        self.scene, self.warnings = SceneDesc(), []
        self.exporter = MaterialExporter(self.scene, self.warnings.append, lambda image: 7)

    def node(self, name, tree=None, **inputs):
        node = (tree or self.tree).nodes.new(name if name.startswith(("Node", "Shader")) else f"ShaderNode{name}")
        for key, value in inputs.items():
            socket = principled_input(node, key.replace("_", " "))
            socket.default_value = value
        return node

    def link(self, out, socket, tree=None):
        (tree or self.tree).links.new(out, socket)

    def surface(self, node):
        self.link(node.outputs[0], self.output.inputs["Surface"])
        return node

    def export(self):
        self.id = self.exporter.export(self.material)
        return self.scene.materials[self.id - 1].closures

    def emitted(self, out):
        """The Param that `out` has as the colour of an Emission shader."""
        emission = self.surface(self.node("Emission"))
        self.link(out, emission.inputs["Color"])
        closures = self.export()
        return closures[0].color if closures else ZERO

    def texture(self, param):
        return self.scene.textures[param.texture - 1]

    def image(self):
        node = self.node("TexImage")
        node.image = bpy.data.images.new("picture", 2, 2)
        return node

    def mix(self, factor, first, second):
        """Mix Shader of two shader nodes; `factor` is a number or an output."""
        mix = self.surface(self.node("MixShader"))
        if isinstance(factor, float):
            mix.inputs[0].default_value = factor
        else:
            self.link(factor, mix.inputs[0])
        self.link(first.outputs[0], mix.inputs[1])
        self.link(second.outputs[0], mix.inputs[2])
        return mix


@pytest.fixture
def bench():
    return Bench()


def types(closures):
    return [c.type.name for c in closures]


def close(a, b):
    return a == pytest.approx(b, abs=1e-5)


# ---------------------------------------------------------------- whole materials

def test_none_is_grey_and_exported_once(bench):
    assert bench.exporter.export(None) == bench.exporter.export(None) == 1
    assert bench.scene.materials[0].closures[-1].color.value == (0.8, 0.8, 0.8)
    assert bench.exporter.needs[1] == Needs()


@pytest.mark.skipif(bpy.app.version >= (5, 0, 0), reason="Material.use_nodes is always true in 5.0")
def test_without_nodes_viewport_color(bench):
    bench.material.use_nodes = False
    bench.material.diffuse_color = RED
    assert close(bench.export()[0].color.value, RED[:3])


def test_empty_output_is_black(bench):
    assert bench.export() == () and not bench.warnings


def test_no_output_is_black(bench):
    bench.tree.nodes.clear()
    assert bench.export() == ()


def test_material_is_cached(bench):
    bench.surface(bench.node("BsdfDiffuse"))
    bench.export()
    bench.export()
    assert len(bench.scene.materials) == 1


def test_volume_warns(bench):
    bench.link(bench.node("VolumeScatter").outputs[0], bench.output.inputs["Volume"])
    bench.export()
    assert "volume is not rendered" in bench.warnings[0] and "Test" in bench.warnings[0]


def test_more_closures_than_allowed_warn(bench):
    shader = bench.node("BsdfDiffuse")
    for _ in range(17):
        add = bench.node("AddShader")
        bench.link(shader.outputs[0], add.inputs[0])
        bench.link(bench.node("BsdfDiffuse").outputs[0], add.inputs[1])
        shader = add
    bench.surface(shader)
    assert len(bench.export()) == 16 and "more than 16" in bench.warnings[0]


# ---------------------------------------------------------------- links

def test_reroute_and_muted_node(bench):
    diffuse, reroute, invert = bench.surface(bench.node("BsdfDiffuse")), bench.node("NodeReroute"), bench.node("Invert")
    color = bench.node("RGB")
    color.outputs[0].default_value = RED
    bench.link(color.outputs[0], reroute.inputs[0])
    bench.link(reroute.outputs[0], invert.inputs["Color"])
    bench.link(invert.outputs[0], diffuse.inputs["Color"])
    invert.mute = True
    assert close(bench.export()[0].color.value, RED[:3])


def color_socket(tree, name, side):
    if hasattr(tree, "interface"):
        return tree.interface.new_socket(name, in_out=side, socket_type="NodeSocketColor" if name == "C" else "NodeSocketShader")
    sockets = tree.inputs if side == "INPUT" else tree.outputs
    return sockets.new("NodeSocketColor" if name == "C" else "NodeSocketShader", name)


@pytest.mark.parametrize("linked", [False, True])
def test_nested_groups(bench, linked):
    inner = outer = None
    for level in range(2):
        tree = bpy.data.node_groups.new(f"group{level}", "ShaderNodeTree")
        color_socket(tree, "C", "INPUT")
        color_socket(tree, "S", "OUTPUT")
        entry, leave = bench.node("NodeGroupInput", tree), bench.node("NodeGroupOutput", tree)
        shader = bench.node("ShaderNodeGroup" if inner else "BsdfDiffuse", tree)
        if inner:
            shader.node_tree = inner
        bench.link(entry.outputs[0], shader.inputs[0], tree)
        bench.link(shader.outputs[0], leave.inputs[0], tree)
        inner, outer = tree, tree
    group = bench.node("ShaderNodeGroup")
    group.node_tree = outer
    bench.surface(group)
    group.inputs[0].default_value = RED
    if linked:
        color = bench.node("RGB")
        color.outputs[0].default_value = (0.1, 0.2, 0.3, 1)
        bench.link(color.outputs[0], group.inputs[0])
    assert close(bench.export()[0].color.value, (0.1, 0.2, 0.3) if linked else RED[:3])


def test_cycle_ends_with_a_warning(bench):
    a, b = bench.surface(bench.node("AddShader")), bench.node("AddShader")
    bench.link(a.outputs[0], b.inputs[0])
    bench.link(b.outputs[0], a.inputs[0])
    bench.link(bench.node("BsdfDiffuse").outputs[0], a.inputs[1])
    assert types(bench.export()) == ["DIFFUSE"]


# ---------------------------------------------------------------- simple shaders

def test_diffuse_and_its_roughness(bench):
    bench.surface(bench.node("BsdfDiffuse", Color=RED, Roughness=0.5))
    closure, = bench.export()
    assert closure.type is ClosureType.DIFFUSE and close(closure.color.value, RED[:3])
    assert "Lambert" in bench.warnings[0]


def test_glass(bench):
    node = bench.surface(bench.node("BsdfGlass", Color=RED, Roughness=0.3, IOR=1.33))
    node.distribution = "MULTI_GGX"
    closure, = bench.export()
    assert closure.type is ClosureType.DIELECTRIC and closure.flags == ClosureFlags.PRESERVE_ENERGY
    assert closure.color == closure.color2 and close(closure.ior, 1.33) and close(closure.roughness.value[0], 0.3)
    assert not bench.warnings


def test_beckmann_warns_only_when_rough(bench):
    node = bench.surface(bench.node("BsdfGlass", Roughness=0.0))
    node.distribution = "BECKMANN"
    bench.export()
    assert not bench.warnings
    node.inputs["Roughness"].default_value = 0.2
    MaterialExporter(bench.scene, bench.warnings.append, None).export(bench.material)
    assert "Beckmann" in bench.warnings[0]


def test_refraction(bench):
    node = bench.surface(bench.node("BsdfRefraction", IOR=1.5))
    node.distribution = "GGX"
    closure, = bench.export()
    assert closure.flags == ClosureFlags.REFRACTION_ONLY | GGX


@pytest.mark.parametrize("name", ["ShaderNodeBsdfGlossy", "ShaderNodeBsdfAnisotropic"])
def test_glossy(bench, name):
    node = bench.surface(bench.node(name, Color=RED, Roughness=0.4))
    node.distribution = "GGX"
    closure, = bench.export()
    assert closure.type is ClosureType.CONDUCTOR and closure.color == closure.color2 and closure.flags == GGX


@pytest.mark.skipif(bpy.app.version < (4, 3, 0), reason="Metallic BSDF begins with 4.3")
def test_metallic(bench):
    bench.surface(bench.node("BsdfMetallic", Base_Color=RED, Edge_Tint=(1, 1, 1, 1)))
    closure, = bench.export()
    assert closure.type is ClosureType.CONDUCTOR and close(closure.color.value, RED[:3]) and closure.color2.value == (1, 1, 1)


def test_transparent_and_emission(bench):
    add = bench.surface(bench.node("AddShader"))
    bench.link(bench.node("BsdfTransparent", Color=RED).outputs[0], add.inputs[0])
    bench.link(bench.node("Emission", Color=RED, Strength=10.0).outputs[0], add.inputs[1])
    transparent, emission = bench.export()
    assert close(transparent.color.value, RED[:3]) and close(emission.color.value, (8, 2, 1))


def test_unsupported_shaders_warn(bench):
    bench.mix(0.5, bench.node("BsdfTranslucent"), bench.node("Holdout"))
    assert types(bench.export()) == ["DIFFUSE"]
    assert any("diffuse" in w for w in bench.warnings) and any("black" in w for w in bench.warnings)


def test_bump_warns(bench):
    diffuse = bench.surface(bench.node("BsdfDiffuse"))
    bench.link(bench.node("Bump").outputs[0], diffuse.inputs["Normal"])
    bench.export()
    assert "bump" in bench.warnings[0]


# ---------------------------------------------------------------- mixing

def test_mix_constant(bench):
    bench.mix(0.25, bench.node("BsdfDiffuse"), bench.node("BsdfTransparent"))
    diffuse, transparent = bench.export()
    assert close(diffuse.weight.value[0], 0.75) and close(transparent.weight.value[0], 0.25)


def test_mix_of_nothing_is_not_emitted(bench):
    bench.mix(1.0, bench.node("Holdout"), bench.node("BsdfDiffuse"))
    assert types(bench.export()) == ["DIFFUSE"] and not bench.warnings


def test_mix_textured(bench):
    bench.mix(bench.image().outputs["Alpha"], bench.node("BsdfTransparent"), bench.node("BsdfDiffuse"))
    transparent, diffuse = bench.export()
    assert bench.texture(diffuse.weight).type is TextureType.IMAGE_ALPHA
    rest = bench.texture(transparent.weight)
    assert rest.blend is Blend.SUBTRACT and rest.b == diffuse.weight.texture and bench.exporter.needs[1].uv_map is not None


def test_nested_textured_mixes_multiply(bench):
    inner = bench.mix(bench.image().outputs["Alpha"], bench.node("BsdfTransparent"), bench.node("BsdfDiffuse"))
    bench.mix(bench.image().outputs["Color"], bench.node("BsdfTransparent"), inner)
    diffuse = bench.export()[-1]
    assert bench.texture(diffuse.weight).blend is Blend.MULTIPLY


def test_fresnel_mix_is_a_coat(bench):
    glossy = bench.node("BsdfGlossy", Roughness=0.1)
    bench.mix(bench.node("Fresnel", IOR=1.6).outputs[0], bench.node("BsdfDiffuse"), glossy)
    coat, diffuse = bench.export()
    assert coat.type is ClosureType.COAT and coat.flags & ClosureFlags.ATTENUATE and close(coat.ior, 1.6)
    assert diffuse.weight.value == (1, 1, 1)


def test_layer_weight_is_a_coat(bench):
    factor = bench.node("LayerWeight", Blend=0.5).outputs["Fresnel"]
    bench.mix(factor, bench.node("BsdfDiffuse"), bench.node("BsdfGlossy"))
    assert close(bench.export()[0].ior, 2.0)


def test_fresnel_mix_of_refraction_is_glass(bench):
    nodes = bench.node("BsdfRefraction", Roughness=0.0, IOR=1.5), bench.node("BsdfGlossy", Roughness=0.0)
    bench.mix(bench.node("Fresnel", IOR=1.5).outputs[0], *nodes)
    closure, = bench.export()
    assert closure.type is ClosureType.DIELECTRIC and not closure.flags & ClosureFlags.REFRACTION_ONLY


def test_other_fresnel_mix_is_constant_with_warning(bench):
    bench.mix(bench.node("Fresnel", IOR=1.5).outputs[0], bench.node("BsdfDiffuse"), bench.node("Emission"))
    assert close(bench.export()[1].weight.value[0], 0.04) and "angle" in bench.warnings[0]


def test_facing_is_constant_with_warning(bench):
    bench.mix(bench.node("LayerWeight").outputs["Facing"], bench.node("BsdfDiffuse"), bench.node("BsdfGlossy"))
    assert close(bench.export()[1].weight.value[0], 1 / 3) and bench.warnings


def test_shadow_ray_trick_is_the_glass(bench):
    path, most = bench.node("LightPath"), bench.node("Math")
    most.operation = "MAXIMUM"
    bench.link(path.outputs["Is Shadow Ray"], most.inputs[0])
    bench.link(path.outputs["Is Diffuse Ray"], most.inputs[1])
    bench.mix(most.outputs[0], bench.node("BsdfGlass", Roughness=0.0), bench.node("BsdfTransparent"))
    assert types(bench.export()) == ["DIELECTRIC"] and not bench.warnings


def test_camera_ray_is_true_and_depth_warns(bench):
    path = bench.node("LightPath")
    mix = bench.mix(path.outputs["Is Camera Ray"], bench.node("Emission"), bench.node("BsdfDiffuse"))
    assert types(bench.export()) == ["DIFFUSE"] and not bench.warnings
    bench.link(path.outputs["Ray Depth"], mix.inputs[0])
    MaterialExporter(bench.scene, bench.warnings.append, None).export(bench.material)
    assert "Ray Depth" in bench.warnings[0]


def test_uncovered_shaders_stand_before_coats(bench):
    glossy = bench.node("BsdfGlossy")
    covered = bench.mix(bench.node("Fresnel").outputs[0], bench.node("BsdfDiffuse"), glossy)
    bench.mix(0.5, covered, bench.node("BsdfGlass"))
    assert types(bench.export()) == ["DIELECTRIC", "COAT", "DIFFUSE"]


def test_of_two_coated_shaders_neither_coat_covers_the_other(bench):
    """The second one's emission has no coat over it, nor has what it is added to."""
    add = bench.node("AddShader")
    shiny = bench.mix(bench.node("Fresnel").outputs[0], bench.node("BsdfDiffuse"), bench.node("BsdfGlossy"))
    glowing = bench.node("BsdfPrincipled", Emission=RED, Emission_Strength=1.0)
    for shader, socket in zip((shiny, glowing), add.inputs):
        bench.link(shader.outputs[0], socket)
    bench.surface(add)
    assert types(bench.export()) == ["EMISSION", "COAT", "DIFFUSE", "COAT", "DIFFUSE"]


def test_emission_mixed_by_fresnel_is_under_the_coat(bench):
    bench.mix(bench.node("Fresnel").outputs[0], bench.node("Emission"), bench.node("BsdfGlossy"))
    coat, emission = bench.export()
    assert types((coat, emission)) == ["COAT", "EMISSION"] and emission.weight.value == (1, 1, 1)


# ---------------------------------------------------------------- Principled

def principled(bench, **inputs):
    node = bench.surface(bench.node("BsdfPrincipled", **inputs))
    node.distribution = "MULTI_GGX"
    return node


def test_principled_default(bench):
    node = principled(bench, Base_Color=RED, Roughness=0.3)
    coat, base = bench.export()
    assert types((coat, base)) == ["COAT", "DIFFUSE"] and close(base.color.value, RED[:3])
    assert close(f0_from_ior(coat.ior), 0.04) and close(coat.roughness.value[0], 0.3)
    assert bool(coat.flags & ClosureFlags.ATTENUATE) == principled_is_v2(node) == V2
    assert not coat.flags & ClosureFlags.UNDER_COAT
    assert bool(base.flags & ClosureFlags.RETRO) == (not V2) and coat.flags & ClosureFlags.PRESERVE_ENERGY
    assert not bench.warnings


def test_principled_specular(bench):
    principled(bench, Specular=0.25, IOR=1.5)
    assert close(f0_from_ior(bench.export()[0].ior), 0.02)


def test_principled_without_specular_is_diffuse(bench):
    principled(bench, Specular=0.0)
    assert types(bench.export()) == ["DIFFUSE"]


def test_principled_metal(bench):
    principled(bench, Base_Color=RED, Metallic=1.0, Transmission=1.0)
    metal, = bench.export()
    assert metal.type is ClosureType.CONDUCTOR and close(metal.color.value, RED[:3]) and metal.color2.value == (1, 1, 1)


@pytest.mark.skipif(V2, reason="from 4.0 on a metal's edge is Schlick's")
@pytest.mark.parametrize("specular, ior", [(0.5, 1.5), (0.0, 1.0)])
def test_principled_metal_has_the_edge_of_its_specular_layer(bench, specular, ior):
    principled(bench, Metallic=1.0, Specular=specular)
    metal, = bench.export()
    assert metal.flags & ClosureFlags.EDGE_BY_IOR and close(metal.ior, ior)


def test_principled_glass_tint(bench):
    principled(bench, Base_Color=RED, Transmission=1.0, IOR=1.4)
    glass, = bench.export()
    tint = [math.sqrt(v) for v in RED[:3]] if V2 else RED[:3]
    assert close(glass.color2.value, tuple(tint)) and glass.color.value == (1, 1, 1) and close(glass.ior, 1.4)


def test_principled_weights_sum_to_one(bench):
    principled(bench, Metallic=0.5, Transmission=0.5, Alpha=0.5, Roughness=0.0)
    closures = bench.export()
    weights = {c.type.name: c.weight.value[0] for c in closures}
    assert types(closures) == ["TRANSPARENT", "CONDUCTOR", "DIELECTRIC", "COAT", "DIFFUSE"]
    assert weights == pytest.approx({"TRANSPARENT": 0.5, "CONDUCTOR": 0.25, "DIELECTRIC": 0.125, "COAT": 0.125, "DIFFUSE": 0.125})


def test_principled_textured_alpha_and_metal(bench):
    node = principled(bench)
    bench.link(bench.image().outputs["Alpha"], node.inputs["Alpha"])
    bench.link(bench.image().outputs["Color"], node.inputs["Metallic"])
    transparent, metal, *_ = bench.export()
    assert bench.texture(transparent.weight).blend is Blend.SUBTRACT
    assert bench.texture(metal.weight).blend is Blend.MULTIPLY


def test_principled_clearcoat(bench):
    principled(bench, Clearcoat=0.8, Clearcoat_Roughness=0.1)
    coat, *rest = bench.export()
    assert coat.type is ClosureType.COAT and close(coat.weight.value[0], 0.8 if V2 else 0.2) and close(coat.ior, 1.5)
    assert types(rest) == ["COAT", "DIFFUSE"] and coat.flags == (ClosureFlags.ATTENUATE if V2 else ClosureFlags.CLEARCOAT)
    assert bool(rest[0].flags & ClosureFlags.UNDER_COAT) == V2
    assert not V2 or close(coat.color2.value[0], 0.8)  # of what lies below is under it


def test_principled_emission(bench):
    principled(bench, Emission=RED, Emission_Strength=2.0, Alpha=0.5)
    emission = next(c for c in bench.export() if c.type is ClosureType.EMISSION)
    assert close(emission.color.value, (1.6, 0.4, 0.2)) and close(emission.weight.value[0], 0.5)


def test_principled_emission_shines_through_the_coat(bench):
    principled(bench, Emission=RED, Emission_Strength=1.0, Clearcoat=0.5)
    coat, emission, *_ = bench.export()
    assert types((coat, emission)) == ["COAT", "EMISSION"] and emission.weight.value == (1, 1, 1)
    assert bool(coat.flags & ClosureFlags.ATTENUATE) == V2


@pytest.mark.parametrize("name", ["Sheen", "Subsurface", "Anisotropic", "Diffuse_Roughness", "Thin_Film_Thickness"])
def test_principled_unsupported_warn(bench, name):
    node = bench.node("BsdfPrincipled")
    if principled_input(node, name.replace("_", " ")) is None:
        pytest.skip("not in this Blender")
    principled(bench, **{name: 0.5})
    bench.export()
    assert len(bench.warnings) == 1 and name.split("_")[0] in bench.warnings[0]


def test_principled_textured_ior_warns(bench):
    node = principled(bench)
    bench.link(bench.image().outputs["Color"], principled_input(node, "Specular"))
    assert close(f0_from_ior(bench.export()[0].ior), 0.04) and "cannot be textured" in bench.warnings[0]


def test_principled_textured_glass_warns_where_the_root_is_missed(bench):
    node = principled(bench, Transmission=1.0)
    bench.link(bench.image().outputs["Color"], node.inputs["Base Color"])
    assert bench.export()[0].color2.texture and bool(bench.warnings) == V2


# ---------------------------------------------------------------- values

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
