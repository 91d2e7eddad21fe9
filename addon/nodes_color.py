"""Nodes that make colours of colours: (walk, node, output) -> Param, None: the consumer's default."""

import colorsys

from .material_params import ZERO, at_least_zero, gray, luminance, rgb
from .nodes_common import by_identifier, unknown_value
from .scene_desc import Blend, Param


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


COLOR_NODES = {
    "ShaderNodeMixRGB": mix_rgb,
    "ShaderNodeMix": mix,
    "ShaderNodeInvert": invert,
    "ShaderNodeGamma": gamma,
    "ShaderNodeBrightContrast": bright_contrast,
    "ShaderNodeHueSaturation": hue_saturation,
    "ShaderNodeValToRGB": color_ramp,
    "ShaderNodeRGBToBW": rgb_to_bw,
    "ShaderNodeSeparateColor": separate_color,
    "ShaderNodeSeparateRGB": separate_color,
    "ShaderNodeCombineColor": combine_color,
    "ShaderNodeCombineRGB": combine_color,
}
