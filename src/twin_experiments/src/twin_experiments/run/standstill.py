"""Whether both sides stand still, from their joint states as they arrive."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin_experiments.metrics.series import Array

NEW_MOVE_AFTER_S = 0.2  # our choice: motion after this much standstill is a new move


@dataclass(frozen=True)
class Activity:
    """What one side has done so far; times are on the receiver's monotonic clock [s].

    Args:
        newest: Newest sample, None before the first.
        last_moving: Newest sample in which a joint moved, or the first sample.
        moves: How many moves have begun.
    """

    newest: float | None = None
    last_moving: float = 0.0
    moves: int = 0


def observe(activity: Activity, now: float, velocities: Array, moving_speeds: Array) -> Activity:
    """Take one sample into account.

    Args:
        activity: Of this side, so far.
        now: When the sample arrived [s].
        velocities: Joint velocities, shape ``(n,)``: [rad/s], prismatic [m/s].
        moving_speeds: Speed from which a joint moves, same shape.
    """
    if activity.newest is None:
        activity = replace(activity, last_moving=now)
    if not (np.abs(velocities) >= moving_speeds).any():
        return replace(activity, newest=now)
    begins = now - activity.last_moving > NEW_MOVE_AFTER_S or not activity.moves
    return replace(activity, newest=now, last_moving=now, moves=activity.moves + begins)


def still_for(sides: list[Activity], now: float, fresh: float) -> float:
    """Return for how long all sides have stood still [s].

    0 if one has been silent for longer than ``fresh`` [s].
    """
    if any(side.newest is None or now - side.newest > fresh for side in sides):
        return 0.0
    return min(now - side.last_moving for side in sides)
