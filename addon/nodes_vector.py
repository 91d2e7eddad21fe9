"""Texture coordinates: (walk, node, output) -> the affine map from (u, v, 0) to them, as a Matrix."""

from mathutils import Euler, Matrix


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
