"""The closed-form SCARA for many points at once, in numpy.

Formulas and names as in :mod:`scara_control.kinematics.scara`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scara_control.errors import JointVectorError
from scara_control.kinematics.scara import REACH_TOLERANCE, Elbow, Scara
from scara_control.kinematics.twists import FloatArray
from scara_control.limits import LIMIT_TOLERANCE

_BLOCK = 16384
"""Targets at a time: eight rows of numbers then fill a cache of 1 MB. Our choice: the fastest of
1024 to 32768."""


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

    The targets are taken in blocks that stay in the processor's cache, where numpy's vectorised arc
    tangent and root cost no more than reading a number from memory does.

    Args:
        scara: Lengths and limits.
        targets: Tool positions in the base frame, shape ``(m, 3)`` [m].
        elbow: Branch of all of them.

    Returns:
        Solutions; a target that :func:`scara_control.kinematics.scara.solve_elbow` refuses is not
        ``reachable``.

    Raises:
        JointVectorError: ``targets`` is not of shape ``(m, 3)``.
    """
    columns = _columns(targets, "target matrix")
    count = len(columns[0])
    answer = Solutions(np.empty((count, 3)), np.empty(count, dtype=np.bool_))
    room, masks = np.empty((8, min(count, _BLOCK))), np.empty(min(count, _BLOCK), dtype=np.bool_)
    with np.errstate(invalid="ignore", over="ignore"):  # an infinite target ends as not reachable
        for first in range(0, count, _BLOCK):
            part = slice(first, min(first + _BLOCK, count))
            size = part.stop - first
            for values, row in zip(columns, room):
                row[:size] = values[part]
            _solve_block(
                scara,
                elbow,
                room[:, :size],
                masks[:size],
                Solutions(answer.q[part], answer.reachable[part]),
            )
    return answer


def _solve_block(
    scara: Scara, elbow: Elbow, room: FloatArray, mask: NDArray[np.bool_], answer: Solutions
) -> None:
    """Solve targets of which all numbers stay in the processor's cache.

    Each line writes into rows that are there.

    Args:
        scara: Lengths and limits.
        elbow: Branch.
        room: Rows x, y, z of the targets, and five more; all are overwritten, shape ``(8, k)``.
        mask: Overwritten, shape ``(k,)``.
        answer: Where the answer goes.
    """
    x, y, z, r, a, b, s, t = room
    l1, l2 = scara.l1, scara.l2
    outer, inner = l1 + l2, abs(l1 - l2)
    np.sqrt(np.add(np.multiply(x, x, out=r), np.multiply(y, y, out=s), out=r), out=r)
    np.greater_equal(r, inner - REACH_TOLERANCE, out=answer.reachable)
    answer.reachable[:] &= np.less_equal(r, outer + REACH_TOLERANCE, out=mask)
    _root_of_product(np.subtract(outer, r, out=a), np.add(outer, r, out=s))
    _root_of_product(np.subtract(r, inner, out=b), np.add(r, inner, out=s))
    if elbow is Elbow.LEFTY:
        np.negative(a, out=a)
    along, across = (
        np.add(np.multiply(r, r, out=r), l1 * l1 - l2 * l2, out=r),
        np.multiply(a, b, out=s),
    )
    q2 = np.multiply(np.arctan2(a, b, out=a), 2.0, out=a)
    rising = np.subtract(np.multiply(y, along, out=b), np.multiply(x, across, out=t), out=b)
    running = np.add(np.multiply(x, along, out=x), np.multiply(y, across, out=y), out=x)
    q1 = np.arctan2(rising, running, out=b)
    _wrap(q1, *scara.limits[0])
    q3 = np.subtract(z, scara.h, out=z)
    for joint, values in enumerate((q1, q2, q3)):
        low, high = scara.limits[joint]
        answer.reachable[:] &= np.greater_equal(values, low - LIMIT_TOLERANCE, out=mask)
        answer.reachable[:] &= np.less_equal(values, high + LIMIT_TOLERANCE, out=mask)
        answer.q[:, joint] = np.minimum(np.maximum(values, low, out=values), high, out=values)
    if not answer.reachable.all():
        answer.q[~answer.reachable] = math.nan


def _root_of_product(factor: FloatArray, other: FloatArray) -> None:
    """Write the square root of ``factor * other`` into ``factor``.

    Where the product is negative it is 0.
    """
    np.sqrt(np.maximum(np.multiply(factor, other, out=factor), 0.0, out=factor), out=factor)


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
