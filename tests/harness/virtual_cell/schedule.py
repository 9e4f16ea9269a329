"""Virtual time: one true clock in nanoseconds, calls due on it, clocks beside it, late wires."""

from __future__ import annotations

import heapq
import random
from collections.abc import Callable
from itertools import count

SECOND = 1_000_000_000
Call = Callable[[], object]


class Schedule:
    """Calls in the order in which they are due; those due at the same time keep their order."""

    def __init__(self) -> None:
        """Begin at 0."""
        self.now_ns = 0
        self._due: list[tuple[int, int, Call]] = []
        self._order = count()

    @property
    def now(self) -> float:
        """True time [s]."""
        return self.now_ns / SECOND

    def after(self, delay: float, call: Call) -> None:
        """Make ``call`` after ``delay`` [s]."""
        self.at_ns(self.now_ns + round(max(delay, 0.0) * SECOND), call)

    def at_ns(self, due_ns: int, call: Call) -> None:
        """Make ``call`` at a true time."""
        heapq.heappush(self._due, (due_ns, next(self._order), call))

    def every(self, period: float, call: Call, first: float = 0.0) -> None:
        """Make ``call`` each ``period`` [s], first after ``first`` [s]; errors do not add up."""
        begin = self.now + first
        numbers, due, order = count(1), self._due, self._order

        def again() -> None:
            due_ns = round((begin + next(numbers) * period) * SECOND)
            heapq.heappush(due, (due_ns, next(order), again))
            call()

        self.at_ns(round(begin * SECOND), again)

    def run_until(self, done: Callable[[], bool], limit: float, what: str = "") -> None:
        """Let time pass until ``done`` holds, which is asked after each call.

        Raises:
            TimeoutError: It does not hold within ``limit`` [s].
        """
        end = self.now_ns + round(limit * SECOND)
        while not done():
            due_ns, _, call = heapq.heappop(self._due)
            if due_ns > end:
                self.now_ns = end
                heapq.heappush(self._due, (due_ns, -1, call))
                raise TimeoutError(f"waited {limit:g} s in vain for {what or 'a condition'}")
            self.now_ns = due_ns
            call()

    def run(self, duration: float) -> None:
        """Let ``duration`` [s] pass."""
        # What is put down for then from now on comes after it.
        end = self.now_ns + round(max(duration, 0.0) * SECOND), next(self._order)
        due = self._due
        while due and due[0] < end:
            self.now_ns, _, call = heapq.heappop(due)
            call()
        self.now_ns = end[0]


class SideClock:
    """A clock beside the true one, with an offset and a drift."""

    def __init__(self, schedule: Schedule, offset: float, drift_ppm: float) -> None:
        """Show ``offset`` [s] at the true time 0 and run fast by ``drift_ppm``."""
        self._schedule = schedule
        self.offset = offset
        self.rate = 1.0 + drift_ppm * 1e-6

    def elapsed(self) -> float:
        """Return what has passed on this clock since the true time 0 [s]."""
        return self._schedule.now * self.rate

    def now(self) -> float:
        """Return what this clock shows [s]."""
        return self.offset + self.elapsed()

    def period(self, shown: float) -> float:
        """Return the true length of ``shown`` [s] of this clock."""
        return shown / self.rate


class Wire:
    """A way of packets: each is late by a delay and some jitter, and none overtakes another."""

    def __init__(
        self, schedule: Schedule, delay: float, jitter: float, source: random.Random
    ) -> None:
        """Be late by ``delay`` to ``delay + jitter`` [s], drawn evenly from ``source``."""
        self._schedule, self._source = schedule, source
        self.delay, self.jitter = delay, jitter
        self._last_ns = 0

    def send(self, call: Call) -> None:
        """Make ``call`` when the packet arrives."""
        late = self.delay
        if self.jitter > 0.0:
            late += self._source.random() * self.jitter
        self._last_ns = max(self._last_ns, self._schedule.now_ns + round(late * SECOND))
        self._schedule.at_ns(self._last_ns, call)
