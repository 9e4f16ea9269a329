"""Signals that are shown later than they are true, each by a time of its own."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

import msgspec

from fanuc_emulator.alarms import Alarm
from fanuc_emulator.plant.config import ALARM
from fanuc_emulator.uop import Outputs


class LateSignals:
    """Delays outputs and the active alarm, stepped once per servo period.

    Args:
        after_ms: How much later each is shown; one that is not named is shown at once.
        period_ms: Servo period.
    """

    def __init__(self, after_ms: Mapping[str, float], period_ms: int) -> None:
        self._steps = {name: round(after / period_ms) for name, after in after_ms.items()}
        self._waiting: dict[str, deque[bool | Alarm | None]] = {}

    def step(self, outputs: Outputs, alarm: Alarm | None) -> tuple[Outputs, Alarm | None]:
        """Take what is true now and return what is shown."""
        late = {}
        for name, steps in self._steps.items():
            true = alarm if name == ALARM else getattr(outputs, name)
            waiting = self._waiting.setdefault(name, deque([true] * steps))
            waiting.append(true)
            late[name] = waiting.popleft()
        shown = late.pop(ALARM, alarm)
        return msgspec.structs.replace(outputs, **late), shown  # type: ignore[return-value]
