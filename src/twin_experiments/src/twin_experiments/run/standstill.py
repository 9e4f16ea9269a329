"""Whether both sides stand still, from their joint states as they arrive."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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


def observe(
    activity: Activity, now: float, velocities: Sequence[float], moving_speeds: Sequence[float]
) -> Activity:
    """Take one sample into account.

    Args:
        activity: Of this side, so far.
        now: When the sample arrived [s].
        velocities: Of each joint: [rad/s], prismatic [m/s].
        moving_speeds: Speed from which each of them moves.
    """
    last, moves = activity.last_moving, activity.moves
    if activity.newest is None:
        last = now
    if any([abs(v) >= least for v, least in zip(velocities, moving_speeds)]):
        # The first motion is a move, however soon after the first sample it comes.
        begins = now - last > NEW_MOVE_AFTER_S or not moves
        last, moves = now, moves + begins
    return Activity(now, last, moves)


def still_for(sides: list[Activity], now: float, fresh: float) -> float:
    """Return for how long all sides have stood still [s].

    0 if one has been silent for longer than ``fresh`` [s].
    """
    if any(side.newest is None or now - side.newest > fresh for side in sides):
        return 0.0
    return min(now - side.last_moving for side in sides)
