"""Nodes that make numbers of numbers: (walk, node, output) -> Param, None: the consumer's default."""

import math

from .material_params import ZERO, gray
from .nodes_common import unknown_value
from .scene_desc import Blend


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


MATH_NODES = {
    "ShaderNodeMath": math_node,
    "ShaderNodeClamp": clamp_node,
    "ShaderNodeMapRange": map_range,
}
