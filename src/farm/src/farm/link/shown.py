"""What the farm is shown of a cell, and how bad that is; pure."""

from __future__ import annotations

from dataclasses import dataclass, replace

import msgspec

from farm.wire import CellState, Level
from scara_msgs.msg import TwinControllerState

LEVELS = {
    TwinControllerState.OFFLINE: Level.WARN,
    TwinControllerState.ALIGNING: Level.NOTE,
    TwinControllerState.PAUSED: Level.WARN,
    TwinControllerState.STOPPED: Level.WARN,
    TwinControllerState.ESTOP: Level.BAD,
    TwinControllerState.FAULT: Level.BAD,
}
"""Of each mode; those that are not named are good."""


@dataclass(frozen=True)
class Pair:
    """What the twin controller says of both sides; see scara_msgs/TwinControllerState.

    Attributes:
        stamp: When it was true [s since 1970].
    """

    stamp: float
    mode: str
    leader: str = ""
    why: str = ""
    alarm: str = ""
    holder: str = ""
    speed_percent: float = 0.0
    deviation_mm: float | None = None
    diverged: bool = False


@dataclass(frozen=True)
class Shown:
    """What was sent last.

    Attributes:
        revision: Of the state. It begins with the time at which the link started, so that no
            command of an earlier link fits.
        sequence: So many states were made.
        based_on: What a command could be based on.
    """

    revision: int
    sequence: int = 0
    based_on: tuple[str, ...] = ()


def level_of(pair: Pair) -> Level:
    """Return how bad a state is: by its mode, an alarm, and whether the pair came apart."""
    level = LEVELS.get(pair.mode, Level.GOOD)
    if pair.diverged:
        return Level.BAD
    return max(level, Level.WARN) if pair.alarm else level


def show(shown: Shown, pair: Pair, remote: bool) -> tuple[Shown, CellState]:
    """Return the state to send.

    The revision grows when something has changed that a person looks at before a command: mode,
    leader, reason, alarm, holder.

    Args:
        shown: What was sent last.
        pair: What the twin controller says.
        remote: Whether the local switch lets the farm move this cell.
    """
    based_on = (pair.mode, pair.leader, pair.why, pair.alarm, pair.holder)
    changed = based_on != shown.based_on
    shown = replace(
        shown,
        revision=shown.revision + changed,
        sequence=shown.sequence + 1,
        based_on=based_on,
    )
    state = CellState(
        sequence=shown.sequence,
        stamp=pair.stamp,
        revision=shown.revision,
        level=level_of(pair),
        mode=pair.mode,
        leader=pair.leader,
        why=pair.why,
        alarm=pair.alarm,
        holder=pair.holder,
        speed_percent=pair.speed_percent,
        deviation_mm=pair.deviation_mm,
        remote=remote,
    )
    return shown, state


def silent(shown: Shown, since: float, now: float, remote: bool) -> tuple[Shown, CellState]:
    """Return the state to send while the twin controller says nothing.

    Args:
        shown: What was sent last.
        since: When it was heard last [s since 1970]; 0: never.
        now: Time [s since 1970].
        remote: As for :func:`show`.
    """
    why = "the twin controller was not heard yet"
    if since:
        why = f"the twin controller has been silent for {now - since:.0f} s"
    shown, state = show(shown, Pair(now, "", alarm="the twin controller is silent"), remote)
    # Put in afterwards: the seconds are no change of the state.
    return shown, msgspec.structs.replace(state, level=Level.BAD, why=why)
