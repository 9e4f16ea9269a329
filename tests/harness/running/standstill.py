"""See when the machine stood still.

A thread that sleeps shortly, and looks how long it really slept.
"""

from __future__ import annotations

import threading
import time
from collections import deque

LOOK_S = 0.005
LIMIT_S = 0.03
"""A gap between two looks that is longer than this counts: the machine did not let us run."""
REMEMBERED = 1000


class Gaps:
    """Gaps between looks that were longer than ``LIMIT_S``, newest last; knows no clock."""

    def __init__(self) -> None:
        """Begin without a look."""
        self._last: float | None = None
        self._found: deque[tuple[float, float]] = deque(maxlen=REMEMBERED)

    def look(self, now: float) -> None:
        """Take one look at the time ``now`` [s]."""
        if self._last is not None and now - self._last > LIMIT_S:
            self._found.append((self._last, now))
        self._last = now

    def longest(self, begin: float, end: float) -> float:
        """Return the longest gap between ``begin`` and ``end`` [s], 0 without one."""
        found = [b - a for a, b in list(self._found) if b > begin and a < end]
        return max(found, default=0.0)

    def since(self, begin: float) -> list[tuple[float, float]]:
        """Return the gaps that ended after ``begin`` [s]."""
        return [(a, b) for a, b in list(self._found) if b > begin]


class Machine:
    """Looks at the machine from a thread of this process, from its first question on."""

    def __init__(self) -> None:
        """Look at nothing yet."""
        self._gaps = Gaps()
        self._thread: threading.Thread | None = None

    def now(self) -> float:
        """Return the time [s] for :meth:`stood_still`, and make sure that somebody looks."""
        if self._thread is None:
            self._thread = threading.Thread(target=self._watch, name="standstill", daemon=True)
            self._thread.start()
        return time.monotonic()

    def stood_still(self, since: float) -> float:
        """Return for how long the machine stood still since then [s], 0 if it did not."""
        now = time.monotonic()
        time.sleep(2 * LOOK_S)  # a gap that ends just now is seen by the next look
        return self._gaps.longest(since, now)

    def gaps(self, since: float) -> list[tuple[float, float]]:
        """Return when the machine stood still since then, begin and end [s]."""
        time.sleep(2 * LOOK_S)
        return self._gaps.since(since)

    def _watch(self) -> None:
        while True:
            self._gaps.look(time.monotonic())
            time.sleep(LOOK_S)


MACHINE = Machine()
"""The one of this process."""
