"""Shader nodes: functions (walk, node) -> closures, and the table that finds them."""

from dataclasses import replace

from .material_params import ONE, gray, in_unit, is_zero
from .nodes_closure import (
    diffuse,
    emission_of,
    f0_from_ior,
    joined,
    microfacet_flags,
    roughness_of,
    scaled,
    warn_if_tinted,
    warn_if_used,
)
from .nodes_principled import principled_bsdf
from .scene_desc import ClosureDesc, ClosureFlags, ClosureType, Param


def diffuse_bsdf(walk, node):
    if not is_zero(walk.scalar(node.inputs["Roughness"])):
        walk.warn(node, "Oren-Nayar roughness is rendered as Lambert")
    return [diffuse(walk.color(node.inputs["Color"]))]


def glass_bsdf(walk, node, flags=ClosureFlags.NONE):
    color, ior = walk.color(node.inputs["Color"]), max(walk.number(node.inputs["IOR"]), 1e-5)
    warn_if_used(walk, node, "Thin Film Thickness")
    flags |= microfacet_flags(node)
    return [ClosureDesc(ClosureType.DIELECTRIC, flags, color=color, color2=color, roughness=roughness_of(walk, node), ior=ior)]


def refraction_bsdf(walk, node):
    return glass_bsdf(walk, node, ClosureFlags.REFRACTION_ONLY)


def glossy_bsdf(walk, node):
    color = walk.color(node.inputs["Color"])
    warn_if_used(walk, node, "Anisotropy")
    roughness = roughness_of(walk, node)
    return [ClosureDesc(ClosureType.CONDUCTOR, microfacet_flags(node), color=color, color2=color, roughness=roughness)]


def metallic_bsdf(walk, node):
    if node.fresnel_type == "F82":
        color = in_unit(walk.color(node.inputs["Base Color"]))
        warn_if_tinted(walk, node, "Edge Tint")
    else:
        n, k = (walk.value(node.inputs[name])[0].value for name in ("IOR", "Extinction"))
        color = Param(tuple(((n - 1) ** 2 + k * k) / ((n + 1) ** 2 + k * k) for n, k in zip(n, k)))
    warn_if_used(walk, node, "Anisotropy", "Thin Film Thickness")
    return [ClosureDesc(ClosureType.CONDUCTOR, microfacet_flags(node), color=color, roughness=roughness_of(walk, node))]


def transparent_bsdf(walk, node):
    return [ClosureDesc(ClosureType.TRANSPARENT, color=walk.color(node.inputs["Color"]))]


def emission_shader(walk, node):
    return emission_of(walk, node.inputs["Color"], node.inputs["Strength"])


def add_shader(walk, node):
    return joined(walk.closures(node.inputs[0]), walk.closures(node.inputs[1]))


def mix_shader(walk, node):
    factor, first, second = node.inputs
    ior = walk.fresnel_ior(factor)
    if ior is not None:
        merged = fresnel_mix(walk, walk.closures(first), walk.closures(second), ior)
        if merged is not None:
            return merged
    f = walk.scalar(factor)
    a = [] if f == ONE else scaled(walk, walk.closures(first), walk.algebra.one_minus(f))
    b = [] if is_zero(f) else scaled(walk, walk.closures(second), f)
    return joined(a, b)


def fresnel_mix(walk, under, over, ior):
    """Mix(X, Glossy, Fresnel): a coat over X, or glass where X is a refraction; None if it is not that."""
    if len(over) != 1 or over[0].type is not ClosureType.CONDUCTOR:
        return None
    gloss = over[0]
    if len(under) == 1 and under[0].flags & ClosureFlags.REFRACTION_ONLY and under[0].roughness == gloss.roughness:
        return [replace(under[0], flags=under[0].flags & ~ClosureFlags.REFRACTION_ONLY, color=gloss.color)]
    coat = replace(gloss, type=ClosureType.COAT, flags=gloss.flags | ClosureFlags.ATTENUATE, color2=ONE, ior=ior)
    dim = gray(1 - f0_from_ior(ior))  # a coat does not dim what goes straight through by itself
    straight = [c for c in under if c.type is ClosureType.TRANSPARENT]
    return [*scaled(walk, straight, dim), coat, *(c for c in under if c not in straight)]


def diffuse_instead(walk, node):
    walk.warn(node, "is rendered as diffuse")
    return [diffuse(walk.color(node.inputs["Color"]))]


def unknown_shader(walk, node):
    if node.inputs.get("Color"):
        return diffuse_instead(walk, node)
    walk.warn(node, "this shader is not supported and renders black")
    return []


SHADERS = {
    "ShaderNodeBsdfPrincipled": principled_bsdf,
    "ShaderNodeBsdfDiffuse": diffuse_bsdf,
    "ShaderNodeBsdfGlass": glass_bsdf,
    "ShaderNodeBsdfRefraction": refraction_bsdf,
    "ShaderNodeBsdfGlossy": glossy_bsdf,
    "ShaderNodeBsdfAnisotropic": glossy_bsdf,
    "ShaderNodeBsdfMetallic": metallic_bsdf,
    "ShaderNodeBsdfTransparent": transparent_bsdf,
    "ShaderNodeEmission": emission_shader,
    "ShaderNodeAddShader": add_shader,
    "ShaderNodeMixShader": mix_shader,
}
