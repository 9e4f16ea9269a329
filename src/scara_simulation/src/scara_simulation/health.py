"""Judges how the simulation is doing: one level and one sentence for the operator."""

from __future__ import annotations

from typing import Literal

import msgspec

from scara_simulation.real_time import DeadlineReport

Level = Literal["ok", "warn", "error"]

SLOWEST = 0.9
"""Share of the wanted speed below which the twin is not in real time any more. Our choice."""


class Status(msgspec.Struct, frozen=True):
    """How the simulation is doing.

    Counters since the start, deadlines and speed of the last report period.
    """

    paused: bool
    steps: int
    real_time_factor: float
    deadlines: DeadlineReport
    stalls: int
    skipped_steps: int
    clock_steps: int
    saturated_steps: int
    limited_steps: int
    refused: int
    last_refusal: str


def judge(status: Status, last: Status | None, factor: float) -> tuple[Level, str]:
    """Compare a status with the one before.

    Args:
        status: The newest.
        last: The one before, None at the start.
        factor: Speed that shall be kept; 0: none.

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
    if saturated := status.saturated_steps - last.saturated_steps:
        texts.append(f"effort saturated in {saturated} joint steps")
    if limited := status.limited_steps - last.limited_steps:
        texts.append(f"set point kept inside its limits in {limited} joint steps")
    slow = (
        factor > 0.0
        and not last.paused
        and last.steps > 0
        and status.real_time_factor < SLOWEST * factor
    )
    if slow:
        texts.insert(
            0, f"too slow: {status.real_time_factor:.2f} of real time instead of {factor:g}"
        )
    return ("error" if slow else "warn" if texts else "ok"), "; ".join(texts) or "running"
