"""What the page has shown, or would have shown of a recording, to be looked at again."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import deque
from collections.abc import Callable
from itertools import islice

import msgspec

from operator_panel.view.frame import Frame, Points
from operator_panel.view.snapshot import Part

KEPT_S = 600.0  # our choice: ten minutes, some 4 MB
PERIOD_S = 0.5  # our choice: as often as the page's server looks while no page is open
Row = tuple[float, Points]


class PastMoment(msgspec.Struct, frozen=True):
    """What the page showed at a time, or would have shown.

    Attributes:
        at: System time [s].
        t: Time of the chart points [s], on a clock that is never set.
        frame: Makes the frame as a page gets it now; nobody may ever look back to it.
        points: Its chart points.
        parts: Parts of each side.
    """

    at: float
    t: float
    frame: Callable[[], Frame]
    points: Callable[[], Points]
    parts: dict[str, tuple[Part, ...]]


class Look(msgspec.Struct, frozen=True):
    """A moment as a page gets it.

    Attributes:
        at: System time of the moment [s].
        first: Of the oldest moment that is known [s].
        last: Of the newest [s].
        frame: What was shown.
        parts: Where the parts were.
        rows: Chart points up to the moment: time as ``frame.t`` has it, points.
    """

    at: float
    first: float
    last: float
    frame: Frame
    parts: dict[str, tuple[Part, ...]]
    rows: list[tuple[float, Points]]


class Past:
    """Keeps moments, at most one each ``PERIOD_S`` of those that are added. Not thread-safe."""

    def __init__(self, kept_s: float = KEPT_S) -> None:
        """Know nothing yet; what is older than the newest by ``kept_s`` [s] is forgotten."""
        self._kept_s = kept_s
        self._moments: deque[PastMoment] = deque()

    def is_due(self, now: float) -> bool:
        """Return whether a moment at the system time ``now`` [s] would be kept.

        A clock that was set back begins a new past.
        """
        if self._moments and now < self._moments[-1].at:
            self._moments.clear()
        # Less than a whole period, or looks at nearly the same rate would miss every other one.
        return not self._moments or now - self._moments[-1].at >= 0.8 * PERIOD_S

    def keep(self, moment: PastMoment) -> None:
        """Keep a moment that is newer than all others, and forget what is too old."""
        self._moments.append(moment)
        while moment.at - self._moments[0].at > self._kept_s:
            self._moments.popleft()

    def look(self, at: float, window_s: float) -> Look | None:
        """Return the moment nearest to the system time ``at`` [s]; None if nothing is known.

        Args:
            at: When.
            window_s: So far back the charts look [s].
        """
        if not self._moments:
            return None
        times = [moment.at for moment in self._moments]
        place = min(bisect_left(times, at), len(times) - 1)
        if place and at - times[place - 1] < times[place] - at:
            place -= 1
        begin = bisect_right(times, times[place] - window_s)
        rows = [(one.t, one.points()) for one in islice(self._moments, begin, place + 1)]
        found = self._moments[place]
        frame = msgspec.structs.replace(found.frame(), point={})
        return Look(found.at, times[0], times[-1], frame, found.parts, rows)


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
