"""What an export of a scene keeps for the next one, so that only what has changed is read again.

Everything is known by its address in Blender's memory, and no pointer is followed: Blender tells what it has read, evaluated or
freed since (`Depsgraph.updates`), and what an export does not meet is forgotten at its end, before its address can be given to
something else.
"""

from dataclasses import dataclass, replace
from typing import Optional

import bpy

from .export_material import MaterialExporter
from .nodes_walk import Needs
from .scene_desc import MaterialDesc, MeshDesc, SceneDesc


class ExportCache:
    """Of one dependency graph.

    Attributes:
        meshes: address of an evaluated mesh -> CachedMesh.
        materials: address of an original material, None for the default surface -> MaterialPart.
        images: address of an original image -> ImageDesc.
    """

    def __init__(self):
        self.forget()
        self._depsgraph, self._reshaped = 0, set()

    def forget(self):
        """Drops everything."""
        self.meshes, self.materials, self.images = {}, {}, {}

    def forget_changes(self, depsgraph):
        """Drops what has changed since the last export. Without a word of Blender's about what that is, everything."""
        updates = list(depsgraph.updates)
        if not updates or self._depsgraph != depsgraph.as_pointer():
            self._depsgraph = depsgraph.as_pointer()
            self.forget()
        self._reshaped = {address(update.id) for update in updates if update.is_updated_geometry}
        for update in updates:
            self._forget(update.id.original)

    def _forget(self, changed):
        key = address(changed)
        if isinstance(changed, bpy.types.Material):
            self.materials.pop(key, None)
        elif isinstance(changed, bpy.types.Image):
            self.images.pop(key, None)
            self.materials = {name: part for name, part in self.materials.items() if key not in part.images}
        elif isinstance(changed, bpy.types.NodeTree) and not changed.is_embedded_data:
            self.materials = {}  # a group: which of them use it, Blender does not say

    def is_reshaped(self, obj):
        """Whether the object has another mesh than at the last export, maybe in the same place in memory."""
        return address(obj) in self._reshaped

    def keep_only(self, meshes, materials, images):
        """Ends an export: keeps what it met, by address."""
        self.meshes = {key: mesh for key, mesh in self.meshes.items() if key in meshes}
        self.materials = {key: part for key, part in self.materials.items() if key in materials}
        self.images = {key: image for key, image in self.images.items() if key in images}


def address(block):
    """Of the original of a datablock; None of None."""
    return (block.original or block).as_pointer() if block else None


# ---------------------------------------------------------------- meshes


@dataclass(frozen=True)
class CachedMesh:
    """`desc` is None for a mesh without triangles; the others tell with what it was read, as for `export_mesh`."""

    desc: Optional[MeshDesc]
    has_uvs: bool
    colors: Optional[str]

    def serves(self, wants_uvs, wants_colors):
        """Whether nothing more needs to be read for a material that wants this."""
        return self.desc is None or (self.has_uvs >= wants_uvs and (wants_colors is None or self.colors == wants_colors))


# ---------------------------------------------------------------- materials


@dataclass(frozen=True)
class MaterialPart:
    """A material apart from any scene: its ids count in its own `textures` and `images`, which are addresses."""

    desc: MaterialDesc
    textures: tuple
    images: tuple
    needs: Needs


class CachedMaterials:
    """Adds materials and their textures to a scene, each once; reads those that the cache does not know.

    Args:
        scene: SceneDesc that gets `materials` and `textures`.
        warn: called with a sentence for everything that is not rendered as Cycles would.
        images: ImageExporter of the scene.
        known: address -> MaterialPart; gets what is read.
    """

    def __init__(self, scene, warn, images, known):
        self._scene, self._warn, self._images, self._known = scene, warn, images, known
        self.ids, self._textures = {}, {}

    def export(self, material):
        """The id of `material` in the scene; None is the default surface."""
        key = address(material)
        if key not in self.ids:
            if key not in self._known:
                self._known[key] = self._read(material)
            self._add(self._known[key])
            self.ids[key] = len(self._scene.materials)
        return self.ids[key]

    def needs(self, material):
        """What an exported material reads from a mesh, as Needs."""
        return self._known[address(material)].needs

    def _read(self, material):
        part, images = SceneDesc(), []

        def number(image):
            self._images.export(image)
            if address(image) not in images:
                images.append(address(image))
            return images.index(address(image)) + 1

        exporter = MaterialExporter(part, self._warn, number)
        needs = exporter.needs[exporter.export(material)]
        return MaterialPart(part.materials[0], tuple(part.textures), tuple(images), needs)

    def _add(self, part):
        images = [0, *map(self._images.add, part.images)]
        textures = [0]
        for texture in part.textures:
            ids = {name: textures[getattr(texture, name)] for name in ("a", "b", "factor")}
            textures.append(self._texture_id(replace(texture, image=images[texture.image], **ids)))
        self._scene.materials.append(_renumbered(part.desc, textures) if part.textures else part.desc)

    def _texture_id(self, texture):
        if texture not in self._textures:
            self._scene.textures.append(texture)
            self._textures[texture] = len(self._scene.textures)
        return self._textures[texture]


def _renumbered(material, textures):
    """The material with the texture ids that a list gives to its own."""
    def param(old):
        return replace(old, texture=textures[old.texture]) if old.texture else old

    names = ("weight", "color", "color2", "roughness")
    return replace(material, closures=tuple(
        replace(closure, **{name: param(getattr(closure, name)) for name in names}) for closure in material.closures))
