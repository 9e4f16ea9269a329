"""Set points ahead of their time: a ring of them, each with the robot's own clock."""

from __future__ import annotations

from collections.abc import Sequence

from scara_config.modbus_map import RING_NUMBERS

EMPTY = -1
"""The time of a place that holds no set point."""
WRAP_MS = 2**31

Row = tuple[float, ...]


class SetpointRing:
    """The background program that hands the stream program its set points by the clock.

    Number n stands in place (n - 1) modulo the number of places. Between two set points the robot
    goes straight. A set point may be written anew until it is taken.

    Args:
        places: How many set points there is room for; 0: there is no ring.

    Attributes:
        read: Number of the set point that was taken last; 0 before the first.
        underruns: So often there was no set point left.
    """

    def __init__(self, places: int) -> None:
        self.read = self.underruns = 0
        self._places = places
        self._rows: list[Row] = [()] * places
        self._times = [EMPTY] * places
        self._newest = 0
        # The last set point that was taken and when it was true [ms]; None before the first.
        self._taken: tuple[int, Row] | None = None
        self._dry = False

    @property
    def fed(self) -> bool:
        """Set points have been given since the ring was emptied."""
        return self._newest > 0

    def write_rows(self, rows: Sequence[Row]) -> None:
        """Set the positions in all places [rad or m], shape ``(places, n)``."""
        self._rows = list(rows)

    def write_times(self, times: Sequence[int]) -> None:
        """Set when each place's set point counts [ms of the robot's clock], or EMPTY."""
        self._times = list(times)

    def write_newest(self, number: int) -> None:
        """Say which set point is the last one that is given; 0 takes all of them back.

        A lower number than before takes the ones behind it back.
        """
        if number == 0:
            self.empty()
            return
        if not self._newest or not -self._places < _distance(self.read, number) <= self._places:
            # No neighbour of what was read: a client that began anew, and only the ring's places
            # can hold its set points.
            self.read = _before(number, self._places)
        self._newest = number

    def empty(self) -> None:
        """Forget all set points."""
        self._times = [EMPTY] * self._places
        if self._newest:
            self.read = self._newest
        self._newest = 0
        self._taken = None
        self._dry = False

    def at(self, clock_ms: int) -> Row | None:
        """Return where the axes should be now [rad or m]; None: no set point counts yet.

        Args:
            clock_ms: The robot's own clock, 0 .. 2^31 - 1.
        """
        following = self._next()
        while following is not None and _passed(following[1], clock_ms) >= 0:
            self.read = following[0]
            self._taken = following[1:]
            following = self._next()
        if self._taken is None:
            return None
        time, row = self._taken
        if following is None:
            self.underruns += not self._dry
            self._dry = True
            # What comes next is gone to from here, beginning now.
            self._taken = (clock_ms, row)
            return row
        self._dry = False
        _, until, ahead = following
        part = _passed(time, clock_ms) / _passed(time, until)
        return tuple([a + part * (b - a) for a, b in zip(row, ahead)])

    def _next(self) -> tuple[int, int, Row] | None:
        """Return number, time and positions of the next set point that is given."""
        for step in range(1, _distance(self.read, self._newest) + 1 if self._newest else 0):
            number = _before(self.read, -step)
            place = (number - 1) % self._places
            if self._times[place] != EMPTY:
                return number, self._times[place], self._rows[place]
        return None


def _distance(number: int, other: int) -> int:
    """Return how many numbers ``other`` is behind ``number``; negative: before it."""
    return (other - number + RING_NUMBERS // 2) % RING_NUMBERS - RING_NUMBERS // 2


def _before(number: int, count: int) -> int:
    """Return the number ``count`` before ``number``; negative: behind it."""
    return (number - 1 - count) % RING_NUMBERS + 1


def _passed(time: int, now: int) -> int:
    """Return how many milliseconds ``now`` is after ``time``, across the clock's wrap."""
    return (now - time + WRAP_MS // 2) % WRAP_MS - WRAP_MS // 2
