"""The last chart points of all joints, for a page that opens later."""

from __future__ import annotations

from collections import deque

from operator_panel.view.frame import Points

Row = tuple[float, Points]


class History:
    """Keeps points for ``window_s`` at no more than ``rate_hz``. Not thread-safe."""

    def __init__(self, window_s: float, rate_hz: float) -> None:
        """Start empty."""
        self._window = window_s
        self._period = 1.0 / rate_hz
        self._rows: deque[Row] = deque()

    def add(self, t: float, points: Points) -> bool:
        """Take the points of the time ``t`` [s] if they are due; return whether they were."""
        due = not self._rows or t - self._rows[-1][0] >= 0.8 * self._period
        if not points or not due:
            return False
        self._rows.append((t, points))
        while t - self._rows[0][0] > self._window:
            self._rows.popleft()
        return True

    @property
    def rows(self) -> list[Row]:
        """The points, oldest first."""
        return list(self._rows)
