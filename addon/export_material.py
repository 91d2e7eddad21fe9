"""Shader nodes -> MaterialDesc and TextureDesc: one small function a node, found by a table.

The node tree is read as Cycles would: from the active output for Cycles, through reroutes, muted nodes and node groups. A value
is a `Param` (constant times texture); what cannot be said so is replaced by the nearest thing and reported as a warning.

Limits that come from the closures:
 - A texture used as a number (roughness, factor) counts by its first channel, not by its luminance.
 - A glossy layer mixed by Fresnel over a shader that has coats of its own covers only what stands before the first of those.
"""

from collections.abc import Callable
from dataclasses import replace

import bpy

from . import compat
from .material_params import TextureAlgebra, gray, rgb
from .nodes_closure import default_surface, diffuse
from .nodes_walk import Needs, Walk
from .scene_desc import MaterialDesc, SceneDesc


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
        if not compat.uses_nodes(material):
            return MaterialDesc(material.name, (diffuse(rgb(material.diffuse_color)),)), Needs()
        walk = Walk(self, material)
        return MaterialDesc(material.name, tuple(walk.surface())), walk.needs
