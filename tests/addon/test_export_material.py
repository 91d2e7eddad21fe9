"""Materials as a whole, their links, and the Principled BSDF; what cannot be said becomes a warning."""

import math

import bpy
import pytest
from material_bench import RED, V2, close, types
from sppm.compat_nodes import principled_input, principled_is_v2
from sppm.nodes_closure import f0_from_ior
from sppm.nodes_walk import Needs
from sppm.scene_desc import Blend, ClosureFlags, ClosureType


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
    kept = ClosureFlags.PRESERVE_ENERGY if bpy.app.version >= (4, 5, 0) else ClosureFlags.NONE
    assert types(rest) == ["COAT", "DIFFUSE"] and coat.flags == (ClosureFlags.ATTENUATE | kept if V2 else ClosureFlags.CLEARCOAT)
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
