"""FAULT_RESET: it clears alarms, and switches drives on that are off."""

from __future__ import annotations

from collections.abc import Container, Sequence

from fanuc_emulator.alarms import Alarm, AlarmList, power_off_causes
from fanuc_emulator.drives.group import MotionGroup


class FaultReset:
    """Do what RESET asks for; the drives take their time.

    Args:
        motion: The drives.
        alarms: Stay as they are until the drives are on: FAULT goes after SYSRDY has come.
        power_on_ms: So long the drives take.

    Source:
        B-83284EN/09, 3.3 and figure 3.8.
    """

    def __init__(self, motion: MotionGroup, alarms: AlarmList, power_on_ms: int) -> None:
        self._motion, self._alarms, self._power_on_ms = motion, alarms, power_on_ms
        # When the drives are on, and what is cleared then; None: nobody has asked for them, or a
        # stop has come since.
        self._due: tuple[int, Sequence[Alarm]] | None = None

    @property
    def pending(self) -> bool:
        """Whether the drives are being switched on."""
        return self._due is not None

    def ask(self, lit: Container[str], now_ms: int) -> str:
        """Begin a reset, and end it where no drive has to be waited for.

        Args:
            lit: The inputs that are on; an alarm whose input is off stays.
            now_ms: By the robot's own clock.

        Returns:
            Why it is refused; empty: it is not.
        """
        if persists := power_off_causes(lit):
            self._alarms.clear(keep=persists)
        elif self._motion.powered:
            self._alarms.clear()
        elif not self._motion.standing:
            return "the axes have not stopped yet"
        elif not self.pending:
            self._due = now_ms + self._power_on_ms, self._alarms.active
            self.step(now_ms)
        return ""

    def step(self, now_ms: int) -> None:
        """Switch the drives on when their time has come, and clear the alarms after that."""
        if self._due is None or now_ms < self._due[0]:
            return
        self._motion.power_on()
        # What was raised since then stays: a START that came too early is told.
        self._alarms.forget(self._due[1])
        self.drop()

    def drop(self) -> None:
        """Leave the drives off: a stop has come."""
        self._due = None
