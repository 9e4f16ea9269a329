"""When which physics step is due, and how well the deadlines are kept.

The clock is an argument, in [ns].
"""

from __future__ import annotations

from collections.abc import Sequence

import msgspec


class PhysicsPace:
    """Spreads physics steps over real time by absolute deadlines.

    Step k is due at ``start + k * step``. A wake runs all that is due; after a stall longer than
    the allowed catch-up the rest is skipped: the nominal time jumps, no burst of old steps is run.
    """

    def __init__(self, step_ns: int, factor: float, max_catch_up_ns: int, now_ns: int) -> None:
        """Begin at ``now_ns``.

        Args:
            step_ns: Simulated length of a step.
            factor: Simulated time per real time; 0: as fast as possible.
            max_catch_up_ns: Longest stall that is made up for; where simulated time is slower than
                real time, it is simulated time.
            now_ns: Monotonic time.
        """
        self._step_ns = step_ns
        self._factor = factor
        self._max_steps = max(1, round(max_catch_up_ns * max(1.0, factor)) // step_ns)
        self._start_ns = now_ns
        self._done = 0
        self.skipped_steps = 0

    def due(self, now_ns: int) -> tuple[int, int]:
        """Return how many steps to run now and how many were skipped before them."""
        target = int((now_ns - self._start_ns) * self._factor) // self._step_ns
        missing = max(0, target - self._done)
        skipped = max(0, missing - self._max_steps)
        self._done += missing
        self.skipped_steps += skipped
        return missing - skipped, skipped

    def restart(self, now_ns: int, steps_made: int) -> int:
        """Go on after a pause without making up for it.

        Args:
            now_ns: Monotonic time.
            steps_made: Steps that were made by hand meanwhile.

        Returns:
            How many steps the pause would have held beyond those; 0 if more were made: then real
            time catches up first.
        """
        self._done += steps_made
        missing = max(
            0, int((now_ns - self._start_ns) * self._factor) // self._step_ns - self._done
        )
        self._done += missing
        return missing


class DeadlineReport(msgspec.Struct, frozen=True):
    """How late the wakes of the last report period were [ms]."""

    wakes: int
    missed: int
    p50_ms: float
    p99_ms: float
    max_ms: float


class WakeTimes:
    """Absolute wake-up times and the statistics of how late each was."""

    def __init__(self, period_ns: int, now_ns: int) -> None:
        """Let the first wake be one period after ``now_ns``."""
        self._period_ns = period_ns
        self._next_ns = now_ns + period_ns
        self._lateness_ns: list[int] = []
        self._missed = 0

    def wait_ns(self, now_ns: int) -> int:
        """Return how long to sleep until the next wake, 0 if it is past."""
        return max(0, self._next_ns - now_ns)

    def woke(self, now_ns: int) -> None:
        """Note a wake and plan the next; wakes that lie in the past by now are missed."""
        late = now_ns - self._next_ns
        self._lateness_ns.append(late)
        # The wakes between are not made: the physics runs all its steps at the next one.
        periods = 1 + max(0, late // self._period_ns)
        self._missed += periods - 1
        self._next_ns += periods * self._period_ns

    def report(self) -> DeadlineReport:
        """Return the statistics since the last report and begin anew."""
        late, missed = sorted(self._lateness_ns), self._missed
        self._lateness_ns, self._missed = [], 0
        if not late:
            return DeadlineReport(0, missed, 0.0, 0.0, 0.0)
        return DeadlineReport(
            len(late),
            missed,
            _percentile(late, 50) / 1e6,
            _percentile(late, 99) / 1e6,
            late[-1] / 1e6,
        )


def _percentile(ordered: Sequence[int], percent: int) -> int:
    """Return the smallest value that is not exceeded by ``percent`` of the values."""
    # Rounded up in whole numbers: a quotient of floats could come out just above one.
    return ordered[max(0, -(-len(ordered) * percent // 100) - 1)]
