"""What the robot does late: its answers, and the signals that it shows."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np

from fanuc_emulator.alarms import Alarm
from fanuc_emulator.plant.config import ALARM, AnswerFile
from fanuc_emulator.uop import Outputs


class AnswerTimes:
    """Draws one answer after the other.

    Args:
        file: Shortest and longest answers, while a program runs and while none does.
        random: Draws them.
    """

    def __init__(self, file: AnswerFile, random: np.random.Generator) -> None:
        self._file, self._random = file, random
        self.at_once = not any((*file.idle_ms, *file.running_ms))

    def next(self, running: bool) -> float:
        """Return how long the next answer takes [s]; ``running``: a program runs."""
        file = self._file
        low, high = file.running_ms if running else file.idle_ms
        # As the generator's own `uniform`, in a fifth of its time.
        return 1e-3 * (low + (high - low) * self._random.random())


class LateSignals:
    """Delays outputs and the active alarm, stepped once per servo period.

    A reset is shown in the maker's order: SYSRDY comes, then FAULT goes and CMDENBL comes
    (B-83284EN/09, 3.3).

    Args:
        after_ms: How much later each is shown; one that is not named is shown at once.
        period_ms: Servo period.
    """

    def __init__(self, after_ms: Mapping[str, float], period_ms: int) -> None:
        self._steps = {name: round(after / period_ms) for name, after in after_ms.items()}
        self._waiting: dict[str, deque[bool | Alarm | None]] = {}
        # The fault that was shown last, and its alarm.
        self._fault: tuple[bool, Alarm | None] = False, None

    def step(self, outputs: Outputs, alarm: Alarm | None) -> tuple[Outputs, Alarm | None]:
        """Take what is true now and return what is shown."""
        late = {}
        for name, steps in self._steps.items():
            true = alarm if name == ALARM else getattr(outputs, name)
            waiting = self._waiting.get(name)
            if waiting is None:
                # What is true at first counts as if it had been so for ever.
                waiting = self._waiting[name] = deque([true] * steps)
            waiting.append(true)
            late[name] = waiting.popleft()
        shown: Any = late.pop(ALARM, alarm)
        seen = msgspec.structs.replace(outputs, **late)
        fault, its_alarm = self._fault
        if fault and outputs.sysrdy and not seen.sysrdy:
            seen, shown = msgspec.structs.replace(seen, fault=True, cmdenbl=False), its_alarm
        self._fault = seen.fault, shown
        return seen, shown
