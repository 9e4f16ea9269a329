"""What the robot says about itself, as typed values."""

from __future__ import annotations

from enum import IntEnum

import msgspec
from scara_control.joint_motion import JointMotion

_WARNS = ("", "NONE", "WARN")
"""Severities that stop nothing."""
CLOCK_WRAP_MS = 2**31
"""Where the robot's clock begins again at 0."""
_DRIVES_OFF = ("SERVO", "SYSTEM")
"""Severities that switch the drives off."""


class SampleError(ValueError):
    """An answer of the robot is not to be believed; the text says which value and why."""


class SetpointError(ValueError):
    """A set point cannot be put into the registers."""


class ControlType(IntEnum):
    """What moves the robot."""

    NONE = 0
    PROGRAM = 1
    STREAM = 2


class WatchdogState(IntEnum):
    """State of the robot's own heartbeat watchdog."""

    DISARMED = 0
    ARMED = 1
    EXPIRED = 2


class ProgramState(IntEnum):
    """State of the robot's program."""

    ABORTED = 0
    PAUSED = 1
    RUNNING = 2


class RobotSample(msgspec.Struct, frozen=True):
    """One checked reading of the robot; None: it does not tell.

    Attributes:
        motion: Of all joints in the order of robot.yaml; its time is the robot's own clock [s].
            Without velocities where the robot gives none.
        clock_ms: That clock, as it was read.
        program_speed: Programmed speed of the running motion [percent].
        override: Override in force [percent].
        outputs: Names of the UO signals that are on.
        plain_clock: The stamp is the clock when the robot answered, not when the reading was true.
        ring_places: How many set points the robot takes ahead of their time; 0: none.
        ring_read: Number of the one that it took last, 1..32760; 0 before the first.
        ring_underruns: So often it had none left.
        operation_mode: At what its mode switch stands: AUTO, T1 or T2; empty: it does not tell.
        pendant_enabled: The teach pendant has the robot, by TPENBL.
        efforts: Of all joints in the order of robot.yaml [N m or N]; empty: it does not tell.
        axes: Of the controller, as read [deg or mm], 0 where one is not finite; also those that
            robot.yaml does not name.
    """

    motion: JointMotion
    clock_ms: int
    control_type: ControlType
    program_speed: int | None
    override: int
    heartbeat_echo: int | None
    watchdog_state: WatchdogState | None
    outputs: frozenset[str]
    plain_clock: bool = False
    ring_places: int = 0
    ring_read: int = 0
    ring_underruns: int = 0
    operation_mode: str = ""
    pendant_enabled: bool | None = None
    efforts: tuple[float, ...] = ()
    axes: tuple[float, ...] = ()

    @property
    def speed_percent(self) -> float | None:
        """Override times programmed speed [percent]."""
        return None if self.program_speed is None else self.override * self.program_speed * 1e-2

    @property
    def moved_by(self) -> ControlType:
        """Whose program runs or is paused, by registers and signals together.

        They are read one after the other: a program that ends between them still stands in the
        registers, while its signals are gone. That is an end, not a pause that is over.
        """
        return self.control_type if self.outputs & {"progrun", "paused"} else ControlType.NONE


NUMBERS = ("ring_read", "ring_underruns")
"""Of a sample: whole numbers in a register of that name; 0 where a robot's map has none."""


class ProgramStatus(msgspec.Struct, frozen=True):
    """The running or last program."""

    name: str
    line: int
    state: ProgramState


class AlarmStatus(msgspec.Struct, frozen=True):
    """The active alarm; all empty when there is none."""

    facility: int
    number: int
    severity: str
    message: str
    cause: str

    @property
    def text(self) -> str:
        """One line for the operator, empty when there is no alarm."""
        return f"{self.message} ({self.cause}, {self.severity})" if self.facility else ""


def told_outputs(program: ProgramStatus, alarm: AlarmStatus) -> frozenset[str]:
    """Return the outputs that are on, as the blocks of program and alarm tell them.

    SYSRDY is on unless an alarm has switched the drives off: no register tells it.

    Args:
        program: The running or last program.
        alarm: The active alarm.

    Source:
        Our choice, by the severities of the maker's manual: docs/sources.md.
    """
    # Where no text tells how severe an alarm is, it counts as one that stops the robot.
    severity = (alarm.severity or "STOP") if alarm.facility else ""
    told = {
        "sysrdy": severity not in _DRIVES_OFF,
        "progrun": program.state is ProgramState.RUNNING,
        "paused": program.state is ProgramState.PAUSED,
        "fault": severity not in _WARNS,
    }
    return frozenset(name for name, on in told.items() if on)
