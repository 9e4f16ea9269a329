"""Where the SR-6iA's body is, and how far from a box: closed forms of our own.

Nothing of the core is used: lengths and heights are those of robot.yaml and of the URDF's shapes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

L1, L2, TOOL_Z, ELBOW_Z = 0.35, 0.30, 0.16, 0.23
CELL = 0.075
"""Longest piece of a beam, as in keep_out/body.py."""
Rows = npt.NDArray[np.float64]
Piece = tuple[float, float, tuple[float, float, float]]


def _disc(at: float, radius: float, low: float, high: float) -> list[Piece]:
    """Return where along its link a cylinder is, in which height, and its box in any pose."""
    return [(at, 0.5 * (low + high), (radius, radius, 0.5 * (high - low)))]


def _beam(begin: float, end: float, wide: float, low: float, high: float) -> list[Piece]:
    """Return likewise the pieces of a beam, half as ``wide``."""
    count = math.ceil((end - begin) / CELL - 1e-9)
    long = (end - begin) / count
    half = math.hypot(0.5 * long, wide)
    box = (half, half, 0.5 * (high - low))
    return [(begin + (k + 0.5) * long, 0.5 * (low + high), box) for k in range(count)]


ARM = (
    *_disc(0.0, 0.08, 0.12, 0.205),
    *_beam(0.0, 0.35, 0.06, 0.125, 0.2),
    *_disc(0.35, 0.066, 0.12, 0.205),
    *_disc(0.35, 0.056, 0.205, 0.225),
    *_disc(0.35, 0.05, 0.095, 0.12),
)
FOREARM = (
    *_disc(0.0, 0.066, 0.23, 0.33),
    *_beam(0.0, 0.3, 0.055, 0.24, 0.32),
    *_disc(0.3, 0.056, 0.23, 0.33),
    *_beam(0.055, 0.205, 0.045, 0.32, 0.41),
    *_disc(0.055, 0.045, 0.32, 0.41),
    *_disc(0.205, 0.045, 0.32, 0.41),
    *_disc(0.3, 0.034, 0.21, 0.23),
)
QUILL = (
    *_disc(0.0, 0.012, 0.186, 0.58),
    *_disc(0.0, 0.02, 0.55, 0.58),
    *_disc(0.0, 0.022, 0.174, 0.186),
    *_disc(0.0, 0.009, 0.16, 0.174),
)
"""The shapes with all joints at 0: rod, collar, flange, tool."""
HALF = np.array([(0.0, 0.0, 0.0)] * 2 + [box for *_, box in (*ARM, *FOREARM, *QUILL)])
"""Half edges of the box around each watched point."""


def watched(q: Rows) -> Rows:
    """Return tool, elbow and the pieces of both links and of the quill, shape (points, m, 3)."""
    one, both = q[:, 0], q[:, 0] + q[:, 1]
    along = np.stack([np.cos(one), np.sin(one)], axis=1)
    further = np.stack([np.cos(both), np.sin(both)], axis=1)
    level = np.ones((len(q), 1))
    tool = L1 * along + L2 * further
    found = [np.hstack([tool, TOOL_Z + q[:, 2:3]]), np.hstack([L1 * along, ELBOW_Z * level])]
    found += [np.hstack([length * along, z * level]) for length, z, _ in ARM]
    found += [np.hstack([L1 * along + length * further, z * level]) for length, z, _ in FOREARM]
    found += [np.hstack([tool, z + q[:, 2:3]]) for _, z, _ in QUILL]
    return np.array(found)


def clearance(points: Rows, lower: Sequence[float], upper: Sequence[float]) -> float:
    """Return by how much a box may grow on all sides until a part of the arm is in it [m].

    Less than 0 by how deep a part is inside. By faces, as the configured clearance counts: beside
    an edge a part is a little farther away than this.
    """
    low, high = np.array(lower) - HALF[:, None], np.array(upper) + HALF[:, None]
    outside = np.maximum(np.maximum(low - points, points - high), 0.0)
    distance = np.max(outside, axis=-1)
    depth = np.min(np.minimum(points - low, high - points), axis=-1)
    return float(np.min(np.where(depth > 0.0, -depth, distance)))


def straight(start: Sequence[float], end: Sequence[float], rows: int = 1500) -> Rows:
    """Return the straight joint-space way, shape (rows, n)."""
    part = np.linspace(0.0, 1.0, rows)[:, None]
    return np.array(start) + part * (np.array(end) - np.array(start))
