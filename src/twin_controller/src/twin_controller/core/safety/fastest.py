"""How fast the watched points can get, in one pose and in any."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scara_control.keep_out.points import FloatArray, WatchedPoint, positions
from scara_control.kinematics.screws import tool_position

from twin_controller.core.events import Joints

GRID = np.pi / 4.0
"""Spacing of the revolute joints' positions among which the fastest pose is sought [rad]."""
MOST_TRIALS = 9**5 * 2**5
"""Poses times directions of the joints' speeds: those of six joints that turn all round. One more
on the grid would take 18 times the time and the memory."""
SPREAD = np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0])
"""Multiples of these, without their whole parts, fill a cube of eight sides evenly (Richtmyer)."""
LARGEST_STRETCH = np.pi
FINEST = 1e-3
STEP = 1e-4


class Cap(NamedTuple):
    """The largest program speed [percent], and where that comes from."""

    percent: float
    reason: str


def fastest_speed(
    points: Sequence[WatchedPoint], lower: Joints, upper: Joints, velocity: Joints
) -> float:
    r"""Return the largest speed that a watched point can have in any pose [m/s].

    The speed :math:`|J(q) \dot q|` is convex in :math:`\dot q`, so it is largest where each joint
    is at plus or minus its largest speed. The pose is sought on a grid, and from the best one by
    steps that are halved.

    Args:
        points: What is watched.
        lower: Smallest joint positions, SI.
        upper: Largest joint positions, SI.
        velocity: Largest joint speeds, SI.
    """
    return max((_fastest_of(point, lower, upper, velocity) for point in points), default=0.0)


def _fastest_of(point: WatchedPoint, lower: Joints, upper: Joints, velocity: Joints) -> float:
    rows = _poses(point, lower, upper)
    speeds = _speeds(point, rows, velocity)
    best, speed, step = rows[int(np.argmax(speeds))], float(np.max(speeds)), 0.5 * GRID
    while step > FINEST:
        tries = np.array(
            [
                best + sign * step * np.eye(len(lower))[column]
                for column in point.columns
                for sign in (-1.0, 1.0)
            ]
        )
        tries = np.clip(tries, lower, upper)
        speeds = _speeds(point, tries, velocity)
        if float(np.max(speeds)) > speed:
            best, speed = tries[int(np.argmax(speeds))], float(np.max(speeds))
        else:
            step *= 0.5
    return speed


def _poses(point: WatchedPoint, lower: Joints, upper: Joints) -> FloatArray:
    """Return the poses among which the fastest is sought: a grid, of many joints spread evenly."""
    turns = np.any(point.model.screw_axes[:3] != 0.0, axis=0)
    ranges = []
    # The first joint turns all points alike, so its position does not matter.
    for column, turning in list(zip(point.columns, turns))[1:]:
        ends = np.array([lower[column], upper[column]])
        if turning:
            # Stretched (0) too; of a prismatic joint the ends are enough.
            low, high = np.clip(ends, -LARGEST_STRETCH, LARGEST_STRETCH)
            inner = np.arange(np.ceil(low / GRID), np.floor(high / GRID) + 1) * GRID
            ends = np.unique(np.concatenate([[low], inner, [high]]))
        ranges.append(ends)
    columns = list(point.columns[1:])
    most = MOST_TRIALS // 2 ** len(columns)
    if math.prod(map(len, ranges)) > most:
        low, high = np.array([(places[0], places[-1]) for places in ranges]).T
        rows = np.zeros((most, len(lower)))
        shares = np.outer(np.arange(most), SPREAD[: len(columns)]) % 1.0
        rows[:, columns] = low + shares * (high - low)
        return rows
    rows = np.zeros((1, len(lower)))
    for column, places in zip(columns, ranges):
        rows = np.repeat(rows, len(places), axis=0)
        rows[:, column] = np.resize(places, len(rows))
    return rows


def _speeds(point: WatchedPoint, rows: FloatArray, velocity: Joints) -> FloatArray:
    """Return the point's largest speed in each pose [m/s]."""
    columns = []
    for column in point.columns:
        offset = np.zeros(rows.shape[1])
        offset[column] = STEP
        columns.append(
            (positions(point, rows + offset) - positions(point, rows - offset))
            * (velocity[column] / (2.0 * STEP))
        )
    # The sign of all together does not matter: the first joint's is fixed.
    signs = np.array(
        [(1.0, *rest) for rest in itertools.product((-1.0, 1.0), repeat=len(columns) - 1)]
    )
    ways = np.einsum("sk,kmx->smx", signs, np.array(columns))
    return np.asarray(np.linalg.norm(ways, axis=2).max(axis=0))


def fastest_point(points: Sequence[WatchedPoint], q: Joints, qdot: Joints) -> tuple[float, str]:
    """Return the largest speed of a watched point [m/s] and which one it is.

    By a central difference over 1 ms.
    """
    before = [a - b * 5e-4 for a, b in zip(q, qdot)]
    after = [a + b * 5e-4 for a, b in zip(q, qdot)]
    if not all(map(math.isfinite, (*before, *after))):
        return math.nan, ""
    fastest = (0.0, "")
    for point in points:
        # In plain numbers: a quarter of the time of arrays of two rows, with each sample.
        one, other = (
            tool_position(point.model, [row[column] for column in point.columns])
            for row in (before, after)
        )
        fastest = max(fastest, (math.dist(one, other) / 1e-3, point.name))
    return fastest


def speed_cap(peak_speed: float, limit_mm_s: float | None) -> float:
    """Return the program speed that keeps the limit [percent]; 100 if there is no limit."""
    if limit_mm_s is None or peak_speed <= 0.0:
        return 100.0
    return min(100.0, 100.0 * limit_mm_s * 1e-3 / peak_speed)
