"""What distinguishes two SceneDesc of the same scene, and bringing the library's scene from one to the other."""

from dataclasses import fields, replace

import numpy as np

from . import native


def equal(a, b):
    """Whether two descriptions of one item, or None, have the same values."""
    if type(a) is not type(b):
        return False
    return a is None or all(_equal_values(getattr(a, field.name), getattr(b, field.name)) for field in fields(a))


def _equal_values(a, b):
    return np.array_equal(a, b) if isinstance(a, np.ndarray) or isinstance(b, np.ndarray) else a == b


def same_things(a, b):
    """Whether two scenes show the same but for where instances are and what lamps do. Meshes and images are told by identity."""
    return (len(a.lights) == len(b.lights) and a.textures == b.textures and a.materials == b.materials and equal(a.world, b.world)
            and _identical(a.meshes, b.meshes) and _identical(a.images, b.images) and _things(a) == _things(b))


def _identical(a, b):
    return len(a) == len(b) and all(x is y for x, y in zip(a, b))


def _things(scene):
    return [(item.name, item.mesh, item.materials, item.flags) for item in scene.instances]


def moved_instances(a, b):
    """Positions of the instances of one scene that stand elsewhere in another of the same things."""
    return {i for i, (x, y) in enumerate(zip(a.instances, b.instances)) if not np.array_equal(x.transform, y.transform)}


def changed_lights(a, b):
    """Positions of the lamps that differ between scenes of the same things."""
    return {i for i, (x, y) in enumerate(zip(a.lights, b.lights)) if not equal(x, y)}


def is_unchanged(a, b):
    """Whether two scenes show the same, however they are looked at."""
    return a.origin == b.origin and same_things(a, b) and not moved_instances(a, b) and not changed_lights(a, b)


class KeptScene:
    """The library's scene, built anew only where it cannot be changed into the one wanted.

    What has moved once is built so that it can be moved again without building anything.
    """

    def __init__(self):
        self._built, self._desc, self._movable = None, None, set()

    def get(self, desc, camera, threads):
        """A native.Scene that shows the description to the camera; no session of an earlier one may be in a step."""
        known, self._desc = self._desc, None  # until what follows has succeeded
        if known is None or not (known is desc or same_things(known, desc)):
            self._movable = set()
            self._build(desc, camera, threads)
        elif known is not desc:
            self._move(known, desc, camera, threads)
        self._built.set_camera(camera)
        self._desc = desc
        return self._built

    def _build(self, desc, camera, threads):
        self.close()
        instances = [replace(item, movable=i in self._movable) for i, item in enumerate(desc.instances)]
        self._built = native.Scene(replace(desc, camera=camera, instances=instances), threads)

    def _move(self, known, desc, camera, threads):
        moved = moved_instances(known, desc)
        if not moved <= self._movable:
            self._movable |= moved
            self._build(desc, camera, threads)
            return
        for i in moved:
            self._built.move_instance(i + 1, desc.instances[i].transform)
        for i in changed_lights(known, desc):
            self._built.set_light(i + 1, desc.lights[i])
        self._built.update(threads)

    def close(self):
        """Frees the scene."""
        if self._built:
            self._built.close()
        self._built = self._desc = None
