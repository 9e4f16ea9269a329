"""Judges how the simulation is doing: one level and one sentence for the operator."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import Literal

import msgspec

from scara_simulation.real_time import DeadlineReport

Level = Literal["ok", "warn", "error"]

SLOWEST = 0.9
"""Share of the wanted speed below which the twin is not in real time any more. Our choice."""
EARLY = 0.9
"""Share of the window after which a report may end it: none comes to the step. Our choice."""


class Status(msgspec.Struct, frozen=True):
    """How the simulation is doing.

    Counters since the start, those of saturated efforts by joint; deadlines and speed of the last
    report period, and whether that was ``whole``: one that has ended, and held no pause.
    """

    paused: bool
    whole: bool
    steps: int
    real_time_factor: float
    deadlines: DeadlineReport
    stalls: int
    skipped_steps: int
    clock_steps: int
    saturated_steps: dict[str, int]
    limited_steps: int
    refused: int
    last_refusal: str


class SaturationWatch:
    """Tells which joint has been at its effort limit for so long that the twin falls behind.

    A step or two at the limit, as where a motion begins, leave no error that anybody could see.
    What counts is the share of the last window of simulated time.
    """

    def __init__(self, window_steps: int, limit_percent: float) -> None:
        """Know nothing yet.

        Args:
            window_steps: Length of the window [steps].
            limit_percent: More than this share of it is too much [percent].
        """
        self._window, self._limit = window_steps, limit_percent
        self._seen: deque[tuple[int, Mapping[str, int]]] = deque()

    def judge(self, steps: int, saturated: Mapping[str, int]) -> str:
        """Take the newest counts; return what is wrong with the worst joint, or an empty text.

        Args:
            steps: Steps since the start.
            saturated: Steps at the effort limit since the start, by joint.
        """
        self._seen.append((steps, saturated))
        while len(self._seen) > 2 and steps - self._seen[1][0] >= EARLY * self._window:
            self._seen.popleft()
        began, before = self._seen[0]
        # Right after the start less than a window is known: a share of that would be too large.
        length = max(steps - began, self._window)
        counts = {name: count - before.get(name, 0) for name, count in saturated.items()}
        name = max(counts, key=lambda name: counts[name], default="")
        percent = 100.0 * counts.get(name, 0) / length
        if percent <= self._limit:
            return ""
        return (
            f"{name} was at its effort limit in {percent:.1f} % of the last {length} steps, "
            f"allowed are {self._limit:g} %: it cannot follow so fast"
        )


def judge(
    status: Status, last: Status | None, factor: float, saturation: str = ""
) -> tuple[Level, str]:
    """Compare a status with the one before.

    Args:
        status: The newest.
        last: The one before, None at the start.
        factor: Speed that shall be kept; 0: none.
        saturation: What :class:`SaturationWatch` says.

    Returns:
        The level, and what is new, the worst first.
    """
    if last is None:
        return "ok", "started"
    if status.paused:
        return "ok", "paused"
    texts: list[str] = []
    if stalls := status.stalls - last.stalls:
        texts.append(f"{stalls} stalls, {status.skipped_steps - last.skipped_steps} steps skipped")
    if steps := status.clock_steps - last.clock_steps:
        texts.append(f"the system clock was stepped {steps} times")
    if refused := status.refused - last.refused:
        texts.append(f"{refused} commands refused: {status.last_refusal}")
    if saturation:
        texts.append(saturation)
    if limited := status.limited_steps - last.limited_steps:
        texts.append(f"set point kept inside its limits in {limited} joint steps")
    # A share of real time says nothing of a period that holds a part of a pause.
    slow = factor > 0.0 and status.whole and status.real_time_factor < SLOWEST * factor
    if slow:
        texts.insert(
            0, f"too slow: {status.real_time_factor:.2f} of real time instead of {factor:g}"
        )
    return ("error" if slow else "warn" if texts else "ok"), "; ".join(texts) or "running"
