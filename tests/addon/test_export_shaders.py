"""Shader nodes become closures, and mixing weighs them; what cannot be said becomes a warning."""

import bpy
import pytest
from material_bench import GGX, OLD, RED, V2, close, types
from sppm.export_material import MaterialExporter
from sppm.scene_desc import Blend, ClosureFlags, ClosureType, TextureType


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
    assert closure.type is ClosureType.DIELECTRIC and closure.flags == ClosureFlags.PRESERVE_ENERGY | OLD
    assert closure.color == closure.color2 and close(closure.ior, 1.33) and close(closure.roughness.value[0], 0.3)
    assert not bench.warnings


def test_beckmann_warns_only_when_rough(bench):
    node = bench.surface(bench.node("BsdfGlossy", Roughness=0.0))
    node.distribution = "BECKMANN"
    bench.export()
    assert not bench.warnings
    node.inputs["Roughness"].default_value = 0.2
    MaterialExporter(bench.scene, bench.warnings.append, None).export(bench.material)
    assert "Beckmann is rendered as GGX" in bench.warnings[0]


@pytest.mark.parametrize("name", ["BsdfGlass", "BsdfRefraction"])
def test_beckmann_that_nobody_chose_does_not_warn(bench, name):
    """New nodes of Blender 3.4 have it."""
    node = bench.surface(bench.node(name, Roughness=0.2))
    assert V2 or node.distribution == "BECKMANN"
    node.distribution = "BECKMANN"
    assert len(bench.export()) == 1 and not bench.warnings


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
