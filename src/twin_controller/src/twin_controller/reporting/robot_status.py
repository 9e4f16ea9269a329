"""The real robot in the words of industrial_msgs/RobotStatus: each answer is yes, no or unknown."""

from __future__ import annotations

from enum import IntEnum

from scara_ros.message_struct import struct_of

from industrial_msgs.msg import RobotStatus
from twin_controller.core.lead.modes import Mode
from twin_controller.core.orders.stream import AUTO
from twin_controller.core.setup import Setup
from twin_controller.core.sides import change
from twin_controller.core.state import CoreState


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


class StatusAnswers(struct_of(RobotStatus)):  # type: ignore[misc]
    """The fields of industrial_msgs/RobotStatus."""


def robot_status(
    setup: Setup, state: CoreState, pendant_enabled: bool | None, alarm_number: int, now: float
) -> StatusAnswers:
    """Say how the real robot is; everything is unknown while its link is down.

    Args:
        setup: Profile and numbers.
        state: What the controller knows.
        pendant_enabled: The teach pendant has the robot; None if that is not known. It counts for a
            robot that does not tell at what its mode switch stands.
        alarm_number: Number of the active alarm, from its register; 0 if there is none.
        now: Time [s].
    """
    real, lead = state.sides.real, state.lead
    flags = real.flags
    if flags is None or not real.history:
        return StatusAnswers()
    error = flags.fault or lead.mode is Mode.FAULT
    # An emergency stop that does not reach the robot is none of it.
    stopped = (lead.mode is Mode.ESTOP and setup.writes) or not flags.drives_on
    possible = flags.drives_on and not error and not stopped and not flags.paused
    still = change.stands_still(real.change, now, setup.config.change)
    manual = pendant_enabled
    if flags.operation_mode:
        manual = flags.operation_mode != AUTO
    modes = {None: RobotMode.UNKNOWN, True: RobotMode.MANUAL, False: RobotMode.AUTO}
    return StatusAnswers(
        mode=modes[manual],
        e_stopped=Tri(stopped),
        drives_powered=Tri(flags.drives_on),
        motion_possible=Tri(possible),
        in_motion=Tri(not still),
        in_error=Tri(error),
        error_code=alarm_number,
    )


def scaling_factor(state: CoreState) -> float:
    """Return the applied part of the requested program speed, 0 to 1; 1 if nothing is asked for."""
    if state.lead.mode is Mode.PAUSED:
        return 0.0
    speed = state.orders.speeds
    if not speed.requested or speed.applied is None:
        return 1.0
    return min(max(speed.applied / speed.requested, 0.0), 1.0)
