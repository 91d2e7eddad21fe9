"""What a user should know about a scene: why it shows no caustics, or looks other than in Cycles. One line each, with names.

Works on a SceneDesc and costs a few milliseconds: only meshes of glass are looked into, 0.13 s for a million triangles, and no
more than `_MAX_TRIANGLES` of them.
"""

from dataclasses import dataclass

import numpy as np

from . import shell
from .bounds import instance_boxes
from .scene_desc import ClosureType, LightFlags, LightType, Projection
from .wording import named

_MAX_TRIANGLES = 2_000_000  # of all glass together; meshes beyond are taken to be sound
_MAX_GLASS = 5000  # instances that are looked through
_VIEW_RAYS = 16  # to a side of the picture

_SOUND = shell.Shell(is_closed=True, is_consistent=True, volume=1.0, is_sheet=False)


def before_render(desc, max_depth):
    """Messages about a scene; `max_depth` as in the settings."""
    specular = _instances_with(desc, _is_specular)
    glass = _glass_objects(desc)
    messages = _of_shells(glass)
    if len(glass) <= _MAX_GLASS:
        messages += _of_small_lights(desc, glass) + _of_depth(desc, glass, max_depth)
    return messages + _of_sun(desc, specular)


def after_render(progress, has_specular):
    """Messages about a render; `progress` as of its end."""
    is_dark = progress.photons_emitted > 0 and progress.photons_stored == 0
    if not (is_dark and has_specular):
        return []
    return [f"none of {progress.photons_emitted} photons arrived on a surface in view, so no caustics are shown: does light "
            "reach the glass and mirrors, and is a diffuse surface behind them in view?"]


# ---------------------------------------------------------------- what there is


@dataclass(frozen=True)
class _Glass:
    """An instance with glass: `box` (2, 3) world; `layers` surfaces that a straight line through it meets at least."""

    name: str
    box: np.ndarray
    shell: shell.Shell

    @property
    def layers(self):
        return 2 if self.shell.is_closed else 1


def _has_closure(material, *types):
    return any(closure.type in types and any(closure.weight.value) for closure in material.closures)


def _is_glass(material):
    return _has_closure(material, ClosureType.DIELECTRIC)


def _is_specular(material):
    """What can throw a caustic; a coat, which every plastic has, does not count."""
    return _has_closure(material, ClosureType.DIELECTRIC, ClosureType.CONDUCTOR)


def _instances_with(desc, test):
    """[(index of the instance, its slots)] of instances with triangles whose material passes the test."""
    passes = [False] + [test(material) for material in desc.materials]
    known, found = {}, []
    for index, instance in enumerate(desc.instances):
        key = (instance.mesh, instance.materials)
        if key not in known:
            slots = [slot for slot, material in enumerate(instance.materials) if passes[material]]
            known[key] = tuple(slot for slot in slots if slot in _used_slots(desc.meshes[instance.mesh - 1]))
        if known[key]:
            found.append((index, known[key]))
    return found


def _used_slots(mesh):
    return {0} if mesh.material_slots is None else set(np.flatnonzero(np.bincount(mesh.material_slots)).tolist())


def _glass_objects(desc):
    found = _instances_with(desc, _is_glass)
    if not found:
        return []
    shells, examined, glass = {}, 0, []
    for (index, slots), box in zip(found, instance_boxes(desc, [index for index, _ in found])):
        instance = desc.instances[index]
        mesh, key = desc.meshes[instance.mesh - 1], (instance.mesh, slots)
        if key not in shells:
            examined += len(mesh.indices)
            shells[key] = _shell(mesh, slots) if examined <= _MAX_TRIANGLES else _SOUND
        glass.append(_Glass(instance.name, box, shells[key]))
    return glass


def _shell(mesh, slots):
    """Of the whole mesh or, where that is open, of the part that is glass."""
    whole = shell.examine(mesh.positions, mesh.indices)
    if whole.is_closed or mesh.material_slots is None:
        return whole
    return shell.examine(mesh.positions, mesh.indices[np.isin(mesh.material_slots, slots)])


# ---------------------------------------------------------------- messages


def _of_shells(glass):
    mixed = [item.name for item in glass if item.shell.is_closed and not item.shell.is_consistent]
    inward = [item.name for item in glass if _looks_inward(item.shell) and not _is_bubble(item, glass)]
    is_open = [item.name for item in glass if not item.shell.is_closed and not item.shell.is_sheet]
    messages = []
    if mixed:
        messages.append(f"object {named(mixed)}: some faces of its glass look inwards, some outwards; recalculate its "
                        "normals (in Edit Mode, Mesh > Normals > Recalculate Outside)")
    if inward:
        messages.append(f"object {named(inward)}: the faces of its glass look inwards, so that its inside counts as air; "
                        "recalculate its normals (in Edit Mode, Mesh > Normals > Recalculate Outside)")
    if is_open:
        messages.append(f"object {named(is_open)}: its glass is an open shell, so light that enters never comes out of it; "
                        "close it or give it thickness, unless it is the surface of a liquid (in Edit Mode, "
                        "Select > Select All by Trait > Non Manifold shows the hole)")
    return messages


def _looks_inward(item):
    return item.is_closed and item.is_consistent and item.volume < 0.0


def _is_bubble(item, glass):
    """Whether it lies within other glass: there it is right that the faces look inwards."""
    low, high = item.box
    return any(other is not item and (other.box[0] <= low).all() and (high <= other.box[1]).all() for other in glass)


def _of_small_lights(desc, glass):
    found, boxes = [], _boxes(glass)
    for light in desc.lights:
        has_size = light.type not in (LightType.POINT, LightType.SPOT) or light.radius > 0.0
        if not has_size and not light.flags & LightFlags.HIDDEN_FROM_SPECULAR:
            place = light.transform[:, 3]
            names = [item.name for item in _crossed(glass, boxes, *_line_of_sight(desc.camera, place))]
            if names:
                found.append((light.name, names[0]))
    if not found:
        return []
    return [f"light {named(name for name, _ in found)}: it has no size, so it is not seen through the glass of '{found[0][1]}'; "
            "give it a radius"]


def _of_depth(desc, glass, max_depth):
    """Straight lines from the camera, and a photon through one object, need a vertex for each surface and one where they end."""
    if not glass:
        return []
    starts, ends = _view_lines(desc.camera)
    boxes = _boxes(glass)
    crossed = [_crossed(glass, boxes, start, end) for start, end in zip(starts, ends)]
    most = max(crossed + [[item] for item in glass], key=lambda items: sum(item.layers for item in items))
    needed = 1 + sum(item.layers for item in most)
    if needed <= max_depth:
        return []
    names = named(item.name for item in most)
    return [f"max depth {max_depth} cuts light off inside the glass of {names}: at least {needed} is needed"]


def _of_sun(desc, specular):
    suns = [light.name for light in desc.lights if light.type is LightType.SUN]
    if not suns or specular:
        return []
    return [f"light {named(suns)}: no object is made of glass, water or metal, so hardly any caustics are to be expected"]


# ---------------------------------------------------------------- lines through boxes


def _boxes(glass):
    """(n, 2, 3) lowest and highest corners."""
    return np.array([item.box for item in glass])


def _crossed(glass, boxes, start, end):
    """The glass whose box, of `boxes`, the line from `start` to `end` meets; none without a line."""
    if start is None or not glass:
        return []
    direction = end - start
    direction = np.where(direction == 0.0, 1e-30, direction)
    near, far = np.sort((boxes - start) / direction, axis=1).transpose(1, 0, 2)
    is_met = np.maximum(near.max(axis=1), 0.0) <= np.minimum(far.min(axis=1), 1.0)
    return [item for item, met in zip(glass, is_met) if met]


def _view_lines(camera):
    """(n, 3) starts and ends of lines of sight, evenly over the picture."""
    left, right, bottom, top = camera.window
    at = (np.arange(_VIEW_RAYS) + 0.5) / _VIEW_RAYS
    x, y = np.meshgrid(left + at * (right - left), bottom + at * (top - bottom))
    return _lines(camera, x.ravel(), y.ravel(), camera.clip_far)


def _line_of_sight(camera, place):
    """(start, end) from the camera to a place, (None, None) if that is not in the picture."""
    rotation, position = camera.transform[:, :3], camera.transform[:, 3]
    x, y, z = rotation.T @ (place - position)
    if z >= 0.0:
        return None, None
    if camera.projection is not Projection.ORTHOGRAPHIC:
        x, y = x / -z, y / -z
    left, right, bottom, top = camera.window
    if not (left <= x <= right and bottom <= y <= top):
        return None, None
    starts, _ = _lines(camera, np.array([x]), np.array([y]), 1.0)
    return starts[0], place


def _lines(camera, x, y, length):
    rotation, position = camera.transform[:, :3], camera.transform[:, 3]
    points, zero = np.stack((x, y, np.full_like(x, -1.0)), axis=1), np.zeros_like(x)
    if camera.projection is Projection.ORTHOGRAPHIC:
        starts = position + np.stack((x, y, zero), axis=1) @ rotation.T
        return starts, starts - length * rotation[:, 2]
    return np.broadcast_to(position, points.shape), position + length * points @ rotation.T
