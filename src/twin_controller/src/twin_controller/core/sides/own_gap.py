"""Tell a late controller from a silent side: time in which it did not run is nobody's silence.

The controller looks at its inputs every 10 ms or oftener. A look that comes much later shows that
the machine did not let it run. What the sides have sent meanwhile still waits in the sockets, so
this gap must not count as their silence. A gap is forgiven only while it is short: after a long
one the pair's data are old, and the robot's watchdog has stopped it.
"""

from __future__ import annotations

from collections import deque

from msgspec.structs import replace

from twin_controller.config import OwnGap
from twin_controller.core.sides.side import Sides

NAMED_S = 1.0
"""A stall is named as the cause of what happens within this time of it [s]; our choice."""


class OwnGaps:
    """Finds the controller's own gaps; knows no clock."""

    def __init__(self, config: OwnGap) -> None:
        """Begin without a look."""
        self._notice = config.notice_ms * 1e-3
        self._forgive, self._window = config.forgive_ms * 1e-3, config.window_ms * 1e-3
        self._last: float | None = None
        # What the last look has shown [s]: 0 if it came in time.
        self.stood = 0.0
        self._forgiven: deque[tuple[float, float]] = deque()

    def look(self, now: float) -> float:
        """Take one look, and return the gap before it that is no silence of a side.

        Args:
            now: Monotonic time [s].

        Returns:
            The gap [s]; 0 if the look came in time, or if the gap is too long to be forgiven.
        """
        last, self._last = self._last, now
        self.stood = 0.0
        if last is None or now - last <= self._notice:
            return 0.0
        while self._forgiven and now - self._forgiven[0][0] > self._window:
            self._forgiven.popleft()
        gap = self.stood = now - last
        if gap + sum(before for _, before in self._forgiven) > self._forgive:
            return 0.0
        self._forgiven.append((now, gap))
        return gap


def note_stall(sides: Sides, stood: float, now: float) -> Sides:
    """Note that this machine stood still for ``stood`` [s] until ``now``."""
    stall = (now, stood)
    return Sides(replace(sides.real, stall=stall), replace(sides.twin, stall=stall))


def stall_text(stall: tuple[float, float], now: float) -> str:
    """Return that this machine stood still if that was a moment ago; else an empty text."""
    ended, stood = stall
    if stood > 0.0 and now - ended <= NAMED_S:
        return f"this machine stood still for {stood:.2f} s"
    return ""


def leave_out(sides: Sides, gap: float, now: float) -> Sides:
    """Note that nobody listened to the sides for ``gap`` [s] until ``now``; see :func:`silence`."""
    deaf = (now - gap, now)
    return Sides(replace(sides.real, deaf=deaf), replace(sides.twin, deaf=deaf))


def silence(seen: float, now: float, deaf: tuple[float, float]) -> float:
    """Return for how long a side was silent while somebody listened [s].

    Args:
        seen: When it was last heard [s].
        now: Until when [s].
        deaf: From when to when nobody listened [s].
    """
    begin, end = deaf
    return now - seen - max(0.0, min(end, now) - max(begin, seen))
