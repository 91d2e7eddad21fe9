"""Blender's evaluated scene -> SceneDesc and the list of what could not be said with it.

The dependency graph is walked once. A mesh is read once and referred to by an instance for each place where it stands;
instances of collections, geometry nodes and particles all arrive here as instances. No Blender object outlives its step of the
walk.
"""

from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

from . import compat
from .bounds import instance_boxes
from .export_cache import CachedMaterials, CachedMesh, ExportCache
from .export_camera import export_camera
from .export_image import ImageExporter
from .export_light import export_light, export_world
from .export_mesh import export_mesh
from .export_motion import MotionReader
from .scene_desc import InstanceDesc, InstanceFlags, SceneDesc
from .wording import named

_UNSUPPORTED = {"CURVES": "hair curves", "VOLUME": "a volume", "POINTCLOUD": "a point cloud", "GPENCIL": "grease pencil",
                "GREASEPENCIL": "grease pencil"}
_FARTHEST = 1e11  # metres from the middle of the scene; kLargestCoordinate of native/src/accel.cpp
_OTHER_RAYS = ("diffuse", "glossy", "transmission", "shadow")


def export_scene(depsgraph, camera=None, shutter=None):
    """Exports what a render of the dependency graph's view layer shows.

    Args:
        depsgraph: evaluated for rendering.
        camera: camera object to use instead of the scene's.
        shutter: the frames through which what moves is blurred, None for no motion blur.

    Returns:
        (SceneDesc, list of messages for the user, each once).

    Raises:
        CameraError: there is no camera to look through.
    """
    with shutter or nullcontext():
        walk = _walked(depsgraph, camera, shutter)
    if walk.desc.instances:
        boxes = instance_boxes(walk.desc)
        _move_to_origin(walk.desc, boxes)
        _warn_of_far_ends(walk.desc, boxes - walk.desc.origin, walk.warn)
    return walk.desc, walk.warnings


def _walked(depsgraph, camera, shutter):
    walk = _Walk(ExportCache(), has_passes=True)
    _warn_of_missing_libraries(walk.warn)
    scene = depsgraph.scene_eval
    camera = camera or scene.camera
    walk.desc.camera = export_camera(camera.evaluated_get(depsgraph) if camera else None, scene.render, walk.warn)
    if scene.render.use_multiview:
        walk.warn("stereoscopy is not rendered: every view shows what the camera itself sees")
    walk.motion = MotionReader(walk.desc, walk.warn) if shutter else None
    walk.run(depsgraph, lambda obj: True)
    if walk.motion:
        walk.motion.follow(depsgraph, shutter, camera)
    return walk


def export_viewport(depsgraph, is_shown, cache):
    """Exports what a viewport shows, without its camera.

    Args:
        depsgraph: evaluated for the viewport.
        is_shown: evaluated object -> whether this viewport shows it.
        cache: ExportCache of the viewport: what it holds is not read again unless `depsgraph.updates` names it.
    """
    cache.forget_changes(depsgraph)
    walk = _Walk(cache)
    try:
        walk.run(depsgraph, is_shown)
    except BaseException:
        cache.forget()  # Blender does not tell again what has changed
        raise
    if walk.desc.instances:
        _move_to_origin(walk.desc, instance_boxes(walk.desc))
    return walk.desc


def _warn_of_missing_libraries(warn):
    """Blender says so when it loads the file, but goes on with empty objects as if nothing were wrong."""
    for library in bpy.data.libraries:
        path = bpy.path.abspath(library.filepath, library=library.parent)
        if not library.packed_file and not Path(path).is_file():
            warn(f"library '{library.name}': its file '{path}' is missing, what is linked from it is left out")


class _Walk:
    """What is known while the instances pass by."""

    def __init__(self, cache, has_passes=False):
        self.desc, self.warnings = SceneDesc(), []
        self.motion = None  # or the MotionReader that follows what is exported
        self._cache, self._has_passes = cache, has_passes
        self._images = ImageExporter(self.desc, self.warn, cache.images)
        self._materials = CachedMaterials(self.desc, self.warn, self._images, cache.materials)
        self._meshes = {}  # address -> mesh id or 0
        self._objects_with = {}  # what is said of objects, once for all of them -> their names

    def run(self, depsgraph, is_shown):
        """Exports all but the camera; `is_shown` tells of an object whether it may be seen."""
        self._layer, self._layer_eval = depsgraph.view_layer, depsgraph.view_layer_eval
        if self._layer.use_sky:
            world = compat.world_of(depsgraph.scene_eval, self._layer_eval)
            self.desc.world = export_world(world, self._images.export, self.warn)
        for instance in depsgraph.object_instances:
            if is_shown(instance.object):
                self._visit(instance)
        self._warn_of_objects()
        self._cache.keep_only(self._meshes, self._materials.ids, self._images.ids)

    def warn(self, message):
        if message not in self.warnings:
            self.warnings.append(message)

    def _note(self, obj, what):
        self._objects_with.setdefault(what, []).append(obj.name)

    def _warn_of_objects(self):
        """One message for each kind of what objects ask for and do not get."""
        for what, names in self._objects_with.items():
            self.warn(f"object {named(names)}: {what}")

    def _visit(self, instance):
        """Exports one instance if it shows itself; an instancer may hide behind what it instances."""
        obj = instance.object
        if instance.show_particles:
            self._warn_of_hair(obj)
        if not instance.show_self:
            return
        if obj.type == "LIGHT":
            light = export_light(obj, instance.matrix_world, self.warn)
            if light:
                self._append(light, self.desc.lights, instance)
        elif isinstance(obj.data, bpy.types.Mesh):
            # Curves, texts, surfaces and metaballs pass by twice: as themselves, and as the mesh that they evaluate to.
            if self._layer.use_solid:
                self._add_instance(instance)
        elif obj.type in _UNSUPPORTED:
            self.warn(f"object '{obj.name}': {_UNSUPPORTED[obj.type]} cannot be rendered and is left out")

    def _append(self, item, items, instance):
        items.append(item)
        if self.motion:
            self.motion.note(instance, items)

    def _warn_of_hair(self, obj):
        for system in obj.particle_systems:
            if system.settings.type == "HAIR" and system.settings.render_type == "PATH":
                self.warn(f"object '{obj.name}': particle hair '{system.name}' cannot be rendered and is left out")

    def _add_instance(self, instance):
        obj = instance.object
        flags = self._flags(obj, instance.parent if instance.is_instance else obj)
        if flags is None:
            return
        transform = np.array(instance.matrix_world, dtype=np.float64)[:3]
        if not np.isfinite(transform).all():
            self.warn(f"object '{obj.name}': its place or scale is not finite, it is left out")
            return
        # The determinant spares nearly all instances the rank, which takes half as long as the rest of their export.
        if instance.matrix_world.determinant() == 0 and np.linalg.matrix_rank(transform[:, :3]) < 2:
            return  # scaled to a point or a line; what is squeezed flat still shows
        materials = [self._layer_eval.material_override or material for material in _materials_of(obj)]
        ids = tuple(map(self._materials.export, materials))
        mesh_id = self._mesh_id(obj, materials)
        if mesh_id:
            desc = InstanceDesc(obj.name, mesh_id, ids, transform, flags, obj.pass_index)
            self._append(desc, self.desc.instances, instance)

    def _flags(self, obj, parent):
        """How camera rays see an object, None if no ray sees it; what is said of `parent`, which instances it, counts for it."""
        def seen_by(ray):
            return getattr(obj, f"visible_{ray}") and getattr(parent, f"visible_{ray}")

        holdout = parent.original.holdout_get(view_layer=self._layer)
        camera = seen_by("camera") and (holdout or not parent.original.indirect_only_get(view_layer=self._layer))
        others = [seen_by(ray) for ray in _OTHER_RAYS]
        if not camera and not any(others):
            return None
        if not all(others):
            self._note(obj, "ray visibility counts for camera rays only, all other rays see it")
        if obj.is_shadow_catcher or parent.is_shadow_catcher:
            self._note(obj, "a shadow catcher is rendered as an ordinary object")
        flags = InstanceFlags.HOLDOUT if holdout else InstanceFlags.NONE
        return flags if camera else flags | InstanceFlags.HIDDEN_FROM_CAMERA

    def _mesh_id(self, obj, materials):
        """The mesh's id, 0 if it is empty; read again only if it has changed or another instance's materials want more of it."""
        # The dependency graph keeps its meshes in place, so an address tells them apart.
        key = obj.data.as_pointer()
        wants_uvs, wants_colors = self._wants(obj, materials)
        known = self._cache.meshes.get(key) if key in self._meshes or not self._cache.is_reshaped(obj) else None
        if known is None or not known.serves(wants_uvs, wants_colors):
            if known:
                wants_uvs, wants_colors = wants_uvs or known.has_uvs, wants_colors if wants_colors is not None else known.colors
            known = CachedMesh(_read_mesh(obj, wants_uvs, wants_colors, self.warn), wants_uvs, wants_colors)
            self._cache.meshes[key] = known
            if self._meshes.get(key):
                self.desc.meshes[self._meshes[key] - 1] = known.desc
        if key not in self._meshes:
            if known.desc:
                self.desc.meshes.append(known.desc)
            self._meshes[key] = len(self.desc.meshes) if known.desc else 0
        return self._meshes[key]

    def _wants(self, obj, materials):
        """(whether UVs are read, by a material or for their pass, name of the colour attribute read or None)."""
        needs = [self._materials.needs(material) for material in materials]
        names = {need.colors for need in needs} - {None}
        if len(names) > 1:
            self.warn(f"object '{obj.name}': its materials read several colour attributes, only one can be used")
        wants_uvs = (self._has_passes and self._layer.use_pass_uv) or any(need.uv_map is not None for need in needs)
        return wants_uvs, min(names, default=None)


def _read_mesh(obj, wants_uvs, wants_colors, warn):
    """The MeshDesc of an evaluated object, None if it is empty; one that is being edited has its triangles elsewhere."""
    if not obj.data.is_editmode:
        return export_mesh(obj.data, wants_uvs, wants_colors, warn)
    try:
        return export_mesh(obj.to_mesh(), wants_uvs, wants_colors, warn)
    finally:
        obj.to_mesh_clear()


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
    for items in (desc.instances, desc.lights):
        items[:] = [replace(item, transform=moved(item.transform, centre), motion=moved(item.motion, centre)) for item in items]
    if desc.camera:
        desc.camera, *camera_motion = (replace(camera, transform=moved(camera.transform, centre))
                                       for camera in (desc.camera, *desc.camera_motion))
        desc.camera_motion = tuple(camera_motion)


def moved(transforms, centre):
    """One (3, 4) transform or several, or None, into a scene whose origin is `centre`."""
    if transforms is None:
        return None
    result = transforms.copy()
    result[..., 3] -= centre
    return result


def _warn_of_far_ends(desc, boxes, warn):
    """The library traces no ray that starts farther out: what lies there is seen, but nothing is seen or shadowed from there."""
    is_far = np.abs(boxes).max(axis=(1, 2)) > _FARTHEST
    if is_far.any():
        names = named(item.name for item, far in zip(desc.instances, is_far) if far)
        warn(f"object {names} reaches beyond {_FARTHEST:.0e} m, where no shadows and reflections are rendered")
