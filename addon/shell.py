"""What a triangle mesh encloses: whether it is closed, which way its faces look, whether it is a mere sheet.

Every question is a sum over triangles, so it costs a few passes over the arrays and no sorting. Vertices at the same place count
as one: seams of a mesh that was split there do not open it.
"""

from dataclasses import dataclass

import numpy as np

_CHUNK = 1 << 18  # triangles looked at together
_FLATNESS = 0.8  # of a sheet: the length of its area vector over its area; a half sphere has 0.5


@dataclass(frozen=True)
class Shell:
    """What surrounds a volume, or does not.

    Attributes:
        is_closed: every edge has a face on its other side.
        is_consistent: faces beside each other look to the same side.
        volume: signed, cubed units of the positions; negative where the faces of a closed shell look inwards.
        is_sheet: open, and nearly flat, such as the surface of water.
    """

    is_closed: bool
    is_consistent: bool
    volume: float
    is_sheet: bool


def examine(positions, indices):
    """The shell that triangles make.

    Args:
        positions: (vertices, 3) float32.
        indices: (triangles, 3) uint32.
    """
    keys = _place_keys(positions)
    points = positions - positions.mean(axis=0, dtype=np.float64).astype(np.float32)
    unpaired, unbalanced = 0, 0
    volume, area, area_vector = 0.0, 0.0, np.zeros(3)
    for start in range(0, len(indices), _CHUNK):
        corners = np.ascontiguousarray(indices[start:start + _CHUNK].T)
        edges, turns = _edge_sums(*keys[corners])
        unpaired, unbalanced = unpaired ^ edges, (unbalanced + turns) % 2**64
        a, b, c = points[corners]
        normals = 0.5 * _cross(b - a, c - a)
        volume += np.einsum("ij,ij->", a, normals, dtype=np.float64) / 3.0
        area += np.sqrt(np.einsum("ij,ij->i", normals, normals)).sum(dtype=np.float64)
        area_vector += normals.sum(axis=0, dtype=np.float64)
    is_closed = unpaired == 0
    is_sheet = not is_closed and np.linalg.norm(area_vector) > _FLATNESS * area
    return Shell(is_closed, unbalanced == 0, float(volume), bool(is_sheet))


def _cross(a, b):
    """numpy's own is several times slower."""
    x, y, z = a.T
    u, v, w = b.T
    return np.stack((y * w - z * v, z * u - x * w, x * v - y * u), axis=1)


# ---------------------------------------------------------------- edges as random numbers
#
# Each place is a random number of 64 bits and each edge the product of its two. Those of a mesh in which every edge is met an
# even number of times cancel under exclusive or; those of edges met as often in one direction as in the other cancel in a signed
# sum. That anything else cancels is as likely as two equal random numbers.


def _place_keys(positions):
    """(vertices,) uint64, odd, the same for vertices at the same place."""
    bits = (positions + np.float32(0.0)).view(np.uint32).astype(np.uint64)  # -0 becomes 0
    keys = np.zeros(len(positions), dtype=np.uint64)
    for axis in range(3):
        keys = _mixed(keys ^ bits[:, axis])
    return keys | np.uint64(1)


def _mixed(x):
    """A bijection of 64-bit numbers that leaves no pattern (SplitMix64)."""
    x = x + np.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


def _edge_sums(a, b, c):
    """(exclusive or of all edges, signed sum modulo 2^64 of all directed edges) of triangles whose corners have these keys."""
    unpaired, unbalanced = 0, 0
    for start, end in ((a, b), (b, c), (c, a)):
        is_forward = start < end
        edges = start * end
        edges[start == end] = 0  # of a triangle without area
        unpaired ^= int(np.bitwise_xor.reduce(edges))
        unbalanced += 2 * int(edges[is_forward].sum(dtype=np.uint64)) - int(edges.sum(dtype=np.uint64))
    return unpaired, unbalanced
