"""What the farm is shown of a cell, and how bad that is; pure."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from msgspec.structs import replace

from farm.wire import CellState, Level
from scara_msgs.msg import TwinControllerState

LEVELS = {
    TwinControllerState.OFFLINE: Level.WARN,
    TwinControllerState.ALIGNING: Level.NOTE,
    TwinControllerState.PAUSED: Level.WARN,
    TwinControllerState.STOPPED: Level.WARN,
    TwinControllerState.STANDSTILL: Level.WARN,
    TwinControllerState.ESTOP: Level.BAD,
    TwinControllerState.FAULT: Level.BAD,
}
"""Of each mode; those that are not named are good."""
BASED_ON = ("mode", "leader", "why", "alarm", "holder")
"""What a person looks at before a command; named in CellState as in the message."""


@dataclass(frozen=True)
class ShownState:
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


def told_by(message: Any) -> CellState:
    """Return the state that a scara_msgs/TwinControllerState tells; nothing has counted it yet."""
    apart, speed = message.deviation_mm, message.speed_applied_percent
    level = LEVELS.get(message.mode, Level.GOOD)
    if message.diverged:
        level = Level.BAD
    elif message.alarm:
        level = max(level, Level.WARN)
    return CellState(
        sequence=0,
        stamp=message.header.stamp.to_sec(),
        revision=0,
        level=level,
        speed_percent=speed if math.isfinite(speed) else None,
        deviation_mm=apart if math.isfinite(apart) else None,
        **{name: getattr(message, name) for name in BASED_ON},
    )


def show(shown: ShownState, state: CellState, remote: bool) -> tuple[ShownState, CellState]:
    """Return the state to send, with its numbers.

    The revision grows when something has changed that a person looks at before a command.

    Args:
        shown: What was sent last.
        state: What the twin controller says.
        remote: Whether the local switch lets the farm move this cell.
    """
    based_on = tuple(getattr(state, name) for name in BASED_ON)
    revision = shown.revision + (based_on != shown.based_on)
    shown = ShownState(revision, shown.sequence + 1, based_on)
    return shown, replace(state, sequence=shown.sequence, revision=revision, remote=remote)


def silent(
    shown: ShownState, since: float, now: float, remote: bool
) -> tuple[ShownState, CellState]:
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
    state = CellState(0, now, 0, Level.BAD, "", alarm="the twin controller is silent")
    shown, state = show(shown, state, remote)
    # Put in afterwards: the seconds are no change of the state.
    return shown, replace(state, why=why)
