"""Where the watched points of the SR-6iA are, and how far from a box: closed forms of our own.

Nothing of the core is used: lengths and heights are those of robot.yaml.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

L1, L2, TOOL_Z, LINK_Z = 0.35, 0.30, 0.16, 0.30
ON_ARM = (0.35, 0.28, 0.21, 0.14)
ON_FOREARM = (0.075, 0.15, 0.225)
Rows = npt.NDArray[np.float64]


def watched(q: Rows) -> Rows:
    """Return tool, elbow and the points of both links [m], shape (points, m, 3)."""
    one, both = q[:, 0], q[:, 0] + q[:, 1]
    along = np.stack([np.cos(one), np.sin(one)], axis=1)
    further = np.stack([np.cos(both), np.sin(both)], axis=1)
    height = np.full((len(q), 1), LINK_Z)
    found = [np.hstack([L1 * along + L2 * further, TOOL_Z + q[:, 2:3]])]
    found += [np.hstack([length * along, height]) for length in ON_ARM]
    found += [np.hstack([L1 * along + length * further, height]) for length in ON_FOREARM]
    return np.array(found)


def clearance(points: Rows, lower: Sequence[float], upper: Sequence[float]) -> float:
    """Return by how much a box may grow on all sides until a point is in it [m].

    Less than 0 by how deep a point is inside. By faces, as the configured clearance counts: beside
    an edge a point is a little farther away than this.
    """
    outside = np.maximum(np.maximum(np.array(lower) - points, points - np.array(upper)), 0.0)
    distance = np.max(outside, axis=-1)
    depth = np.min(np.minimum(points - np.array(lower), np.array(upper) - points), axis=-1)
    return float(np.min(np.where(depth > 0.0, -depth, distance)))


def straight(start: Sequence[float], end: Sequence[float], rows: int = 1500) -> Rows:
    """Return the straight joint-space way, shape (rows, n)."""
    part = np.linspace(0.0, 1.0, rows)[:, None]
    return np.array(start) + part * (np.array(end) - np.array(start))
