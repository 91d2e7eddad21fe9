"""Where in a picture an estimator has which difficulty, told from its passes alone: works for any scene."""

import numpy as np

CAUSTIC_SHARE = 0.1  # of a pixel's radiance that comes by caustics, from which on it counts as one
JUMP = 0.1  # of the inverse depth, which is linear in the picture over a plane
CURVED, CREASE = np.radians(0.5), np.radians(25)  # between normals of neighbours


def _neighbours(values, function):
    """The largest of `function(a, b)` over a pixel's pairs along rows and along columns."""
    out = np.zeros(values.shape[:2])
    for axis in (0, 1):
        a, b = (np.take(values, range(*r), axis) for r in ((0, values.shape[axis] - 1), (1, values.shape[axis])))
        found = function(a, b)
        for first in (0, 1):
            part = [slice(None)] * 2
            part[axis] = slice(first, first + found.shape[axis])
            out[tuple(part)] = np.maximum(out[tuple(part)], found)
    return out


def _bends(inverse):
    """How far a pixel is off the mean of its neighbours, relative to it, along rows or columns."""
    out = np.zeros(inverse.shape)
    out[1:-1] = abs(inverse[:-2] + inverse[2:] - 2 * inverse[1:-1])
    out[:, 1:-1] = np.maximum(out[:, 1:-1], abs(inverse[:, :-2] + inverse[:, 2:] - 2 * inverse[:, 1:-1]))
    return out / np.maximum(inverse, 1e-9)


def regions(depth, normal, combined, caustics):
    """Masks by name, of pixels that see something.

    Args:
        depth: (height, width, 1), perspective; 1e10 where nothing is.
        normal: (height, width, 3).
        combined, caustics: (height, width, 3) of a reference.

    Returns:
        "caustic"; "edges": silhouettes; "corners": creases, outward or inward; "curved": away from both; "flat": the rest. A
        caustic is taken out of the others.
    """
    seen = depth[..., 0] < 1e9
    unit = normal / np.maximum(np.linalg.norm(normal, axis=-1, keepdims=True), 1e-9)
    turn = _neighbours(unit, lambda a, b: np.arccos(np.clip((a * b).sum(-1), -1, 1)))
    caustic = seen & (caustics.sum(-1) > CAUSTIC_SHARE * combined.sum(-1)) & (caustics.sum(-1) > 0)
    edge, crease = seen & (_bends(1 / depth[..., 0]) > JUMP), seen & (turn > CREASE)
    found = {"caustic": caustic}
    for name, mask in (("edges", edge), ("corners", crease), ("curved", seen & (turn > CURVED)), ("flat", seen)):
        found[name] = mask & ~np.any(list(found.values()), axis=0)
    return found
