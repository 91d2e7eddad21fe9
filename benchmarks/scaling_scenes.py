"""Scenes whose cost is told: those of blend_scenes at any size, the same with textures that change nothing, and a very large mesh."""

import dataclasses

import numpy as np
from sppm import scene_desc
from sppm.scene_desc import ClosureType, TextureType

_COLUMNS = 1000  # of the large mesh: each takes two triangles
_SPACING = 3.0  # metres between its instances


def at_size(desc, size):
    """The scene in a square picture."""
    return dataclasses.replace(desc, camera=dataclasses.replace(desc.camera, width=size, height=size))


def with_uvs(desc):
    """UVs on each mesh, which nothing reads."""
    return dataclasses.replace(desc, meshes=[_give_uvs(mesh) for mesh in desc.meshes])


def textured(desc):
    """White images of one pixel times the colour of everything that reflects: the picture stays as it is."""
    image = scene_desc.ImageDesc("white", np.ones((1, 1, 4), np.float32))
    texture = scene_desc.TextureDesc(TextureType.IMAGE, image=len(desc.images) + 1)
    materials = [_give_texture(material, len(desc.textures) + 1) for material in desc.materials]
    return dataclasses.replace(with_uvs(desc), images=[*desc.images, image], textures=[*desc.textures, texture], materials=materials)


def _give_uvs(mesh):
    if mesh.corner_uvs is not None:
        return mesh
    corners = np.arange(3 * len(mesh.indices), dtype=np.uint32).reshape(-1, 3) if mesh.corners is None else mesh.corners
    return dataclasses.replace(mesh, corners=corners, corner_uvs=np.full((int(corners.max()) + 1, 2), 0.5, np.float32))


def _give_texture(material, texture):
    def changed(closure):
        if closure.type == ClosureType.EMISSION or closure.color.texture:
            return closure
        return dataclasses.replace(closure, color=dataclasses.replace(closure.color, texture=texture))

    return dataclasses.replace(material, closures=tuple(map(changed, material.closures)))


def large(triangles, instances):
    """A wavy sheet of about so many triangles, and instances of it, before a camera under a grey sky."""
    grey = scene_desc.MaterialDesc("grey", (scene_desc.ClosureDesc(ClosureType.DIFFUSE),))
    camera = scene_desc.CameraDesc(_at(0, 0, 10), (-0.5, 0.5, -0.5, 0.5), 16, 16)
    sheets = [scene_desc.InstanceDesc(f"sheet {i}", 1, (1,), place) for i, place in enumerate(places(instances))]
    return scene_desc.SceneDesc(camera=camera, world=scene_desc.WorldDesc((1.0, 1.0, 1.0)), materials=[grey],
                                meshes=[wavy_sheet(triangles)], instances=sheets)


def places(count):
    """Where instances of the sheet stand beside each other, (3, 4) each."""
    side = int(np.ceil(np.sqrt(count)))
    return [_at(_SPACING * (i % side), _SPACING * (i // side), 0) for i in range(count)]


def wavy_sheet(triangles):
    """A mesh of 2 m by 2 m."""
    rows = max(1, round(triangles / (2 * _COLUMNS)))
    x, y = np.meshgrid(np.linspace(-1, 1, _COLUMNS + 1), np.linspace(-1, 1, rows + 1))
    positions = np.stack([x, y, 0.05 * np.sin(20 * x) * np.cos(17 * y)], axis=-1).reshape(-1, 3).astype(np.float32)
    corner = (np.arange(rows)[:, None] * (_COLUMNS + 1) + np.arange(_COLUMNS)).reshape(-1)
    right, up = corner + 1, corner + _COLUMNS + 1
    indices = np.concatenate([np.stack([corner, right, up], axis=1), np.stack([right, up + 1, up], axis=1)])
    return scene_desc.MeshDesc("sheet", positions, indices.astype(np.uint32))


def _at(x, y, z):
    place = np.eye(3, 4)
    place[:, 3] = x, y, z
    return place
