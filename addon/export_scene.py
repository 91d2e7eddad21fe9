"""Blender's evaluated scene -> SceneDesc and the list of what could not be said with it.

The dependency graph is walked once. A mesh is read once and referred to by an instance for each place where it stands;
instances of collections, geometry nodes and particles all arrive here as instances. No Blender object outlives its step of the
walk.
"""

from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

from . import compat
from .bounds import instance_boxes
from .export_camera import export_camera
from .export_image import ImageExporter
from .export_light import export_light, export_world
from .export_material import MaterialExporter
from .export_mesh import export_mesh
from .scene_desc import InstanceDesc, InstanceFlags, SceneDesc
from .wording import named

_UNSUPPORTED = {"CURVES": "hair curves", "VOLUME": "a volume", "POINTCLOUD": "a point cloud", "GPENCIL": "grease pencil",
                "GREASEPENCIL": "grease pencil"}
_FARTHEST = 1e11  # metres from the middle of the scene; kLargestCoordinate of native/src/accel.cpp
_OTHER_RAYS = ("diffuse", "glossy", "transmission", "shadow")


def export_scene(depsgraph, camera=None):
    """Exports what a render of the dependency graph's view layer shows.

    Args:
        depsgraph: evaluated for rendering.
        camera: camera object to use instead of the scene's.

    Returns:
        (SceneDesc, list of messages for the user, each once).

    Raises:
        CameraError: there is no camera to look through.
    """
    walk = _Walk(depsgraph)
    _warn_of_missing_libraries(walk.warn)
    scene = depsgraph.scene_eval
    camera = camera or scene.camera
    walk.desc.camera = export_camera(camera.evaluated_get(depsgraph) if camera else None, scene.render, walk.warn)
    if depsgraph.view_layer.use_sky:
        walk.desc.world = export_world(compat.world_of(scene, depsgraph.view_layer_eval), walk.images.export, walk.warn)
    if scene.render.use_multiview:
        walk.warn("stereoscopy is not rendered: every view shows what the camera itself sees")
    for instance in depsgraph.object_instances:
        walk.visit(instance)
    walk.warn_of_objects()
    if walk.desc.instances:
        boxes = instance_boxes(walk.desc)
        _move_to_origin(walk.desc, boxes)
        _warn_of_far_ends(walk.desc, boxes - walk.desc.origin, walk.warn)
    return walk.desc, walk.warnings


def _warn_of_missing_libraries(warn):
    """Blender says so when it loads the file, but goes on with empty objects as if nothing were wrong."""
    for library in bpy.data.libraries:
        path = bpy.path.abspath(library.filepath, library=library.parent)
        if not library.packed_file and not Path(path).is_file():
            warn(f"library '{library.name}': its file '{path}' is missing, what is linked from it is left out")


class _Walk:
    """What is known while the instances pass by."""

    def __init__(self, depsgraph):
        self.desc, self.warnings = SceneDesc(), []
        self.images = ImageExporter(self.desc, self.warn)
        self._depsgraph = depsgraph
        self._materials = MaterialExporter(self.desc, self.warn, self.images)
        self._meshes = {}  # address -> (mesh id or 0, wants UVs, wanted colours)
        self._objects_with = {}  # what is said of objects, once for all of them -> their names

    def warn(self, message):
        if message not in self.warnings:
            self.warnings.append(message)

    def warn_of_objects(self):
        """One message for each kind of what objects ask for and do not get."""
        for what, names in self._objects_with.items():
            self.warn(f"object {named(names)}: {what}")

    def visit(self, instance):
        """Exports one instance if it shows itself; an instancer may hide behind what it instances."""
        obj = instance.object
        if instance.show_particles:
            self._warn_of_hair(obj)
        if not instance.show_self:
            return
        if obj.type == "LIGHT":
            light = export_light(obj, instance.matrix_world, self.warn)
            if light:
                self.desc.lights.append(light)
        elif isinstance(obj.data, bpy.types.Mesh):
            # Curves, texts, surfaces and metaballs pass by twice: as themselves, and as the mesh that they evaluate to.
            if self._depsgraph.view_layer.use_solid:
                self._add_instance(obj, instance.parent if instance.is_instance else obj, instance.matrix_world)
        elif obj.type in _UNSUPPORTED:
            self.warn(f"object '{obj.name}': {_UNSUPPORTED[obj.type]} cannot be rendered and is left out")

    def _warn_of_hair(self, obj):
        for system in obj.particle_systems:
            if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
                self.warn(f"object '{obj.name}': particle hair '{system.name}' cannot be rendered and is left out")

    def _add_instance(self, obj, parent, matrix):
        """`parent` is what instances the object, or the object itself."""
        flags = self._flags(obj, parent)
        if flags is None:
            return
        transform = np.array(matrix, dtype=np.float64)[:3]
        if not np.isfinite(transform).all():
            self.warn(f"object '{obj.name}': its place or scale is not finite, it is left out")
            return
        if np.linalg.matrix_rank(transform[:, :3]) < 2:
            return  # scaled to a point or a line; what is squeezed flat still shows
        override = self._depsgraph.view_layer_eval.material_override
        materials = tuple(self._materials.export(override or material) for material in _materials_of(obj))
        mesh_id = self._mesh_id(obj, materials)
        if mesh_id:
            self.desc.instances.append(InstanceDesc(obj.name, mesh_id, materials, transform, flags, obj.pass_index))

    def _flags(self, obj, parent):
        """How camera rays see an object, None if no ray sees it; what is said of an instancer counts for what it instances."""
        def seen_by(ray):
            return getattr(obj, f"visible_{ray}") and getattr(parent, f"visible_{ray}")

        layer = self._depsgraph.view_layer
        holdout = parent.original.holdout_get(view_layer=layer)
        camera = seen_by("camera") and (holdout or not parent.original.indirect_only_get(view_layer=layer))
        others = [seen_by(ray) for ray in _OTHER_RAYS]
        if not camera and not any(others):
            return None
        if not all(others):
            self._objects_with.setdefault("ray visibility counts for camera rays only, all other rays see it", []).append(obj.name)
        if obj.is_shadow_catcher or parent.is_shadow_catcher:
            self._objects_with.setdefault("a shadow catcher is rendered as an ordinary object", []).append(obj.name)
        flags = InstanceFlags.HOLDOUT if holdout else InstanceFlags.NONE
        return flags if camera else flags | InstanceFlags.HIDDEN_FROM_CAMERA

    def _mesh_id(self, obj, materials):
        """The mesh's id, 0 if it is empty; read again only if another instance's materials want more of it."""
        # The dependency graph keeps its meshes in place during the walk, so an address tells them apart.
        key = obj.data.as_pointer()
        wants_uvs, wants_colors = self._wants(obj, materials)
        known = self._meshes.get(key)
        if known:
            mesh_id, had_uvs, had_colors = known
            if mesh_id == 0 or (had_uvs >= wants_uvs and (wants_colors is None or had_colors == wants_colors)):
                return mesh_id
            wants_uvs, wants_colors = wants_uvs or had_uvs, wants_colors if wants_colors is not None else had_colors
        desc = export_mesh(obj.data, wants_uvs, wants_colors, self.warn)
        if desc is None:
            mesh_id = 0
        elif known:
            mesh_id = known[0]
            self.desc.meshes[mesh_id - 1] = desc
        else:
            self.desc.meshes.append(desc)
            mesh_id = len(self.desc.meshes)
        self._meshes[key] = (mesh_id, wants_uvs, wants_colors)
        return mesh_id

    def _wants(self, obj, materials):
        """(whether UVs are read, by a material or for their pass, name of the colour attribute read or None)."""
        names = {_color_name(self._materials.needs_colors(material)) for material in materials} - {None}
        if len(names) > 1:
            self.warn(f"object '{obj.name}': its materials read several colour attributes, only one can be used")
        wants_uvs = self._depsgraph.view_layer.use_pass_uv or any(self._materials.needs_uvs(material) for material in materials)
        return wants_uvs, min(names, default=None)


def _color_name(answer):
    """'' for the active attribute, None for no attribute."""
    if answer is True:
        return ""
    return answer if isinstance(answer, str) else None


def _materials_of(obj):
    """A material (or None) a slot: the object's where the slot is linked to it, else the evaluated mesh's."""
    mesh, slots = obj.data, obj.material_slots
    for index in range(max(len(mesh.materials), 1)):
        slot = slots[index] if index < len(slots) else None
        if slot is not None and slot.link == "OBJECT":
            yield slot.material
        elif index < len(mesh.materials):
            yield mesh.materials[index]
        else:
            yield slot.material if slot else None


def _move_to_origin(desc, boxes):
    """Moves a scene that lies farther from Blender's origin than it is large to its own centre, in double precision.

    Single precision, which the renderer computes in, then loses at most a bit; a scene around the origin stays as it is. The
    centre is that of the bounds of all instances, rounded to metres.
    """
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    centre = np.round((low + high) / 2.0)
    if np.linalg.norm(centre) <= np.linalg.norm(high - low):
        return
    desc.origin = tuple(centre)
    desc.instances = [replace(item, transform=_moved(item.transform, centre)) for item in desc.instances]
    desc.lights = [replace(item, transform=_moved(item.transform, centre)) for item in desc.lights]
    desc.camera = replace(desc.camera, transform=_moved(desc.camera.transform, centre))


def _moved(transform, centre):
    moved = transform.copy()
    moved[:, 3] -= centre
    return moved


def _warn_of_far_ends(desc, boxes, warn):
    """The library traces no ray that starts farther out: what lies there is seen, but nothing is seen or shadowed from there."""
    is_far = np.abs(boxes).max(axis=(1, 2)) > _FARTHEST
    if is_far.any():
        names = named(item.name for item, far in zip(desc.instances, is_far) if far)
        warn(f"object {names} reaches beyond {_FARTHEST:.0e} m, where no shadows and reflections are rendered")
