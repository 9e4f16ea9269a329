"""The same measures of a course, whether it was predicted or measured."""

from __future__ import annotations

import math

import numpy as np

from what_if.geometry.bodies import FloatArray

NEAR = 2e-3
"""Nearer than this to a position [rad] or [m] the joints count as there; our choice: four times
what a robot's noise of 0.01 deg makes, and passed within some hundredths of a second."""
STRIDE_M = 2e-3
"""A way is measured in strides of this length, so that noise at rest adds nothing; our choice."""


def away(q: FloatArray, place: FloatArray) -> FloatArray:
    """Return which joint positions, shape (m, n), are not at a place, shape (n,)."""
    found: FloatArray = np.max(np.abs(q - place), axis=1) > NEAR
    return found


def moving_time(times: FloatArray, q: FloatArray, target: FloatArray) -> float:
    """Return from when the start is left until the target is reached for good [s]; 0: no motion.

    Both ends are where the joints pass :data:`NEAR`, so a prediction and what happened leave out
    the same.

    Args:
        times: [s], shape (m,).
        q: Joint positions, shape (m, n), SI.
        target: Where they end, shape (n,).
    """
    left, short = np.flatnonzero(away(q, q[0])), np.flatnonzero(away(q, target))
    if not left.size or not short.size:
        return 0.0
    # The first row that is away has one before it: the start itself is never away from itself.
    begin = _passed(times, q, q[0], int(left[0]) - 1)
    return max(_passed(times, q, target, int(short[-1])) - begin, 0.0)


def _passed(times: FloatArray, q: FloatArray, place: FloatArray, row: int) -> float:
    """Return when the joints pass :data:`NEAR` of a place between a row and the next [s]."""
    two = slice(row, row + 2)
    one, *other = np.max(np.abs(q[two] - place), axis=1).tolist()
    if not other:  # The last row has no next one.
        return float(times[row])
    # One of the two is farther away than that, and the other one is not.
    share = (NEAR - one) / (other[0] - one)
    return float(times[row] + share * (times[row + 1] - times[row]))


def longest_stand(times: FloatArray, q: FloatArray) -> float:
    """Return the longest time during which the joints stay at one place [s]."""
    longest, begin = 0.0, 0
    for row in range(1, len(times)):
        if np.max(np.abs(q[row] - q[begin])) > NEAR:
            begin = row
        longest = max(longest, float(times[row] - times[begin]))
    return longest


def way_length(points: FloatArray) -> float:
    """Return the length of a way of points, shape (m, 3), in strides of :data:`STRIDE_M` [m]."""
    length, here = 0.0, points[0].tolist()
    for point in points.tolist():
        step = math.dist(point, here)
        if step >= STRIDE_M:
            length, here = length + step, point
    return length
