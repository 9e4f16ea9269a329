"""The closed-form SCARA for many points at once, in numpy; formulas and names as in :mod:`scara_control.kinematics.scara`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scara_control.errors import JointVectorError
from scara_control.kinematics.scara import REACH_TOLERANCE, Elbow, Scara
from scara_control.kinematics.twists import FloatArray
from scara_control.limits import LIMIT_TOLERANCE


class Solutions(NamedTuple):
    """Joint positions of many targets.

    Attributes:
        q: joint_1 [rad], joint_2 [rad], joint_3 [m], shape ``(m, 3)``; NaN where not ``reachable``.
        reachable: Whether the target is within reach and limits, shape ``(m,)``.
    """

    q: FloatArray
    reachable: NDArray[np.bool_]


def tool_positions_batch(scara: Scara, q: ArrayLike) -> FloatArray:
    """Compute where the tool's origin is.

    Args:
        scara: Lengths.
        q: Joint positions, shape ``(m, 3)``: [rad], [rad], [m].

    Returns:
        Positions in the base frame, shape ``(m, 3)`` [m]. NaN gives NaN.

    Raises:
        JointVectorError: ``q`` is not of shape ``(m, 3)``.
    """
    q1, q2, q3 = _columns(q, "joint matrix")
    q12 = q1 + q2
    positions = np.empty((len(q1), 3))
    positions[:, 0] = scara.l1 * np.cos(q1) + scara.l2 * np.cos(q12)
    positions[:, 1] = scara.l1 * np.sin(q1) + scara.l2 * np.sin(q12)
    positions[:, 2] = scara.h + q3
    return positions


def solve_batch(scara: Scara, targets: ArrayLike, elbow: Elbow = Elbow.RIGHTY) -> Solutions:
    """Compute the joint positions of many tool positions on one branch.

    Args:
        scara: Lengths and limits.
        targets: Tool positions in the base frame, shape ``(m, 3)`` [m].
        elbow: Branch of all of them.

    Returns:
        Solutions; a target that :func:`scara_control.kinematics.scara.solve_elbow` refuses is not ``reachable``.

    Raises:
        JointVectorError: ``targets`` is not of shape ``(m, 3)``.
    """
    x, y, z = _columns(targets, "target matrix")
    l1, l2 = scara.l1, scara.l2
    outer, inner = l1 + l2, abs(l1 - l2)
    q = np.empty((len(x), 3))
    with np.errstate(invalid="ignore", over="ignore"):  # an infinite target ends as not reachable
        r = np.sqrt(x * x + y * y)
        a = np.sqrt(np.maximum((outer - r) * (outer + r), 0.0))
        b = np.sqrt(np.maximum((r - inner) * (r + inner), 0.0))
        if elbow is Elbow.LEFTY:
            a = -a
        along, across = r * r + (l1 * l1 - l2 * l2), a * b
        q[:, 0] = np.arctan2(y * along - x * across, x * along + y * across)
        q[:, 1] = 2.0 * np.arctan2(a, b)
        q[:, 2] = z - scara.h
    reachable = (r >= inner - REACH_TOLERANCE) & (r <= outer + REACH_TOLERANCE)
    low, high = np.array(scara.limits[0::2]), np.array(scara.limits[1::2])
    _wrap(q[:, 0], low[0], high[0])
    reachable &= ((q >= low - LIMIT_TOLERANCE) & (q <= high + LIMIT_TOLERANCE)).all(axis=1)
    np.clip(q, low, high, out=q)
    q[~reachable] = math.nan
    return Solutions(q, reachable)


def _wrap(q1: FloatArray, low: float, high: float) -> None:
    """Turn joint_1 in place by a full turn where only that brings it within its limits."""
    if low <= -math.pi or high >= math.pi:
        q1[(q1 < low) & (q1 + 2.0 * math.pi <= high)] += 2.0 * math.pi
        q1[(q1 > high) & (q1 - 2.0 * math.pi >= low)] -= 2.0 * math.pi


def _columns(values: ArrayLike, what: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the three columns of ``values`` or raise JointVectorError."""
    matrix = np.asarray(values, dtype=float)
    if matrix.ndim != 2 or matrix.shape[1] != 3:
        raise JointVectorError(f"{what} has shape {matrix.shape}, expected (m, 3)")
    return matrix[:, 0], matrix[:, 1], matrix[:, 2]
