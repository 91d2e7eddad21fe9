"""Shader nodes whose sockets were renamed between Blender 3.4 and 4.0. Sockets are asked for by their 3.4 names."""


import bpy

PRINCIPLED_V2_NAMES = {
    "Specular": "Specular IOR Level",
    "Transmission": "Transmission Weight",
    "Emission": "Emission Color",
    "Clearcoat": "Coat Weight",
    "Clearcoat Roughness": "Coat Roughness",
    "Clearcoat Normal": "Coat Normal",
    "Sheen": "Sheen Weight",
    "Subsurface": "Subsurface Weight",
}


def principled_is_v2(node: bpy.types.Node) -> bool:
    """Whether this Principled BSDF is that of Blender 4.0 and later."""
    return "Specular IOR Level" in node.inputs


def microfacets_are_of_3_x() -> bool:
    """Whether microfacets are Cycles' old ones: see SPPM_CLOSURE_SEPARABLE and SPPM_CLOSURE_SMOOTH_ALBEDO in sppm.h."""
    return bpy.app.version < (4, 0, 0)


def coats_keep_energy() -> bool:
    """Whether Cycles gives back what is lost between the facets of a Principled coat, whatever the node's distribution."""
    return bpy.app.version >= (4, 5, 0)


def default_is_principled() -> bool:
    """Whether what has no material shows a Principled BSDF of default settings, as in Cycles since 5.0, and not plain grey."""
    return bpy.app.version >= (5, 0, 0)


def principled_input(node: bpy.types.Node, name: str) -> bpy.types.NodeSocket | None:
    """The input with the 3.4 `name` or what it is called since; None where this version has no such input."""
    return node.inputs.get(name) or node.inputs.get(PRINCIPLED_V2_NAMES.get(name, name))
