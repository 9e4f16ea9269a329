"""The real robot in the words of industrial_msgs/RobotStatus: each answer is yes, no or unknown."""

from __future__ import annotations

import re
from enum import IntEnum

import msgspec

from twin_controller.core.observing import change
from twin_controller.core.rules.table import Mode
from twin_controller.core.state import CoreState, Setup

_ALARM_NUMBER = re.compile(r"\b[A-Z]{2,}-(\d+)\b")


class Tri(IntEnum):
    """The constants of industrial_msgs/TriState."""

    UNKNOWN = -1
    FALSE = 0
    TRUE = 1


class RobotMode(IntEnum):
    """The constants of industrial_msgs/RobotMode."""

    UNKNOWN = -1
    MANUAL = 1
    AUTO = 2


class RobotStatus(msgspec.Struct, frozen=True):
    """The fields of industrial_msgs/RobotStatus."""

    mode: RobotMode = RobotMode.UNKNOWN
    e_stopped: Tri = Tri.UNKNOWN
    drives_powered: Tri = Tri.UNKNOWN
    motion_possible: Tri = Tri.UNKNOWN
    in_motion: Tri = Tri.UNKNOWN
    in_error: Tri = Tri.UNKNOWN
    error_code: int = 0


def robot_status(setup: Setup, state: CoreState, pendant_enabled: bool | None, now: float) -> RobotStatus:
    """Say how the real robot is; everything is unknown while its link is down.

    Args:
        setup: Profile and numbers.
        state: What the controller knows.
        pendant_enabled: The teach pendant has the robot; None if that is not known.
        now: Time [s].
    """
    flags = state.flags
    if flags is None or not state.real.history:
        return RobotStatus()
    error = flags.fault or state.mode is Mode.FAULT
    stopped = state.mode is Mode.ESTOP or not flags.drives_on
    possible = flags.drives_on and not error and not stopped and not flags.paused
    still = change.stands_still(state.real.change, now, setup.config.change)
    mode = RobotMode.UNKNOWN if pendant_enabled is None else RobotMode.MANUAL if pendant_enabled else RobotMode.AUTO
    return RobotStatus(
        mode=mode,
        e_stopped=Tri(stopped),
        drives_powered=Tri(flags.drives_on),
        motion_possible=Tri(possible),
        in_motion=Tri(not still),
        in_error=Tri(error),
        error_code=alarm_number(state.alarm),
    )


def scaling_factor(state: CoreState) -> float:
    """Return the part of the requested program speed that is applied, 0 to 1; 1 while nothing is asked for."""
    if state.mode is Mode.PAUSED:
        return 0.0
    speed = state.speed
    return min(max(speed.applied / speed.requested, 0.0), 1.0) if speed.requested > 0.0 else 1.0


def alarm_number(text: str) -> int:
    """Return the number of an alarm.

    Args:
        text: As the robot shows it; empty if there is none.

    Example:
        >>> alarm_number("SERVO SRVO-001 Operator panel E-stop")
        1
    """
    found = _ALARM_NUMBER.search(text)
    return int(found[1]) if found else 0
