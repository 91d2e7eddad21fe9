"""What moves while the shutter is open: read by going to frames evenly spaced over it.

As in Cycles an object is seen at 3 of them (5, 9, ... by its *Motion Blur Steps*), the middle one is that at which all else is
exported, and what one of them does not show (a particle that is not born yet) is taken to stand still.
"""

import math
from dataclasses import dataclass, field, replace

import bpy
import numpy as np

from . import compat
from .export_camera import export_camera
from .scene_desc import LightDesc
from .wording import named


class Shutter:
    """The frames between which the shutter is open. As a context, the scene is in the middle of them inside, and then back.

    Args:
        scene: whose settings and current frame count.
        frame_set: called with a frame and its fraction, takes the dependency graph there (RenderEngine.frame_set).
    """

    def __init__(self, scene, frame_set):
        self._frame_set = frame_set
        # Not frame_current_final, which is stretched as the scene's time is: frame_set takes frames as the timeline shows them.
        self._now = self._at = scene.frame_current + scene.frame_subframe
        self._length = scene.render.motion_blur_shutter
        owner, name = compat.motion_blur_position(scene)
        self._middle = self._now + {"START": 0.5, "CENTER": 0.0, "END": -0.5}[getattr(owner, name)] * self._length

    def go_to(self, share):
        """Goes to a time between the opening, 0, and the closing, 1."""
        self._go_to_frame(self._middle + (share - 0.5) * self._length)

    def _go_to_frame(self, frame):
        if frame != self._at:
            whole = math.floor(frame)
            self._frame_set(whole, frame - whole)
            self._at = frame

    def __enter__(self):
        self.go_to(0.5)
        return self

    def __exit__(self, *_):
        self._go_to_frame(self._now)


def shutter_of(engine, scene):
    """The shutter that a scene's settings ask for, None without motion blur."""
    render = scene.render
    return Shutter(scene, engine.frame_set) if render.use_motion_blur and render.motion_blur_shutter > 0.0 else None


@dataclass
class _Track:
    """What is known of the way of one exported item: `items[index]` of a SceneDesc; `places` (3, 4) by number of the key."""

    items: list
    index: int
    count: int
    places: dict = field(default_factory=dict)

    def motion(self):
        """(keys, 3, 4) float64, None if it stands still."""
        item = self.items[self.index]
        places = [self.places.get(key, item.transform) for key in range(self.count)]
        places = [place if _is_usable(place, item) else item.transform for place in places]
        return None if all(np.array_equal(place, item.transform) for place in places) else np.array(places)


def _is_usable(place, item):
    """A lamp that is scaled to 0 has no direction."""
    return np.isfinite(place).all() and (not isinstance(item, LightDesc) or np.linalg.norm(place[:, 2]) > 0.0)


class MotionReader:
    """Follows the items of a SceneDesc through the shutter; `warn` is called with a message for what is not blurred."""

    def __init__(self, desc, warn):
        self._desc, self._warn = desc, warn
        self._tracks = {}
        self._deformed = {}  # name of each object that is; a dictionary keeps the order

    def note(self, instance, items):
        """To be called after the export of a dependency graph's instance as the last of `items`."""
        count = _key_count(instance.object.original, instance.parent.original if instance.is_instance else None)
        if count > 1:
            self._tracks[_identity(instance)] = _Track(items, len(items) - 1, count)

    def follow(self, depsgraph, shutter, camera):
        """Goes through the shutter and writes what moves into the description, which has all as it is in the middle."""
        _warn_of_settings(depsgraph.scene, self._warn)
        camera = camera.original
        camera_count = _key_count(camera)
        count = max([track.count for track in self._tracks.values()] + [camera_count])
        cameras = []
        for step in range(count):
            if 2 * step == count - 1:
                cameras.append(self._desc.camera)
                continue
            shutter.go_to(step / (count - 1))
            self._read(depsgraph, step, count)
            if _is_key(step, count, camera_count):
                cameras.append(export_camera(camera.evaluated_get(depsgraph), depsgraph.scene_eval.render, lambda message: None))
        for track in self._tracks.values():
            motion = track.motion()
            if motion is not None:
                track.items[track.index] = replace(track.items[track.index], motion=motion)
        if not all(_same_view(other, self._desc.camera) for other in cameras):
            self._desc.camera_motion = tuple(cameras)
        self._warn_of_deformation()

    def _read(self, depsgraph, step, count):
        for instance in depsgraph.object_instances:
            track = self._tracks.get(_identity(instance))
            if track is None or not _is_key(step, count, track.count):
                continue
            key = step * (track.count - 1) // (count - 1)
            track.places[key] = np.array(instance.matrix_world, dtype=np.float64)[:3]
            if key in (0, track.count - 1):
                self._look_for_deformation(instance.object, track)

    def _look_for_deformation(self, obj, track):
        if obj.name in self._deformed or not isinstance(obj.data, bpy.types.Mesh) or not _may_deform(obj.original):
            return
        then, now = compat.positions(obj.data), self._desc.meshes[track.items[track.index].mesh - 1].positions
        if then.shape != now.shape or not np.array_equal(then, now):
            self._deformed[obj.name] = True

    def _warn_of_deformation(self):
        if self._deformed:
            self._warn(f"object {named(list(self._deformed))}: deformation is not blurred, only movement as a whole")


def _identity(instance):
    """The same for the same instance at every frame: what it is called, who makes it, as which of how many."""
    if not instance.is_instance:
        return instance.object.name_full
    return instance.object.name_full, instance.parent.name_full, tuple(instance.persistent_id)


def _key_count(obj, parent=None):
    """Of an object, or of what `parent` makes of it; 1 where an object's own switch turns motion blur off."""
    owners = [cycles for cycles in (getattr(owner, "cycles", None) for owner in (obj, parent) if owner) if cycles]
    if not all(cycles.use_motion_blur for cycles in owners):
        return 1
    return 2 ** max([cycles.motion_steps for cycles in owners] + [1]) + 1


def _is_key(step, count, of):
    """Whether a step of `count` is a key of what has `of`, both one more than a power of 2."""
    return of > 1 and step % ((count - 1) // (of - 1)) == 0


def _may_deform(original):
    """Whether the evaluated mesh may be another at another frame."""
    is_wanted = getattr(getattr(original, "cycles", None), "use_deform_motion", True)
    return is_wanted and (original.type != "MESH" or len(original.modifiers) > 0 or original.data.shape_keys is not None)


def _same_view(a, b):
    return np.array_equal(a.transform, b.transform) and replace(a, transform=None) == replace(b, transform=None)


def _warn_of_settings(scene, warn):
    if getattr(getattr(scene, "cycles", None), "rolling_shutter_type", "NONE") != "NONE":
        warn("motion blur: a rolling shutter is not supported, the whole picture is exposed at once")
    mapping = scene.render.motion_blur_shutter_curve
    mapping.initialize()
    if any(abs(mapping.evaluate(mapping.curves[0], share) - 1.0) > 1e-3 for share in np.linspace(0.0, 1.0, 17)):
        warn("motion blur: the shutter curve is not supported, the shutter opens and closes at once")
