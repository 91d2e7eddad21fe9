"""The Principled BSDF, by the rules of the Blender version that runs."""

import math
from dataclasses import replace

from .compat_nodes import coats_keep_energy, principled_input, principled_is_v2
from .material_params import ONE, gray, in_unit, is_zero
from .nodes_closure import (
    diffuse,
    emission_of,
    f0_from_ior,
    ior_from_f0,
    microfacet_flags,
    scaled,
    warn_if_tinted,
    warn_if_used,
)
from .scene_desc import Blend, ClosureDesc, ClosureFlags, ClosureType, Param


def principled_bsdf(walk, node):
    """Alpha, then clearcoat, emission, metal, glass, specular coat, diffuse base, each weighted by what those before leave."""
    algebra, new = walk.algebra, principled_is_v2(node)
    alpha, metallic, transmission = (walk.scalar(principled_input(node, n)) for n in ("Alpha", "Metallic", "Transmission"))
    base, roughness = walk.color(node.inputs["Base Color"]), walk.scalar(node.inputs["Roughness"])
    warn_if_used(walk, node, "Anisotropic", "Sheen", "Thin Film Thickness")
    not_metal = algebra.one_minus(metallic)
    opaque = algebra.multiply(not_metal, algebra.one_minus(transmission))

    clearcoat = principled_clearcoat(walk, node, new)
    closures = clearcoat + emission_of(walk, principled_input(node, "Emission"), node.inputs["Emission Strength"])
    if not is_zero(metallic):
        warn_if_tinted(walk, node, "Specular Tint")
        closures += scaled(walk, [principled_metal(walk, node, new, base, roughness)], metallic)
    if not (is_zero(transmission) or is_zero(not_metal)):
        glass = principled_glass(walk, node, new, base, roughness)
        closures += scaled(walk, [glass], algebra.multiply(not_metal, transmission))
    if not is_zero(opaque):
        specular = principled_specular(walk, node, new, roughness)
        if clearcoat and new:
            specular = [replace(coat, flags=coat.flags | ClosureFlags.UNDER_COAT) for coat in specular]
        closures += scaled(walk, specular + principled_base(walk, node, new, base, roughness), opaque)
    if alpha == ONE:
        return closures
    return [ClosureDesc(ClosureType.TRANSPARENT, weight=algebra.one_minus(alpha)), *scaled(walk, closures, alpha)]


def principled_clearcoat(walk, node, new):
    weight = walk.scalar(principled_input(node, "Clearcoat"))
    if is_zero(weight):
        return []
    roughness = walk.scalar(principled_input(node, "Clearcoat Roughness"))
    if not new:  # Cycles 3.4 multiplies by 1/4 and takes nothing from what is below
        quarter = walk.algebra.multiply(weight, gray(0.25))
        return [ClosureDesc(ClosureType.COAT, ClosureFlags.CLEARCOAT, weight=quarter, roughness=roughness)]
    warn_if_tinted(walk, node, "Coat Tint")
    ior = max(walk.number(node.inputs["Coat IOR"]), 1.0)
    flags = ClosureFlags.ATTENUATE | (ClosureFlags.PRESERVE_ENERGY if coats_keep_energy() else ClosureFlags.NONE)
    return [ClosureDesc(ClosureType.COAT, flags, weight=weight, color2=weight, roughness=roughness, ior=ior)]


def principled_metal(walk, node, new, base, roughness):
    """Before 4.0 the edge is that of the specular layer's index."""
    metal = ClosureDesc(ClosureType.CONDUCTOR, microfacet_flags(node), color=in_unit(base), roughness=roughness)
    if new:
        return metal
    return replace(metal, flags=metal.flags | ClosureFlags.EDGE_BY_IOR, ior=specular_ior(walk, node))


def specular_ior(walk, node):
    """Of Principled before 4.0, from its Specular."""
    return ior_from_f0(0.08 * max(walk.number(principled_input(node, "Specular")), 0.0))


def principled_glass(walk, node, new, base, roughness):
    """Cycles tints what passes one surface by the base colour (3.4) or, so that a slab has it, by its square root (4.x)."""
    tint = square_root(walk, node, in_unit(base)) if new else base
    if not new and node.distribution == "GGX":
        warn_if_used(walk, node, "Transmission Roughness", text="is rendered as the roughness of the reflection")
    ior = max(walk.number(node.inputs["IOR"]), 1e-5)
    return ClosureDesc(ClosureType.DIELECTRIC, microfacet_flags(node), color2=tint, roughness=roughness, ior=ior)


def square_root(walk, node, p: Param) -> Param:
    if p.texture:
        walk.warn(node, "a textured base colour tints glass by itself instead of its square root")
        return p
    return Param(tuple(math.sqrt(v) for v in p.value))


def principled_specular(walk, node, new, roughness):
    level = max(walk.number(principled_input(node, "Specular")), 0.0)
    if new:
        warn_if_tinted(walk, node, "Specular Tint")
        material_ior = max(walk.number(node.inputs["IOR"]), 1e-5)
        ior = ior_from_f0(f0_from_ior(material_ior) * 2 * level)
        ior, flags = 1 / ior if material_ior < 1 else ior, ClosureFlags.ATTENUATE
    else:
        warn_if_used(walk, node, "Specular Tint")
        ior, flags = specular_ior(walk, node), ClosureFlags.NONE
    flags |= microfacet_flags(node)
    return [] if abs(ior - 1) < 1e-5 else [ClosureDesc(ClosureType.COAT, flags, roughness=roughness, ior=ior)]


def principled_base(walk, node, new, base, roughness):
    warn_if_used(walk, node, "Subsurface", text="is rendered as diffuse")
    if new:
        warn_if_used(walk, node, "Diffuse Roughness", text="is rendered as Lambert")
        return [diffuse(base)]
    subsurface, color = walk.scalar(node.inputs["Subsurface"]), walk.color(node.inputs["Subsurface Color"])
    base = walk.algebra.blend(Blend.MIX, base, color, subsurface)
    return [ClosureDesc(ClosureType.DIFFUSE, ClosureFlags.RETRO, color=base, roughness=roughness)]
