"""What the pair has done today: cycles of programs, parts, the largest deviation."""

from __future__ import annotations

import math

from operator_panel.view import words
from operator_panel.view.snapshot import Snapshot

SIDES = ("real", "twin")
LAST_CYCLES = 20  # our choice: what the mean is made of; older cycles say little of now


class Today:
    """Counts while the page's server runs, from midnight on. Not thread-safe."""

    def __init__(self) -> None:
        """Know nothing yet."""
        self._date = ""
        self._placed_before: dict[str, int] = {}
        self._clear()

    def _clear(self) -> None:
        self._cycles: list[float] = []
        self._count = 0
        self._begun: tuple[str, float] | None = None
        self._worst: tuple[float, str] = (0.0, "")

    def look(self, snapshot: Snapshot, silent: bool, date: str, clock: str, now: float) -> None:
        """Take what is known now.

        Args:
            snapshot: Of the cell.
            silent: The twin controller says nothing: what it said last is not counted again.
            date: Of today, as text that differs from day to day.
            clock: Time of day as text.
            now: Monotonic time [s].
        """
        if date != self._date:
            self._date = date
            self._placed_before = dict(snapshot.placed)
            self._clear()
        state, package = snapshot.state, snapshot.package
        if state is None or silent:
            self._begun = None  # nobody knows when it ended
            return
        if state.leader and math.isfinite(state.deviation_mm):
            self._worst = max(self._worst, (state.deviation_mm, clock), key=lambda one: one[0])
        if package is not None:
            self._cycle(package.running, package.program.partition(" ")[0], now)

    def _cycle(self, running: bool, name: str, now: float) -> None:
        """Time a program from its start to its end."""
        if running and self._begun is None:
            self._begun = (name, now)
        elif not running and self._begun is not None:
            self._cycles = [*self._cycles, now - self._begun[1]][-LAST_CYCLES:]
            self._count += 1
            self._begun = None

    def texts(self, snapshot: Snapshot, now: float) -> dict[str, str]:
        """Return what stands on the page, by place."""
        parts = [
            f"{side} {snapshot.placed.get(side, 0) - self._placed_before.get(side, 0)}"
            for side in SIDES
        ]
        running = "none runs"
        if self._begun is not None:
            running = f"{self._begun[0]}, {now - self._begun[1]:.0f} s so far"
        worst, clock = self._worst
        mean = sum(self._cycles) / len(self._cycles) if self._cycles else None
        return {
            "today.cycles": str(self._count),
            "today.running": running,
            "today.last": f"{self._cycles[-1]:.1f} s" if self._cycles else words.UNKNOWN,
            "today.mean": words.UNKNOWN if mean is None else f"{mean:.1f} s",
            "today.parts": ", ".join(parts),
            "today.deviation": f"{worst:.2f} mm at {clock}" if clock else words.UNKNOWN,
        }
