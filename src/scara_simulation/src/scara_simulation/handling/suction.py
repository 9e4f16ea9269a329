"""The suction gripper as a state machine.

It takes time until there is vacuum, and until it is gone.
"""

from __future__ import annotations

from enum import Enum, auto

import msgspec


class NozzleChange(Enum):
    """What happens to the part at the nozzle."""

    NOTHING = auto()
    GRIP = auto()
    RELEASE = auto()


class Suction(msgspec.Struct, frozen=True):
    """State of the gripper.

    Attributes:
        commanded: The suction is on.
        held: Name of the part that hangs at the nozzle; empty: none.
        closed: How long a part has closed the nozzle with the suction on, or the suction has been
            off while holding [s].
    """

    commanded: bool = False
    held: str = ""
    closed: float = 0.0


def advance(
    state: Suction, candidate: str, dt: float, vacuum_s: float, release_s: float
) -> tuple[Suction, NozzleChange]:
    """Go on for one step.

    Args:
        state: The state before.
        candidate: Name of the part that is near enough below the nozzle; empty: none.
        dt: Step [s].
        vacuum_s: From closing the nozzle until the part is held [s].
        release_s: From switching off until the part is let go [s].

    Returns:
        The state after, and what happens to the part. Only the command off lets a part go; a part
        that is torn off is taken away by :func:`lose`.
    """
    if state.held:
        if state.commanded:
            return (
                msgspec.structs.replace(state, closed=0.0) if state.closed else state
            ), NozzleChange.NOTHING
        if state.closed + dt < release_s:
            return msgspec.structs.replace(state, closed=state.closed + dt), NozzleChange.NOTHING
        return Suction(), NozzleChange.RELEASE
    if not state.commanded or not candidate:
        return (
            msgspec.structs.replace(state, closed=0.0) if state.closed else state
        ), NozzleChange.NOTHING
    if state.closed + dt < vacuum_s:
        return msgspec.structs.replace(state, closed=state.closed + dt), NozzleChange.NOTHING
    return Suction(True, candidate), NozzleChange.GRIP


def command(state: Suction, on: bool) -> Suction:
    """Switch the suction on or off."""
    return msgspec.structs.replace(state, commanded=on, closed=0.0)


def lose(state: Suction) -> Suction:
    """Take the part away: it was torn off; the suction stays as it was commanded."""
    return Suction(state.commanded)
