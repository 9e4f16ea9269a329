"""How fast the watched points can get, and what is known of both sides' program speed."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import msgspec
import numpy as np

from twin_controller.core.events import Joints
from twin_controller.core.safety.points import FloatArray, WatchedPoint, positions

GRID = np.pi / 4.0
"""Spacing of the revolute joints' positions among which the fastest pose is sought [rad]."""
LARGEST_STRETCH = np.pi
FINEST = 1e-3
STEP = 1e-4


class SpeedState(msgspec.Struct, frozen=True):
    """Program speed, requested and applied [percent], and why it was limited.

    Attributes:
        cap: The operator's cap for both sides.
        gate: Why the last set point for the real robot was slowed down; empty if it was not.
        cap_sent: When the twin's cap was sent last [s]; ``cap_percent`` what was sent.
        override_before: The robot's override before we lowered it, None while it is its own.
        override_sent: The override we sent last.
        override_at: When [s].
    """

    cap: float = 100.0
    requested: float = 0.0
    applied: float = 0.0
    limited: bool = False
    reason: str = ""
    gate: str = ""
    cap_sent: float | None = None
    cap_percent: float = 100.0
    override_before: float | None = None
    override_sent: float = 0.0
    override_at: float = -1e9


def fastest_speed(points: Sequence[WatchedPoint], lower: Joints, upper: Joints, velocity: Joints) -> float:
    r"""Return the largest speed that a watched point can have in any pose [m/s].

    The speed :math:`|J(q) \dot q|` is convex in :math:`\dot q`, so it is largest where each joint is at plus or minus its
    largest speed. The pose is sought on a grid, and from the best one by steps that are halved.

    Args:
        points: What is watched.
        lower: Smallest joint positions, SI.
        upper: Largest joint positions, SI.
        velocity: Largest joint speeds, SI.
    """
    return max((_fastest_of(point, lower, upper, velocity) for point in points), default=0.0)


def _fastest_of(point: WatchedPoint, lower: Joints, upper: Joints, velocity: Joints) -> float:
    turns = np.any(point.model.screw_axes[:3] != 0.0, axis=0)
    ranges = [_places(lower[column], upper[column], turning) for column, turning in zip(point.columns, turns)]
    rows = np.zeros((1, len(lower)))
    for column, places in list(zip(point.columns, ranges))[1:]:
        rows = np.repeat(rows, len(places), axis=0)
        rows[:, column] = np.resize(places, len(rows))
    speeds = _speeds(point, rows, velocity)
    best, speed, step = rows[int(np.argmax(speeds))], float(np.max(speeds)), 0.5 * GRID
    while step > FINEST:
        tries = np.array([best + sign * step * np.eye(len(lower))[column] for column in point.columns for sign in (-1.0, 1.0)])
        tries = np.clip(tries, lower, upper)
        speeds = _speeds(point, tries, velocity)
        if float(np.max(speeds)) > speed:
            best, speed = tries[int(np.argmax(speeds))], float(np.max(speeds))
        else:
            step *= 0.5
    return speed


def _places(lower: float, upper: float, turning: bool) -> FloatArray:
    """Return the positions of one joint that are tried, stretched (0) among them; both ends of a prismatic one."""
    if not turning:
        return np.array([lower, upper])
    low, high = max(lower, -LARGEST_STRETCH), min(upper, LARGEST_STRETCH)
    inner = np.arange(np.ceil(low / GRID), np.floor(high / GRID) + 1) * GRID
    return np.unique(np.concatenate([[low], inner, [high]]))


def _speeds(point: WatchedPoint, rows: FloatArray, velocity: Joints) -> FloatArray:
    """Return the point's largest speed in each pose [m/s]."""
    columns = []
    for column in point.columns:
        offset = np.zeros(rows.shape[1])
        offset[column] = STEP
        columns.append((positions(point, rows + offset) - positions(point, rows - offset)) * (velocity[column] / (2.0 * STEP)))
    signs = np.array([(1.0, *rest) for rest in itertools.product((-1.0, 1.0), repeat=len(columns) - 1)])
    ways = np.einsum("sk,kmx->smx", signs, np.array(columns))
    return np.asarray(np.linalg.norm(ways, axis=2).max(axis=0))
