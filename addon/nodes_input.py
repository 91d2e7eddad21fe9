"""Nodes whose value comes from elsewhere than their inputs: (walk, node, output) -> Param, None: the consumer's default."""

import math

from mathutils import Matrix

from .material_params import ONE, ZERO, gray, rgb
from .nodes_closure import f0_from_ior
from .nodes_common import default_of
from .scene_desc import Extension, Interpolation, Param, TextureDesc, TextureType

MISSING_IMAGE = (1.0, 0.0, 1.0)  # as in Cycles


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


INPUT_NODES = {
    "ShaderNodeRGB": output_value,
    "ShaderNodeValue": output_value,
    "ShaderNodeTexImage": image_texture,
    "ShaderNodeVertexColor": vertex_color,
    "ShaderNodeAttribute": attribute,
    "ShaderNodeLightPath": light_path,
    "ShaderNodeFresnel": fresnel_value,
    "ShaderNodeLayerWeight": fresnel_value,
    "ShaderNodeBlackbody": blackbody,
}
