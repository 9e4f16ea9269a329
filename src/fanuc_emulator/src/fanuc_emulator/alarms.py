"""Alarms of the robot controller.

They say what can be raised, how severe it is, and which one the alarm registers show.
"""

from __future__ import annotations

import math
from collections.abc import Container, Iterable, Sequence
from datetime import datetime, timezone
from enum import IntEnum

import msgspec
from scara_config import Joint


class Severity(IntEnum):
    """Alarm severities of the real controller, in the order of the register ``alarm_severity``."""

    NONE = 0
    WARN = 1
    PAUSE = 2
    STOP = 3
    SERVO = 4
    ABORT = 5
    SYSTEM = 6


FACILITIES = {3: "PROG", 11: "SRVO", 12: "INTP", 15: "MOTN", 16: "VARS", 24: "SYST"}


class AlarmCode(msgspec.Struct, frozen=True):
    """One kind of alarm.

    Source:
        Facilities and severities: the real controller's; numbers of our own alarms: our choice.
    """

    facility: int
    number: int
    severity: Severity
    message: str

    @property
    def text(self) -> str:
        """How the pendant shows it."""
        return f"{FACILITIES[self.facility]}-{self.number:03d} {self.message}"


class RefusedError(ValueError):
    """The robot cannot go there; ``code`` is the alarm, the text says why."""

    def __init__(self, code: AlarmCode, text: str) -> None:
        super().__init__(text)
        self.code = code


class Alarm(msgspec.Struct, frozen=True):
    """An alarm that was raised; ``seconds`` is UTC since 1970."""

    code: AlarmCode
    cause: str
    seconds: float

    @property
    def date(self) -> tuple[int, int, int, int, int, int]:
        """Year, month, day, hour, minute, second in UTC."""
        at = datetime.fromtimestamp(self.seconds, timezone.utc)
        return (at.year, at.month, at.day, at.hour, at.minute, at.second)


PROGRAM_LOCKED = AlarmCode(3, 40, Severity.STOP, "Already locked by other task")
PANEL_ESTOP = AlarmCode(11, 1, Severity.SERVO, "Operator panel E-stop")
IMSTP = AlarmCode(11, 37, Severity.SERVO, "IMSTP input")
PR_LOCKED = AlarmCode(12, 128, Severity.STOP, "Pos reg is locked")
USER_ALARM = AlarmCode(12, 213, Severity.STOP, "UALM")
FRAME_MISMATCH = AlarmCode(12, 253, Severity.STOP, "Frame number mismatch")
NO_VACUUM = AlarmCode(12, 215, Severity.PAUSE, "UALM gripper does not answer")
LINE_REFUSED = AlarmCode(12, 216, Severity.ABORT, "UALM line cannot be executed")
POSITION_LIMIT = AlarmCode(15, 17, Severity.STOP, "Limit error")
NOT_REACHABLE = AlarmCode(15, 18, Severity.STOP, "Position not reachable")
SINGULARITY = AlarmCode(15, 23, Severity.STOP, "In singularity")
CONFIG_CHANGE = AlarmCode(15, 63, Severity.STOP, "Position config change")
POSITION_INVALID = AlarmCode(12, 311, Severity.STOP, "Uninitialized data PR[1]")
PR_KEPT = AlarmCode(16, 37, Severity.WARN, "Pos reg is locked")
START_REFUSED = AlarmCode(24, 11, Severity.WARN, "Start refused")
RESET_REFUSED = AlarmCode(24, 12, Severity.WARN, "Reset refused")
MODE_SELECTED = {
    mode: AlarmCode(24, number, Severity.SERVO, f"Operation mode {mode} Selected")
    for mode, number in (("T1", 38), ("T2", 39), ("AUTO", 40))
}
"""By the mode to which the switch was turned: the robot halts [src], docs/sources.md."""
POWER_OFF = {"imstp": IMSTP, "panel_imstp": PANEL_ESTOP}
"""By the input that switches the drives off; no reset clears one while its input is off."""


def power_off_causes(lit: Container[str]) -> list[AlarmCode]:
    """Return the alarms of the inputs that keep the drives off; ``lit`` are those that are on."""
    return [code for name, code in POWER_OFF.items() if name not in lit]


def check_ranges(joints: Sequence[Joint], positions: Iterable[float], where: str = "") -> None:
    """Refuse joint positions that the robot cannot go to.

    Args:
        joints: Of robot.yaml.
        positions: One for each [rad or m].
        where: Goes on with the text.

    Raises:
        RefusedError: One is not finite, or outside its joint's range.
    """
    for joint, position in zip(joints, positions):
        # A set point may come as float32 in deg or mm: the end of a range may round beyond it. NaN
        # fails the comparison, so it is refused below.
        if joint.lower - 1e-6 <= position <= joint.upper + 1e-6:
            continue
        code = POSITION_LIMIT if math.isfinite(position) else POSITION_INVALID
        shown = f"J{joint.axis_number} = {position / joint.scale:.3f} {joint.unit}"
        raise RefusedError(code, shown + where)


class AlarmList:
    """The active alarms. One of each kind.

    The latest of those that stop is shown first, then the latest warning.

    Attributes:
        active: All of them, in the order in which they came; each change makes a new list.
        fault: Whether an alarm is active that stops; a warning is none.
        shown: The alarm in the alarm registers, if any.
    """

    def __init__(self) -> None:
        self._hold([])

    def add(self, alarm: Alarm) -> None:
        """Make ``alarm`` active.

        A kind that is active already keeps its first time and cause (a warning: its last).
        """
        same = [old for old in self.active if old.code is alarm.code]
        if same and alarm.code.severity > Severity.WARN:
            return
        self._hold([old for old in self.active if old not in same] + [alarm])

    def clear(self, keep: Sequence[AlarmCode] = ()) -> None:
        """Forget all alarms but those of the kinds ``keep``."""
        self._hold([alarm for alarm in self.active if alarm.code in keep])

    def forget(self, alarms: Container[Alarm]) -> None:
        """Forget these; one that came again since then is another."""
        self._hold([alarm for alarm in self.active if alarm not in alarms])

    def _hold(self, active: list[Alarm]) -> None:
        """Keep these alarms; what they come to is asked for far more often than it changes."""
        self.active = active
        stopping = [alarm for alarm in active if alarm.code.severity > Severity.WARN]
        listed = stopping or active
        self.fault = bool(stopping)
        self.shown: Alarm | None = listed[-1] if listed else None
