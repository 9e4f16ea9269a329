"""When the robot is asked for its state: right behind the instant at which it renews its readings.

A reading is up to one period of the robot old when it is asked for at any time, half of one on
average. The stamps tell the period and where its ticks are on our clock, so the question can come
just behind a tick. Two things keep the polls honest:

- The ticks are still taken at the pace of the polls, not each n-th of them: readings that are
  always n periods apart would look like those of a robot with a longer period.
- Four times a second a question comes just before a tick, and one behind it. Only an old reading
  bounds the offset of the robot's clock from above (:mod:`twin_controller.core.sides.clock`).

Where readings are renewed each millisecond, more slowly than we ask, or with stamps that are not
exact, polls come at their own pace and scan the robot's period.

Where answers take so long that signals and state do not fit into a period, the robot is asked again
as soon as it has answered, and for its signals behind each third state. The path is as far off as
positions are late; a stop takes far longer than the signals that show it are late then.
"""

from __future__ import annotations

import math

from twin_controller.core.sides.clock import ClockEstimate, observe, unwrap_ms
from twin_controller.estimation.rhythm import ENOUGH, PERIODS_MS, Rhythm, heard

BEHIND_S = 0.0002
"""The question is sent so much behind a tick [s]; our choice: what a robot's tick may be late."""
SCAN_S = 0.25
"""So often a question comes before a tick [s]; our choice: at a drift of 500 ppm the offset is
known to an eighth of a millisecond less by then."""
SHARP = 0.5
"""A tick is known when the instants that are possible span less than this part of a period."""
EACH_TICK = 2.0 / 3.0
"""A robot whose period is more than this part of the poll period is asked at each of its ticks."""
TRIP_SHARE = 0.3
"""Part of the newest answer in what an answer takes; our choice: it is known after five."""
UNREAD = 3
"""A slow robot is asked for its signals behind each so many states; our choice."""
FORGET = 0.02
"""The shortest time from being woken to asking is forgotten by this part in each poll."""


class PollTimes:
    """Says when to ask next; knows no clock. All times are monotonic [s].

    Args:
        period: Between two polls.
        drift_ppm: Largest drift between the robot's clock and ours.

    Attributes:
        due: When to wake for the next poll.
        aimed: The next poll is placed by the robot's tick.
    """

    def __init__(self, period: float, drift_ppm: float) -> None:
        self._period, self._drift_ppm = period, drift_ppm
        self.begin(0.0)

    def begin(self, now: float) -> None:
        """Ask at ``now``: the connection is new, and nothing is known of the robot's ticks."""
        self.due = self._nominal = now
        self.aimed = False
        self._lead = self._trip = 0.0
        self._unread = 0
        self._learn()

    @property
    def slow(self) -> bool:
        """Whether the robot takes so long that two answers do not fit between two polls."""
        return 2.0 * self._trip > self._period

    def reads_signals(self) -> bool:
        """Return whether a slow robot is asked for its signals now, behind its state."""
        self._unread = (self._unread + 1) % UNREAD if self.slow else 0
        return self.slow and not self._unread

    def polled(self, clock_ms: int | None, sent: float, received: float) -> bool:
        """Take in what a poll brought, and plan the next.

        Args:
            clock_ms: The stamp of the reading; None if there was none to believe.
            sent: When the question was sent.
            received: When its answer had come.

        Returns:
            Whether the poll came so late that the one after it is left out.
        """
        # The first answer counts whole.
        self._trip += (TRIP_SHARE if self._trip else 1.0) * (received - sent - self._trip)
        # Other questions may come before this one; by their time the poll has to begin sooner.
        spent = max(0.0, sent - self.due)
        if spent < self._lead:
            self._lead = spent
        elif spent < 0.5 * self._period:
            self._lead += FORGET * (spent - self._lead)
        if clock_ms is not None:
            self._take(clock_ms, sent, received)
        if not self._extra:
            self._nominal += self._period
        passed = self._nominal < sent
        # One out of turn may be planned behind its place on the grid: it is late by its own time.
        late = passed and (not self._extra or self.due + self._period < sent)
        if passed:
            self._nominal = sent + self._period
        if self.slow:
            self._nominal = received
        self.due, self.aimed = self._nominal, False
        if clock_ms is not None and self._tick_known:
            self._aim(received)
        return late

    def _learn(self) -> None:
        """Look for the robot's period."""
        self._rhythm = Rhythm()
        self._tick_ms = 0
        self._clock = ClockEstimate()
        self._clock_ms: int | None = None
        # Next time to scan, and whether the newest poll did; whether it was one out of turn.
        self._scan_at = -math.inf
        self._scanned = self._extra = False

    def _take(self, clock_ms: int, sent: float, received: float) -> None:
        """Take a stamp in."""
        clock_ms = unwrap_ms(self._clock_ms, clock_ms)
        before, self._clock_ms = self._clock_ms, clock_ms
        if clock_ms == before:
            return
        if not self._tick_ms:
            if self._rhythm.count < ENOUGH:
                rhythm = heard(self._rhythm, clock_ms, 0.5 * (sent + received))
                self._rhythm = rhythm
                # Nothing is asked behind a period that is not known, or longer than ours.
                if rhythm.count >= ENOUGH and rhythm.jitter <= 0.0:
                    period_ms = round(rhythm.period * 1e3)
                    if PERIODS_MS[0] < period_ms <= self._period * 1e3:
                        self._tick_ms = period_ms
            return
        if before is not None and (clock_ms - before) % self._tick_ms:
            self._learn()  # its clock was set, or it renews its readings otherwise now
            return
        # Without room for late stamps: a late robot is asked again a moment later.
        self._clock = observe(
            self._clock, clock_ms * 1e-3, sent, received, self._drift_ppm, self._tick_ms * 1e-3
        )

    @property
    def _tick_known(self) -> bool:
        """Whether the instants of the ticks are known well enough to ask behind them."""
        clock = self._clock
        return clock.known and clock.upper - clock.lower < SHARP * self._tick_ms * 1e-3

    def _aim(self, received: float) -> None:
        """Place the next poll behind a tick, or before one if it is time to scan."""
        tick = self._tick_ms * 1e-3
        assert self._clock_ms is not None, "ticks are known by stamps"
        # When the first question that finds the newest stamp in the registers was to be sent.
        newest = self._clock.to_local(self._clock_ms * 1e-3) + BEHIND_S
        if tick > EACH_TICK * self._period:
            self._nominal = newest + tick
        # After a scan, or an answer that was long on its way, a newer reading is there already.
        # It is fetched out of turn, but not twice in a row: a slow line would never be quiet.
        old = self._scanned or received > newest + max(tick, 0.5 * self._period)
        self._extra = old and not self._extra
        earliest = received if self._extra else self._nominal
        ticks = max(1, math.ceil((earliest - newest) / tick - 1e-6))
        aim = newest + ticks * tick
        self._scanned = aim >= self._scan_at and not self._extra
        if self._scanned:
            self._scan_at = aim + SCAN_S
            # The reading before the tick has to be a new one: the same one says nothing.
            aim = newest + max(ticks, 2) * tick - BEHIND_S - self._clock.best_trip
        self.due, self.aimed = aim - self._lead, True
