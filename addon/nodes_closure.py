"""What shader nodes share: closures and lists of them, and warnings of inputs that are not rendered."""

import math
from dataclasses import replace

from .compat_nodes import default_is_principled, microfacets_are_of_3_x, principled_input
from .material_params import ZERO, at_least_zero, gray, is_zero
from .scene_desc import ClosureDesc, ClosureFlags, ClosureType, Param

_BECKMANN_BY_DEFAULT = ("ShaderNodeBsdfGlass", "ShaderNodeBsdfRefraction")


def diffuse(color: Param) -> ClosureDesc:
    return ClosureDesc(ClosureType.DIFFUSE, color=color)


def default_surface() -> tuple:
    """The closures of what has no material."""
    base = diffuse(gray(0.8))
    if not default_is_principled():
        return (base,)
    flags = ClosureFlags.ATTENUATE | ClosureFlags.PRESERVE_ENERGY
    return (ClosureDesc(ClosureType.COAT, flags, roughness=gray(0.5), ior=1.5), base)


def microfacet_flags(node) -> ClosureFlags:
    old = microfacets_are_of_3_x()
    flags = ClosureFlags.SMOOTH_ALBEDO if old else ClosureFlags.NONE
    if node.distribution == "MULTI_GGX":
        return flags | ClosureFlags.PRESERVE_ENERGY
    return flags | ClosureFlags.SEPARABLE if old else flags


def roughness_of(walk, node) -> Param:
    """The Roughness input; the distributions SHARP and, when rough, those that are not GGX are dealt with.

    Beckmann on glass is what nodes of 3.4 have unless somebody chooses another, so nothing is said of it.
    """
    roughness = walk.scalar(node.inputs["Roughness"])
    if node.distribution == "SHARP":
        return ZERO
    by_default = node.distribution == "BECKMANN" and node.bl_idname in _BECKMANN_BY_DEFAULT
    if "GGX" not in node.distribution and not by_default and not is_zero(roughness):
        walk.warn(node, f"distribution {node.distribution.replace('_', ' ').title()} is rendered as GGX")
    return roughness


def scaled(walk, closures, factor: Param):
    return [replace(c, weight=walk.algebra.multiply(c.weight, factor)) for c in closures]


def joined(first, second):
    """Both lists, what has no coat over it in front: a coat covers what follows, up to the next one."""
    coats = [next((i for i, c in enumerate(part) if c.flags & ClosureFlags.ATTENUATE), len(part)) for part in (first, second)]
    return first[:coats[0]] + second[:coats[1]] + first[coats[0]:] + second[coats[1]:]


def emission_of(walk, color_socket, strength_socket):
    strength = at_least_zero(walk.signed(strength_socket))
    color = ZERO if is_zero(strength) else walk.algebra.multiply(walk.color(color_socket), strength)
    return [] if is_zero(color) else [ClosureDesc(ClosureType.EMISSION, color=color)]


def warn_if_used(walk, node, *names, text="is not rendered"):
    for name in names:
        socket = principled_input(node, name)
        if socket and not is_zero(walk.signed(socket)):
            walk.warn(node, f"'{socket.name}' {text}")


def warn_if_tinted(walk, node, name):
    socket = node.inputs.get(name)
    if socket and socket.type == "RGBA" and any(abs(v - 1) > 1e-4 for v in walk.color(socket).value):
        walk.warn(node, f"'{name}' is rendered as white")


def ior_from_f0(f0: float) -> float:
    root = math.sqrt(min(max(f0, 0.0), 0.99))
    return (1 + root) / (1 - root)


def f0_from_ior(ior: float) -> float:
    return ((ior - 1) / (ior + 1)) ** 2
