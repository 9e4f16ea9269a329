"""How long the robot takes to answer a request."""

from __future__ import annotations

import numpy as np

from fanuc_emulator.plant.config import AnswerFile


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
        return 1e-3 * self._random.uniform(*(file.running_ms if running else file.idle_ms))
