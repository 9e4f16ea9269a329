"""What the pair has done today: runs by who led them, parts, the largest deviation."""

from __future__ import annotations

from dataclasses import dataclass

from scara_ros.names import STREAM, current_line

from operator_panel.view import words
from operator_panel.view.snapshot import Snapshot
from scara_msgs.msg import TwinControllerState

REAL, TWIN, OPERATOR = "real", "twin", "operator"
SIDES = (REAL, TWIN)
LAST_CYCLES = 20  # our choice: what the mean is made of; older cycles say little of now


@dataclass
class _Run:
    """A program of the real robot that has begun; ``ended`` once it runs no longer [s]."""

    name: str
    began: float
    ended: float | None = None


class Today:
    """Counts while the page's server runs, from midnight on. Not thread-safe."""

    def __init__(self) -> None:
        """Know nothing yet."""
        self._date = ""
        self._placed_before: dict[str, int] = {}
        # A program that runs over midnight keeps its start: it counts on the day on which it ends.
        self._run: _Run | None = None
        self._clear()

    def _clear(self) -> None:
        self._cycles: list[float] = []
        self._count = dict.fromkeys((REAL, TWIN, OPERATOR), 0)
        # Who else leads, until the pair rests.
        self._mover = ""
        self._worst: tuple[float, str] = (-1.0, "")  # a distance of 0 is known, too

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
            self._run, self._mover = None, ""  # nobody knows how it ended
            return
        for _, apart_mm in snapshot.apart:
            self._worst = max(self._worst, (apart_mm, clock), key=lambda one: one[0])
        if package is None:
            self._run = None  # nobody knows how it ends
        else:
            # Time a program of the real robot from its start to its end; count it once at rest
            name, run = current_line(package.program)[0], self._run
            # A paused one goes on. What runs while another side leads is the stream to the robot.
            runs = state.leader in ("", REAL) and package.control_type != STREAM
            runs = runs and (package.running or bool(name))
            if run is not None and runs and run.ended is None:
                run.name = run.name or name
            elif run is not None and not runs and run.ended is None:
                run.ended = now
            if run is not None and run.ended is not None and (runs or state.leader != REAL):
                if runs or state.mode == TwinControllerState.IDLE:
                    self._cycles = [*self._cycles, run.ended - run.began][-LAST_CYCLES:]
                    self._count[REAL] += 1
                self._run = run = None
            if run is None and runs and state.leader == REAL:
                self._run = _Run(name, now)
        if state.leader in (TWIN, OPERATOR):
            self._mover = state.leader
        elif self._mover:
            # Where the real robot took over, or something stopped the pair, it came to nothing.
            self._count[self._mover] += state.mode == TwinControllerState.IDLE
            self._mover = ""

    def texts(self, snapshot: Snapshot, now: float) -> dict[str, str]:
        """Return what stands on the page, by place."""
        parts = [
            f"{side} {snapshot.placed.get(side, 0) - self._placed_before.get(side, 0)}"
            for side in SIDES
        ]
        running = "none runs" if snapshot.package is not None else words.UNKNOWN
        if self._run is not None and self._run.ended is None:
            running = f"{self._run.name}, {now - self._run.began:.0f} s so far"
        worst, clock = self._worst
        mean = sum(self._cycles) / len(self._cycles) if self._cycles else None
        return {
            "today.cycles": ", ".join(f"{who} {count}" for who, count in self._count.items()),
            "today.running": running,
            "today.last": f"{self._cycles[-1]:.1f} s" if self._cycles else words.UNKNOWN,
            "today.mean": words.UNKNOWN if mean is None else f"{mean:.1f} s",
            "today.parts": ", ".join(parts),
            "today.deviation": f"{worst:.2f} mm at {clock}" if clock else words.UNKNOWN,
        }
