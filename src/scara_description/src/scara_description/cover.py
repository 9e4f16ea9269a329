"""Cover a mesh with boxes and cylinders that hold all of it.

The mesh is cut across its longest side into slabs; each slab gets the smaller of a box and a
cylinder. What lies between two points of a slab lies in its cover too, as both are convex: a cover
holds the body, not only its skin.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from scara_description.urdf import GREY, Shape, Vector, rpy_of

FloatArray = NDArray[np.float64]
COVER = "cover"
"""Name of a shape of a URDF that holds a mesh, and is not the body itself."""
MOST_SLABS = 6
"""More would hug a link no better, and each costs a look at every zone: our choice."""
THINNEST = 1e-3
"""Smallest edge of a cover [m]: a plate has to have a body. Our choice."""


def cover(triangles: FloatArray) -> list[Shape]:
    """Return boxes and cylinders that hold a mesh.

    Args:
        triangles: Corners in the link's frame [m], shape (n, 3, 3).
    """
    points = triangles.reshape(-1, 3)
    middle = points - points.mean(axis=0)
    # Along the link's frame, and along the directions in which the mesh is longest and thinnest.
    principal = np.linalg.svd(middle, full_matrices=False)[2].T
    # A mirrored frame has no roll, pitch and yaw.
    if np.linalg.det(principal) < 0.0:
        principal[:, 2] *= -1.0
    covers = [list(_covers(triangles, turn)) for turn in (np.eye(3), principal)]
    return min(covers, key=lambda shapes: sum(_volume(shape) for shape in shapes))


def _covers(triangles: FloatArray, turn: FloatArray) -> Iterator[Shape]:
    """Yield the covers of all slabs along the axes ``turn``, which are its columns."""
    turned = triangles @ turn
    low, high = turned.min(axis=(0, 1)), turned.max(axis=(0, 1))
    size = high - low
    along = int(np.argmax(size))
    across = max(float(np.delete(size, along).max()), THINNEST)
    count = min(MOST_SLABS, max(1, round(float(size[along]) / across * 2.0) - 1))
    edges = np.linspace(low[along], high[along], count + 1)
    for begin, end in itertools.pairwise(edges):
        slab = _within(turned, along, begin, end)
        if len(slab):
            yield _smallest(slab, turn)


def _within(triangles: FloatArray, along: int, begin: float, end: float) -> FloatArray:
    """Return the corners of what of the triangles lies between two planes, shape (m, 3)."""
    corners = triangles.reshape(-1, 3)
    found = [corners[(corners[:, along] >= begin) & (corners[:, along] <= end)]]
    one, other = corners, np.roll(triangles, -1, axis=1).reshape(-1, 3)
    rise = other[:, along] - one[:, along]
    for plane in (begin, end):
        # Where an edge goes through the plane, that point belongs to the slab, too.
        cuts = (one[:, along] - plane) * (other[:, along] - plane) < 0.0
        part = (plane - one[cuts, along]) / rise[cuts]
        found.append(one[cuts] + part[:, None] * (other[cuts] - one[cuts]))
    return np.concatenate(found)


def _smallest(points: FloatArray, turn: FloatArray) -> Shape:
    """Return the smallest box or upright cylinder of the frame ``turn`` that holds the points."""
    low, high = points.min(axis=0), points.max(axis=0)
    size, middle = np.maximum(high - low, THINNEST), 0.5 * (low + high)
    place = _vector(turn @ middle)
    best = Shape("box", _vector(size), place, rpy_of(turn), GREY)
    for axis in range(3):
        sides = [k for k in range(3) if k != axis]
        radius = float(np.linalg.norm(points[:, sides] - middle[sides], axis=1).max())
        # The cylinder's z along the axis: the frame's axes in another order.
        order = turn[:, [*sides, axis]]
        if np.linalg.det(order) < 0.0:
            order[:, 0] *= -1.0
        size_of = (max(radius, 0.5 * THINNEST), float(size[axis]))
        round_one = Shape("cylinder", size_of, place, rpy_of(order), GREY)
        best = min(best, round_one, key=_volume)
    return best


def _volume(shape: Shape) -> float:
    """Return the volume of a box or a cylinder [m^3]."""
    if shape.kind == "box":
        return math.prod(shape.size)
    radius, length = shape.size
    return math.pi * radius * radius * length


def _vector(values: FloatArray) -> Vector:
    x, y, z = values.tolist()
    return x, y, z
