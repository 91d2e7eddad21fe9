"""Shader nodes -> MaterialDesc and TextureDesc: one small function a node, found by a table.

The node tree is read as Cycles would: from the active output for Cycles, through reroutes, muted nodes and node groups. A value
is a `Param` (constant times texture); what cannot be said so is replaced by the nearest thing and reported as a warning.

Limits that come from the closures:
 - A texture used as a number (roughness, factor) counts by its first channel, not by its luminance.
 - A COAT covers all that follows in the list, so where two covered shaders are mixed, what stands before the second one's coat is
   also dimmed by the first coat; uncovered shaders are put in front and stay exact.
 - The last coat covers alone: the base below a clearcoat is dimmed by the specular coat only.
"""

import colorsys
import math
from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import dataclass, replace

import bpy
from mathutils import Euler, Matrix

from .compat_nodes import default_is_principled, microfacets_are_separable, principled_input, principled_is_v2
from .scene_desc import (
    Blend,
    ClosureDesc,
    ClosureFlags,
    ClosureType,
    Extension,
    Interpolation,
    MaterialDesc,
    Param,
    SceneDesc,
    TextureDesc,
    TextureType,
)

MAX_CLOSURES = 16
MISSING_IMAGE = (1.0, 0.0, 1.0)  # as in Cycles
ZERO, ONE = Param((0.0, 0.0, 0.0)), Param()


# ---------------------------------------------------------------- values

def gray(x: float) -> Param:
    return Param((float(x),) * 3)


def rgb(values) -> Param:
    return Param(tuple(float(v) for v in values[:3]))


def luminance(c) -> float:
    return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]


def is_zero(p: Param) -> bool:
    return not any(p.value)


def at_least_zero(p: Param) -> Param:
    return Param(tuple(max(v, 0.0) for v in p.value), p.texture)


def in_unit(p: Param) -> Param:
    return Param(tuple(min(max(v, 0.0), 1.0) for v in p.value), p.texture)


BLENDS = {
    Blend.MIX: lambda a, b: b,
    Blend.MULTIPLY: lambda a, b: a * b,
    Blend.ADD: lambda a, b: a + b,
    Blend.SUBTRACT: lambda a, b: a - b,
    Blend.SCREEN: lambda a, b: 1 - (1 - a) * (1 - b),
    Blend.DIFFERENCE: lambda a, b: abs(a - b),
    Blend.DARKEN: min,
    Blend.LIGHTEN: max,
}


class TextureAlgebra:
    """Arithmetic of Params: folds constants, and adds textures to the scene (each only once) for the rest."""

    def __init__(self, scene: SceneDesc):
        self.scene = scene
        self.ids = {}

    def add(self, desc: TextureDesc) -> int:
        if desc not in self.ids:
            self.scene.textures.append(desc)
            self.ids[desc] = len(self.scene.textures)
        return self.ids[desc]

    def id_of(self, p: Param) -> int:
        """A texture that is the whole of `p`."""
        if p.texture and p.value == (1.0, 1.0, 1.0):
            return p.texture
        constant = self.add(TextureDesc(TextureType.CONSTANT, value=p.value))
        return self.multiply_textures(constant, p.texture) if p.texture else constant

    def multiply_textures(self, a: int, b: int) -> int:
        return self.add(TextureDesc(TextureType.MIX, blend=Blend.MULTIPLY, a=a, b=b, factor=self.id_of(ONE)))

    def multiply(self, a: Param, b: Param) -> Param:
        texture = self.multiply_textures(a.texture, b.texture) if a.texture and b.texture else a.texture or b.texture
        return Param(tuple(x * y for x, y in zip(a.value, b.value)), texture)

    def blend(self, blend: Blend, a: Param, b: Param, factor: Param = ONE) -> Param:
        """a (1 - factor) + blend(a, b) factor."""
        if is_zero(factor):
            return a
        if not (a.texture or b.texture or factor.texture):
            f = min(max(factor.value[0], 0.0), 1.0)
            return Param(tuple(x + (BLENDS[blend](x, y) - x) * f for x, y in zip(a.value, b.value)))
        if factor == ONE and blend is Blend.MIX:
            return b
        if factor == ONE and blend is Blend.MULTIPLY:
            return self.multiply(a, b)
        ids = {"a": self.id_of(a), "b": self.id_of(b), "factor": self.id_of(factor)}
        return Param(texture=self.add(TextureDesc(TextureType.MIX, blend=blend, **ids)))

    def one_minus(self, p: Param) -> Param:
        return self.blend(Blend.SUBTRACT, ONE, p)

    def clamp(self, p: Param, low: Param = ZERO, high: Param = ONE) -> Param:
        return self.blend(Blend.DARKEN, self.blend(Blend.LIGHTEN, p, low), high)


# ---------------------------------------------------------------- the exporter

@dataclass
class Needs:
    """What a material reads from a mesh: names of its UV map and colours, '' the active one, None not at all."""

    uv_map: str | None = None
    colors: str | None = None


class MaterialExporter:
    """Adds materials and their textures to `scene`, each material once.

    Args:
        scene: gets `materials` and `textures`.
        warn: called with a sentence for everything that is not rendered as Cycles would.
        export_image: adds a Blender image to the scene, returns its id.
    """

    def __init__(self, scene: SceneDesc, warn: Callable[[str], None], export_image: Callable[[bpy.types.Image], int]):
        self.scene = scene
        self.warn = warn
        self.export_image = export_image
        self.algebra = TextureAlgebra(scene)
        self.ids = {}
        self.needs = {}

    def export(self, material: bpy.types.Material | None) -> int:
        """The id of `material` in the scene; None is Cycles' default surface."""
        key = material.name_full if material else None
        if key not in self.ids:
            desc, needs = self.describe(material)
            self.scene.materials.append(replace(desc, index=material.pass_index if material else 0))
            self.ids[key] = len(self.scene.materials)
            self.needs[self.ids[key]] = needs
        return self.ids[key]

    def describe(self, material):
        if material is None:
            return MaterialDesc("default", default_surface()), Needs()
        if (bpy.app.version < (5, 0, 0) and not material.use_nodes) or material.node_tree is None:
            return MaterialDesc(material.name, (diffuse(rgb(material.diffuse_color)),)), Needs()
        walk = Walk(self, material)
        return MaterialDesc(material.name, tuple(walk.surface())), walk.needs

    def needs_uvs(self, material_id: int) -> bool:
        return self.needs[material_id].uv_map is not None

    def uv_map(self, material_id: int) -> str:
        """Name of the UV map that is used, '' for the one active for rendering."""
        return self.needs[material_id].uv_map or ""

    def needs_colors(self, material_id: int) -> str | None:
        """Name of the colour attribute that is used, '' for the active one, None for none."""
        return self.needs[material_id].colors


class Walk:
    """One material's node tree: follows links and keeps the stack of node groups it is in."""

    def __init__(self, exporter: MaterialExporter, material: bpy.types.Material):
        self.exporter = exporter
        self.algebra = exporter.algebra
        self.material = material
        self.needs = Needs()
        self.stack = ()
        self.active = set()
        self.values = {}
        self.warned = set()

    def warn(self, node, text: str):
        where = f"Material '{self.material.name}'" + (f", node '{node.name}'" if node else "")
        if (where, text) not in self.warned:
            self.warned.add((where, text))
            self.exporter.warn(f"{where}: {text}")

    def surface(self) -> list:
        """Closures of the active output for Cycles."""
        output = self.material.node_tree.get_output_node("CYCLES")
        if output is None:
            return []
        for name in ("Volume", "Displacement"):
            if self.resolve(output.inputs[name])[0]:
                self.warn(output, f"{name.lower()} is not rendered")
        closures = self.closures(output.inputs["Surface"])
        if len(closures) > MAX_CLOSURES:
            self.warn(output, f"more than {MAX_CLOSURES} closures, the rest is left out")
        return closures[:MAX_CLOSURES]

    # -------------------------------------------------------- following links

    def resolve(self, socket):
        """What feeds the input `socket`: (output or None, input whose default counts, stack there)."""
        stack, end = self.stack, socket
        while socket.is_linked and not socket.links[0].is_muted:
            out = socket.links[0].from_socket
            node = out.node
            if node.mute:
                socket = next((i.from_socket for i in node.internal_links if i.to_socket == out), None)
                if socket is None:
                    return None, end, stack
            elif node.bl_idname == "NodeReroute":
                socket = node.inputs[0]
                continue  # an open reroute leaves the default of what it feeds
            elif node.bl_idname == "ShaderNodeGroup":
                inner = group_output(node, out.identifier)
                if inner is None:
                    return None, end, stack
                stack, socket = (*stack, node), inner
            elif node.bl_idname == "NodeGroupInput":
                outer = by_identifier(stack[-1].inputs, out.identifier) if stack else None
                if outer is None:
                    return None, end, stack
                stack, socket = stack[:-1], outer
            else:
                return out, end, stack
            end = socket
        return None, end, stack

    @contextmanager
    def at(self, node, stack):
        """Within `node`; gives False where that is a cycle."""
        key = (node.as_pointer(), tuple(g.as_pointer() for g in stack))
        if key in self.active:
            self.warn(node, "is part of a cycle")
            yield False
            return
        before, self.stack = self.stack, stack
        self.active.add(key)
        try:
            yield True
        finally:
            self.active.discard(key)
            self.stack = before

    def closures(self, socket) -> list:
        """The closures of what feeds a shader socket, without those of no weight."""
        out, _, stack = self.resolve(socket)
        if out is None:
            return []
        with self.at(out.node, stack) as fresh:
            if not fresh:
                return []
            function = SHADERS.get(out.node.bl_idname, unknown_shader)
            warn_of_normals(self, out.node)
            return [c for c in function(self, out.node) if not is_zero(c.weight)]

    # -------------------------------------------------------- reading values

    def value(self, socket):
        """(Param, socket type it came from) of what feeds `socket`."""
        out, end, stack = self.resolve(socket)
        if out is None:
            return default_of(end), end.type
        key = (out.node.as_pointer(), out.identifier, tuple(g.as_pointer() for g in stack))
        if key not in self.values:
            with self.at(out.node, stack) as fresh:
                self.values[key] = VALUES.get(out.node.bl_idname, unknown_value)(self, out.node, out) if fresh else None
        found = self.values[key]
        return (found, out.type) if found is not None else (default_of(socket), socket.type)

    def color(self, socket) -> Param:
        return at_least_zero(self.value(socket)[0])

    def signed(self, socket) -> Param:
        """A number, as grey."""
        p, kind = self.value(socket)
        if kind == "RGBA":
            return Param((luminance(p.value),) * 3, p.texture)
        if kind == "VECTOR":
            return Param((sum(p.value) / 3,) * 3, p.texture)
        return p

    def scalar(self, socket) -> Param:
        """A number from 0 to 1: factor, weight or roughness; absent sockets are 0."""
        return in_unit(self.signed(socket)) if socket else ZERO

    def number(self, socket) -> float:
        """A number that cannot vary over the surface."""
        p = self.signed(socket)
        if p.texture:
            self.warn(socket.node, f"'{socket.name}' cannot be textured, its own value is used")
            return default_of(socket).value[0]
        return p.value[0]

    def fresnel_ior(self, socket) -> float | None:
        """The index behind a Fresnel factor, None if the factor is something else."""
        out, _, stack = self.resolve(socket)
        if out is None or out.node.bl_idname not in ("ShaderNodeFresnel", "ShaderNodeLayerWeight") or out.name == "Facing":
            return None
        with self.at(out.node, stack) as fresh:
            return fresnel_node_ior(self, out.node) if fresh else None

    def use_uv_map(self, node, name: str):
        if self.needs.uv_map not in (None, name):
            self.warn(node, f"one UV map a material: '{self.needs.uv_map}' is used instead of '{name}'")
        elif self.needs.uv_map is None:
            self.needs.uv_map = name

    def use_colors(self, node, name: str) -> Param:
        if self.needs.colors not in (None, name):
            self.warn(node, f"one colour attribute a material: '{self.needs.colors}' is used instead of '{name}'")
        elif self.needs.colors is None:
            self.needs.colors = name
        return Param(texture=self.algebra.add(TextureDesc(TextureType.ATTRIBUTE)))

    def mapping(self, socket, unlinked: Matrix) -> Matrix:
        """The affine map from (u, v, 0) to the vector that feeds `socket`."""
        out, _, stack = self.resolve(socket)
        if out is None:
            return unlinked
        with self.at(out.node, stack) as fresh:
            function = VECTORS.get(out.node.bl_idname, unknown_vector) if fresh else unknown_vector
            return function(self, out.node, out)


def by_identifier(sockets, identifier):
    return next((s for s in sockets if s.identifier == identifier), None)


def group_output(node, identifier):
    nodes = node.node_tree.nodes if node.node_tree else ()
    output = next((n for n in nodes if n.bl_idname == "NodeGroupOutput" and n.is_active_output), None)
    return by_identifier(output.inputs, identifier) if output else None


def default_of(socket) -> Param:
    value = getattr(socket, "default_value", 0.0)
    return rgb(value) if socket.type in ("RGBA", "VECTOR") else gray(value) if isinstance(value, (int, float)) else ZERO


def warn_of_normals(walk, node):
    for socket in node.inputs:
        if socket.name in ("Normal", "Clearcoat Normal", "Coat Normal", "Tangent") and walk.resolve(socket)[0]:
            walk.warn(node, f"'{socket.name}' (bump and normal maps) is not rendered")


# ---------------------------------------------------------------- shader nodes: (walk, node) -> closures

def diffuse(color: Param) -> ClosureDesc:
    return ClosureDesc(ClosureType.DIFFUSE, color=color)


def default_surface() -> tuple:
    base = diffuse(gray(0.8))
    if not default_is_principled():
        return (base,)
    flags = ClosureFlags.ATTENUATE | ClosureFlags.PRESERVE_ENERGY
    return (ClosureDesc(ClosureType.COAT, flags, roughness=gray(0.5), ior=1.5), base)


def microfacet_flags(node) -> ClosureFlags:
    if node.distribution == "MULTI_GGX":
        return ClosureFlags.PRESERVE_ENERGY
    return ClosureFlags.SEPARABLE if microfacets_are_separable() else ClosureFlags.NONE


def roughness_of(walk, node) -> Param:
    """The Roughness input; the distributions SHARP and, when rough, those that are not GGX are dealt with."""
    roughness = walk.scalar(node.inputs["Roughness"])
    if node.distribution == "SHARP":
        return ZERO
    if "GGX" not in node.distribution and not is_zero(roughness):
        walk.warn(node, f"distribution {node.distribution.replace('_', ' ').title()} is rendered as GGX")
    return roughness


def scaled(walk, closures, factor: Param):
    return [replace(c, weight=walk.algebra.multiply(c.weight, factor)) for c in closures]


def covers(closures) -> bool:
    return any(c.flags & ClosureFlags.ATTENUATE for c in closures)


def joined(first, second):
    """Both lists, the one without a covering coat in front."""
    return second + first if covers(first) and not covers(second) else first + second


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
    return [ClosureDesc(ClosureType.CONDUCTOR, microfacet_flags(node), color=color, color2=color, roughness=roughness_of(walk, node))]


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


def emission_of(walk, color_socket, strength_socket):
    strength = at_least_zero(walk.signed(strength_socket))
    color = ZERO if is_zero(strength) else walk.algebra.multiply(walk.color(color_socket), strength)
    return [] if is_zero(color) else [ClosureDesc(ClosureType.EMISSION, color=color)]


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
    dim = gray(1 - f0_from_ior(ior))  # a coat does not dim these two by itself
    straight = [c for c in under if c.type in (ClosureType.TRANSPARENT, ClosureType.EMISSION)]
    return [*scaled(walk, straight, dim), coat, *(c for c in under if c not in straight)]


def principled_bsdf(walk, node):
    """Alpha, then clearcoat, emission, metal, glass, specular coat, diffuse base, each weighted by what those before leave."""
    algebra, new = walk.algebra, principled_is_v2(node)
    alpha, metallic, transmission = (walk.scalar(principled_input(node, n)) for n in ("Alpha", "Metallic", "Transmission"))
    base, roughness = walk.color(node.inputs["Base Color"]), walk.scalar(node.inputs["Roughness"])
    warn_if_used(walk, node, "Anisotropic", "Sheen", "Thin Film Thickness")
    not_metal = algebra.one_minus(metallic)
    opaque = algebra.multiply(not_metal, algebra.one_minus(transmission))

    closures = principled_clearcoat(walk, node, new) + principled_emission(walk, node, new)
    if not is_zero(metallic):
        warn_if_tinted(walk, node, "Specular Tint")
        closures += scaled(walk, [principled_metal(walk, node, new, base, roughness)], metallic)
    if not (is_zero(transmission) or is_zero(not_metal)):
        glass = principled_glass(walk, node, new, base, roughness)
        closures += scaled(walk, [glass], algebra.multiply(not_metal, transmission))
    if not is_zero(opaque):
        layers = principled_specular(walk, node, new, roughness) + principled_base(walk, node, new, base, roughness)
        closures += scaled(walk, layers, opaque)
    if alpha == ONE:
        return closures
    return [ClosureDesc(ClosureType.TRANSPARENT, weight=algebra.one_minus(alpha)), *scaled(walk, closures, alpha)]


def principled_clearcoat(walk, node, new):
    weight = walk.scalar(principled_input(node, "Clearcoat"))
    if is_zero(weight):
        return []
    roughness = walk.scalar(principled_input(node, "Clearcoat Roughness"))
    if not new:  # Cycles 3.4 multiplies by 1/4 and takes nothing from what is below
        return [ClosureDesc(ClosureType.COAT, weight=walk.algebra.multiply(weight, gray(0.25)), roughness=roughness)]
    warn_if_tinted(walk, node, "Coat Tint")
    flags = ClosureFlags.ATTENUATE if weight.value[0] >= 0.5 else ClosureFlags.NONE  # the library dims fully or not at all
    ior = max(walk.number(node.inputs["Coat IOR"]), 1.0)
    return [ClosureDesc(ClosureType.COAT, flags, weight=weight, roughness=roughness, ior=ior)]


def principled_emission(walk, node, new):
    """From 4.0 on it shines through the coat, which the library does not dim: here it is by what the coat reflects straight above."""
    emission = emission_of(walk, principled_input(node, "Emission"), node.inputs["Emission Strength"])
    coat = walk.scalar(principled_input(node, "Clearcoat")) if new else ZERO
    if is_zero(coat):
        return emission
    reflected = gray(f0_from_ior(max(walk.number(node.inputs["Coat IOR"]), 1.0)))
    return scaled(walk, emission, walk.algebra.one_minus(walk.algebra.multiply(coat, reflected)))


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


# ------------------------------------------------------ value nodes: (walk, node, output) -> Param, None: the consumer's default

def output_value(walk, node, out):
    """Nodes whose output holds the value: RGB and Value."""
    return default_of(out)


def image_texture(walk, node, out):
    if node.image is None:
        walk.warn(node, "has no image and renders magenta")
        return Param(MISSING_IMAGE) if out.name == "Color" else ONE
    if node.projection != "FLAT":
        walk.warn(node, f"projection {node.projection.title()} is rendered as Flat")
    matrix = walk.mapping(node.inputs["Vector"], Matrix.Identity(4))
    if walk.needs.uv_map is None:
        walk.use_uv_map(node, "")
    image = walk.exporter.export_image(node.image)
    if not image:
        return Param(MISSING_IMAGE) if out.name == "Color" else ONE
    kind = TextureType.IMAGE_ALPHA if out.name == "Alpha" else TextureType.IMAGE
    interpolation = Interpolation.CLOSEST if node.interpolation == "Closest" else Interpolation.LINEAR
    return Param(texture=walk.algebra.add(TextureDesc(
        kind, image=image, interpolation=interpolation, extension=Extension[node.extension], mapping=rows_of(matrix))))


def rows_of(matrix: Matrix) -> tuple | None:
    """The upper 3x4, None for the identity."""
    rows = tuple(float(v) for row in matrix[:3] for v in row)
    if matrix == Matrix.Identity(4):
        return None
    return rows if any(rows) else (*rows[:3], 1e-9, *rows[4:])  # all zero would be read as the identity


def vertex_color(walk, node, out):
    if out.name == "Alpha":
        walk.warn(node, "the alpha of colours is rendered as 1")
        return ONE
    return walk.use_colors(node, node.layer_name)


def attribute(walk, node, out):
    if node.attribute_type != "GEOMETRY" or out.name == "Alpha":
        walk.warn(node, "only colours of the geometry are supported")
        return ONE if out.name == "Alpha" else None
    return walk.use_colors(node, node.attribute_name)


def light_path(walk, node, out):
    """Photons and camera rays see one material: that seen by the camera."""
    if not out.name.startswith("Is "):
        walk.warn(node, f"'{out.name}' is rendered as 0")
    return ONE if out.name == "Is Camera Ray" else ZERO


def fresnel_node_ior(walk, node) -> float:
    if node.bl_idname == "ShaderNodeFresnel":
        return max(walk.number(node.inputs["IOR"]), 1e-5)
    return 1 / max(1 - walk.number(node.inputs["Blend"]), 1e-5)


def fresnel_value(walk, node, out):
    walk.warn(node, "a factor that varies with the angle is rendered as a constant")
    if out.name == "Facing":
        return gray(1 / 3)  # the cosine-weighted mean of 1 - cos
    return gray(f0_from_ior(fresnel_node_ior(walk, node)))


def blend_of(walk, node) -> Blend | None:
    blend = Blend.__members__.get(node.blend_type)
    if blend is None:
        walk.warn(node, f"blend type {node.blend_type.replace('_', ' ').title()} is not supported, the first colour is used")
    return blend


def mix_rgb(walk, node, out):
    factor, a, b = walk.scalar(node.inputs[0]), walk.value(node.inputs[1])[0], walk.value(node.inputs[2])[0]
    blend = blend_of(walk, node)
    mixed = a if blend is None else walk.algebra.blend(blend, a, b, factor)
    return walk.algebra.clamp(mixed) if node.use_clamp else mixed


def mix(walk, node, out):
    kind = {"RGBA": "Color", "FLOAT": "Float", "VECTOR": "Vector"}.get(node.data_type)
    if kind is None:
        return unknown_value(walk, node, out)
    uniform = kind != "Vector" or node.factor_mode == "UNIFORM"
    if not uniform:
        walk.warn(node, "a factor for each component is rendered as one factor")
    factor = walk.scalar(by_identifier(node.inputs, "Factor_Float" if uniform else "Factor_Vector"))
    read = walk.signed if kind == "Float" else lambda s: walk.value(s)[0]
    a, b = (read(by_identifier(node.inputs, f"{x}_{kind}")) for x in "AB")
    blend = blend_of(walk, node) if kind == "Color" else Blend.MIX
    mixed = a if blend is None else walk.algebra.blend(blend, a, b, factor)
    return walk.algebra.clamp(mixed) if kind == "Color" and node.clamp_result else mixed


def invert(walk, node, out):
    color = walk.value(node.inputs["Color"])[0]
    return walk.algebra.blend(Blend.MIX, color, walk.algebra.one_minus(color), walk.scalar(node.inputs[0]))


def gamma(walk, node, out):
    color, power = walk.color(node.inputs["Color"]), walk.number(node.inputs["Gamma"])
    if not color.texture:
        return Param(tuple(v ** power if v > 0 else v for v in color.value))
    if power != 1:
        walk.warn(node, "gamma of a texture is not rendered")
    return color


def bright_contrast(walk, node, out):
    color, bright, contrast = walk.color(node.inputs[0]), walk.number(node.inputs[1]), walk.number(node.inputs[2])
    shift, algebra = bright - contrast / 2, walk.algebra
    product = algebra.multiply(color, gray(max(1 + contrast, 0.0)))
    return algebra.blend(Blend.LIGHTEN, algebra.blend(Blend.ADD, product, gray(shift)), ZERO) if shift else product


def hue_saturation(walk, node, out):
    color, factor = walk.color(node.inputs["Color"]), walk.scalar(node.inputs[3])
    hue, saturation, value = (walk.number(node.inputs[n]) for n in ("Hue", "Saturation", "Value"))
    if color.texture:
        if hue != 0.5 or saturation != 1:
            walk.warn(node, "hue and saturation of a texture are not rendered")
        changed = walk.algebra.multiply(color, gray(value))
    else:
        h, s, v = colorsys.rgb_to_hsv(*color.value)
        changed = at_least_zero(rgb(colorsys.hsv_to_rgb((h + hue + 0.5) % 1, min(max(s * saturation, 0), 1), v * value)))
    return walk.algebra.blend(Blend.MIX, color, changed, factor)


def power(a, b):
    try:
        return float(a ** b) if a >= 0 or b == int(b) else 0.0
    except (ArithmeticError, ValueError):
        return 0.0


MATH = {
    "ADD": lambda a, b, c: a + b,
    "SUBTRACT": lambda a, b, c: a - b,
    "MULTIPLY": lambda a, b, c: a * b,
    "DIVIDE": lambda a, b, c: a / b if b else 0.0,
    "MULTIPLY_ADD": lambda a, b, c: a * b + c,
    "POWER": lambda a, b, c: power(a, b),
    "SQRT": lambda a, b, c: math.sqrt(max(a, 0.0)),
    "ABSOLUTE": lambda a, b, c: abs(a),
    "EXPONENT": lambda a, b, c: math.exp(min(a, 80.0)),
    "MINIMUM": lambda a, b, c: min(a, b),
    "MAXIMUM": lambda a, b, c: max(a, b),
    "LESS_THAN": lambda a, b, c: float(a < b),
    "GREATER_THAN": lambda a, b, c: float(a > b),
    "SIGN": lambda a, b, c: float((a > 0) - (a < 0)),
    "ROUND": lambda a, b, c: math.floor(a + 0.5),
    "FLOOR": lambda a, b, c: math.floor(a),
    "CEIL": lambda a, b, c: math.ceil(a),
    "FRACT": lambda a, b, c: a - math.floor(a),
    "SINE": lambda a, b, c: math.sin(a),
    "COSINE": lambda a, b, c: math.cos(a),
}
MATH_BLENDS = {"ADD": Blend.ADD, "SUBTRACT": Blend.SUBTRACT, "MULTIPLY": Blend.MULTIPLY, "MINIMUM": Blend.DARKEN,
               "MAXIMUM": Blend.LIGHTEN}


def math_node(walk, node, out):
    a, b, c = (walk.signed(s) for s in node.inputs)
    used = [p for p, s in zip((a, b, c), node.inputs) if s.enabled]
    algebra = walk.algebra
    if not any(p.texture for p in used) and node.operation in MATH:
        result = gray(MATH[node.operation](a.value[0], b.value[0], c.value[0]))
    elif node.operation == "DIVIDE" and not b.texture and b.value[0]:
        result = algebra.multiply(a, gray(1 / b.value[0]))
    elif node.operation == "MULTIPLY_ADD":
        result = algebra.blend(Blend.ADD, algebra.multiply(a, b), c)
    elif node.operation in MATH_BLENDS:
        result = algebra.blend(MATH_BLENDS[node.operation], a, b)
    else:
        walk.warn(node, f"{node.operation.replace('_', ' ').title()} is not supported here, its input is passed through")
        result = next((p for p in used if p.texture), a)
    return algebra.clamp(result) if node.use_clamp else result


def clamp_node(walk, node, out):
    value, low, high = (walk.signed(s) for s in node.inputs)
    return walk.algebra.clamp(value, low, high)


def map_range(walk, node, out):
    if node.data_type != "FLOAT" or node.interpolation_type != "LINEAR":
        return unknown_value(walk, node, out)
    value = walk.signed(node.inputs[0])
    from_min, from_max, to_min, to_max = (walk.number(s) for s in node.inputs[1:5])
    scale = (to_max - to_min) / (from_max - from_min) if from_max != from_min else 0.0
    shift, algebra = to_min - from_min * scale, walk.algebra
    if from_max == from_min:
        return ZERO
    mapped = algebra.blend(Blend.ADD, algebra.multiply(value, gray(scale)), gray(shift)) if shift else algebra.multiply(
        value, gray(scale))
    return algebra.clamp(mapped, gray(min(to_min, to_max)), gray(max(to_min, to_max))) if node.clamp else mapped


def color_ramp(walk, node, out):
    ramp, factor = node.color_ramp, walk.signed(node.inputs[0])
    read = (lambda c: gray(c[3])) if out.name == "Alpha" else rgb
    if not factor.texture:
        return read(ramp.evaluate(min(max(factor.value[0], 0.0), 1.0)))
    ends = ramp.elements
    if len(ends) == 2 and ramp.interpolation == "LINEAR" and ramp.color_mode == "RGB" and ends[1].position > ends[0].position:
        start, width = ends[0].position, ends[1].position - ends[0].position
        shifted = walk.algebra.blend(Blend.SUBTRACT, factor, gray(start)) if start else factor
        t = walk.algebra.multiply(shifted, gray(1 / width))
        return walk.algebra.blend(Blend.MIX, read(ends[0].color), read(ends[1].color), t)
    walk.warn(node, "a ramp of a texture is rendered from its first to its last colour")
    return walk.algebra.blend(Blend.MIX, read(ends[0].color), read(ends[-1].color), factor)


def rgb_to_bw(walk, node, out):
    color = walk.value(node.inputs[0])[0]
    if color.texture:
        walk.warn(node, "luminance of a texture is rendered as its red channel")
    return Param((luminance(color.value),) * 3, color.texture)


def separate_color(walk, node, out):
    color = walk.value(node.inputs[0])[0]
    if color.texture or getattr(node, "mode", "RGB") != "RGB":
        return unknown_value(walk, node, out)
    return gray(color.value[list(node.outputs).index(out)])


def combine_color(walk, node, out):
    parts = [walk.signed(s) for s in node.inputs]
    if any(p.texture for p in parts) or getattr(node, "mode", "RGB") != "RGB":
        return unknown_value(walk, node, out)
    return Param(tuple(p.value[0] for p in parts))


def blackbody(walk, node, out):
    return rgb(blackbody_color(walk.number(node.inputs[0])))


def blackbody_color(kelvin: float):
    """Linear Rec.709 of luminance 1, from Planck's law and the fitted CIE 1931 curves of Wyman et al. 2013."""
    kelvin = min(max(kelvin, 800.0), 12000.0)

    def lobe(nm, peak, left, right):
        return math.exp(-0.5 * ((nm - peak) * (left if nm < peak else right)) ** 2)

    x = y = z = 0.0
    for nm in range(380, 781, 5):
        radiance = nm ** -5.0 / math.expm1(1.438777e7 / (nm * kelvin))
        x += radiance * (1.056 * lobe(nm, 599.8, 0.0264, 0.0323) + 0.362 * lobe(nm, 442.0, 0.0624, 0.0374)
                         - 0.065 * lobe(nm, 501.1, 0.0490, 0.0382))
        y += radiance * (0.821 * lobe(nm, 568.8, 0.0213, 0.0247) + 0.286 * lobe(nm, 530.9, 0.0613, 0.0322))
        z += radiance * (1.217 * lobe(nm, 437.0, 0.0845, 0.0278) + 0.681 * lobe(nm, 459.0, 0.0385, 0.0725))
    x, z = x / y, z / y
    return (3.2406 * x - 1.5372 - 0.4986 * z, -0.9689 * x + 1.8758 + 0.0415 * z, 0.0557 * x - 0.2040 + 1.0570 * z)


def unknown_value(walk, node, out):
    """Passes the first colour input through; without one the consumer keeps its own value."""
    first = next((s for s in node.inputs if s.type == "RGBA" and s.enabled), None)
    walk.warn(node, "is not supported, " + ("its first colour is used" if first else "what it feeds keeps its own value"))
    return walk.value(first)[0] if first else None


VALUES = {
    "ShaderNodeRGB": output_value,
    "ShaderNodeValue": output_value,
    "ShaderNodeTexImage": image_texture,
    "ShaderNodeVertexColor": vertex_color,
    "ShaderNodeAttribute": attribute,
    "ShaderNodeLightPath": light_path,
    "ShaderNodeFresnel": fresnel_value,
    "ShaderNodeLayerWeight": fresnel_value,
    "ShaderNodeMixRGB": mix_rgb,
    "ShaderNodeMix": mix,
    "ShaderNodeInvert": invert,
    "ShaderNodeGamma": gamma,
    "ShaderNodeBrightContrast": bright_contrast,
    "ShaderNodeHueSaturation": hue_saturation,
    "ShaderNodeMath": math_node,
    "ShaderNodeClamp": clamp_node,
    "ShaderNodeMapRange": map_range,
    "ShaderNodeValToRGB": color_ramp,
    "ShaderNodeRGBToBW": rgb_to_bw,
    "ShaderNodeSeparateColor": separate_color,
    "ShaderNodeSeparateRGB": separate_color,
    "ShaderNodeCombineColor": combine_color,
    "ShaderNodeCombineRGB": combine_color,
    "ShaderNodeBlackbody": blackbody,
}


# ---------------------------------------------------------------- texture coordinates: (walk, node, output) -> Matrix

def texture_coordinate(walk, node, out):
    if out.name != "UV":
        walk.warn(node, f"'{out.name}' coordinates are rendered as UV")
    walk.use_uv_map(node, "")
    return Matrix.Identity(4)


def uv_map(walk, node, out):
    walk.use_uv_map(node, node.uv_map)
    return Matrix.Identity(4)


def attribute_vector(walk, node, out):
    walk.use_uv_map(node, node.attribute_name)
    return Matrix.Identity(4)


def mapping_node(walk, node, out):
    inner = walk.mapping(node.inputs["Vector"], Matrix.Diagonal((0.0, 0.0, 0.0, 1.0)))
    params = {s.name: walk.value(s)[0] for s in node.inputs if s.name != "Vector" and s.enabled}
    if any(p.texture for p in params.values()):
        walk.warn(node, "a mapping that varies is ignored")
        return inner
    vectors = {name: p.value for name, p in params.items()}
    scale = Matrix.Diagonal((*vectors["Scale"], 1.0))
    rotation = Euler(vectors["Rotation"], "XYZ").to_matrix().to_4x4()
    location = Matrix.Translation(vectors.get("Location", (0.0, 0.0, 0.0)))
    if node.vector_type == "TEXTURE":
        return (location @ rotation @ scale).inverted_safe() @ inner
    if node.vector_type == "NORMAL":
        walk.warn(node, "mapping type Normal is rendered as Vector")
    return (location if node.vector_type == "POINT" else Matrix.Identity(4)) @ rotation @ scale @ inner


def unknown_vector(walk, node, out):
    walk.warn(node, "as a texture coordinate is not supported, UV is used")
    return Matrix.Identity(4)


VECTORS = {
    "ShaderNodeTexCoord": texture_coordinate,
    "ShaderNodeUVMap": uv_map,
    "ShaderNodeAttribute": attribute_vector,
    "ShaderNodeMapping": mapping_node,
}
