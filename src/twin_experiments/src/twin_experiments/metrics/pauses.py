"""Pauses of the machine: moments at which nothing at all was recorded.

A bag of a cell holds about 800 messages a second of a dozen nodes. If none of them arrives for
longer than 30 ms, it is not one node that was late but the machine, or the recorder.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin_experiments.metrics.series import Array, Mask

LONGEST_SILENCE_S = 0.03  # our choice: some 25 messages at 800 a second
AFTERMATH_S = 0.2  # our choice: as long as both sides need to come together again


@dataclass(frozen=True)
class Pause:
    """Nothing was recorded from ``start`` [s] for ``duration`` [s]."""

    start: float
    duration: float

    @property
    def end(self) -> float:
        """When the next message arrived [s]."""
        return self.start + self.duration


def find_pauses(arrivals: Array) -> tuple[Pause, ...]:
    """Return the pauses between messages, in order.

    Args:
        arrivals: Times of receipt of all messages of all topics together [s], in any order.
    """
    ordered = np.sort(arrivals)
    silences = np.diff(ordered)
    return tuple(
        Pause(float(ordered[i]), float(silences[i]))
        for i in np.flatnonzero(silences > LONGEST_SILENCE_S)
    )


def pauses_within(pauses: tuple[Pause, ...], start: float, end: float) -> tuple[Pause, ...]:
    """Return the pauses that touch the time from ``start`` to ``end`` [s]."""
    return tuple(pause for pause in pauses if pause.start < end and pause.end > start)


def longest_ms(pauses: tuple[Pause, ...]) -> float:
    """Return the length of the longest pause [ms], 0 without any."""
    return 1e3 * max((pause.duration for pause in pauses), default=0.0)


def undisturbed(instants: Array, pauses: tuple[Pause, ...]) -> Mask:
    """Return which instants [s] lie neither in a pause nor in the 0.2 s after it."""
    free = np.ones(len(instants), dtype=bool)
    for pause in pauses:
        free &= (instants < pause.start) | (instants > pause.end + AFTERMATH_S)
    return free
