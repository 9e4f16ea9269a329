r"""Bound a remote clock's offset by intervals.

A remote clock reads :math:`c` at some instant between sending the question (:math:`s`) and
receiving the answer (:math:`r`), and its value may be up to one sample period :math:`p` old.
And it is younger than the answer before, which was asked for at :math:`s'` and did not hold it.
Therefore the offset remote - local obeys

.. math:: c - r \le \theta \le c - \max(s - p, s') .

The intersection of these intervals over time, widened by the largest possible drift, holds the
true offset; its half width is the uncertainty. The lower bound is hard: no answer holds a time that
has not been yet. The upper one is soft: a remote that was late to renew its reading answers with an
older one, so the interval is never narrower than the shortest round trip, and a small conflict
costs the upper bound; a large one, or one that stays, means that a clock jumped, and the estimate
starts again. What a remote needs to bring a reading into its registers cannot be seen from outside:
it is a constant of the profile.
"""

from __future__ import annotations

import msgspec

SLEW, SETTLED = 0.005, 50
"""The offset goes to the middle no faster than this [s/s], once so many samples have told it: a
bound that comes or goes would jerk whatever is asked for by that clock. Our choice."""
DRIFT_SPAN = 30.0
"""Below this span [s] the first sample's uncertainty hides the drift, and 0 is shown."""


class ClockTolerance(msgspec.Struct, frozen=True):
    """How late a remote's readings may be before its clock counts as set anew."""

    # A conflict larger than this [s] is a jump of a clock. A smaller one is a reading that came
    # late, as on a busy machine: its stamp says how old it is, and old data are not followed.
    jump: float = 0.1
    # So many conflicts in a row are a jump too.
    lasting: int = 50


STRICT = ClockTolerance()


class ClockEstimate(msgspec.Struct, frozen=True):
    """Interval that holds the offset remote - local [s] at local time ``at``."""

    lower: float = -float("inf")
    upper: float = float("inf")
    at: float = 0.0
    # Since the last jump; a side counts as known after some.
    samples: int = 0
    jumps: int = 0
    # Contradictions in a row: a reading that is late is one, a clock that was set gives no others.
    conflicts: int = 0
    # By how much the newest reading contradicts the interval [s]; 0 once one agrees again.
    doubt: float = 0.0
    round_trip: float = 0.0
    best_trip: float = 0.0
    first_offset: float = 0.0
    first_at: float = 0.0
    # Where the offset was last, inside the interval or beside it; None: in its middle.
    held: float | None = None

    @property
    def known(self) -> bool:
        """Whether any sample has come."""
        return self.samples > 0

    @property
    def offset(self) -> float:
        """Remote - local [s], near the middle of the interval; 0 while unknown."""
        if self.samples <= 0:
            return 0.0
        if self.held is None:
            return 0.5 * (self.lower + self.upper)
        return min(max(self.held, self.lower), self.upper)

    @property
    def uncertainty(self) -> float:
        """To the farther bound, and the newest reading's doubt [s]; infinite while unknown."""
        if not self.known:
            return float("inf")
        offset = self.offset
        return max(self.upper - offset, offset - self.lower) + self.doubt

    @property
    def drift_ppm(self) -> float:
        """Mean drift of the remote clock since the first sample after a jump [ppm]."""
        span = self.at - self.first_at
        return (self.offset - self.first_offset) / span * 1e6 if span > DRIFT_SPAN else 0.0

    def to_local(self, remote: float) -> float:
        """Convert a remote stamp to local time [s]."""
        return remote - self.offset

    def to_remote(self, local: float) -> float:
        """Convert a local time to the remote clock [s]."""
        return local + self.offset


def observe(
    estimate: ClockEstimate,
    remote: float,
    sent: float,
    received: float,
    drift_ppm: float,
    period: float = 0.0,
    latency: float = 0.0,
    jitter: float = 0.0,
    patience: ClockTolerance = STRICT,
    since: float = -1e9,
) -> ClockEstimate:
    """Intersect the estimate with one more observation.

    Args:
        estimate: What is known so far.
        remote: Remote clock's reading [s].
        sent: Local time before the question [s].
        received: Local time after the answer [s].
        drift_ppm: Largest drift between the two clocks.
        period: How often the remote renews its reading [s].
        latency: Age of a reading when it becomes visible [s].
        jitter: How far a reading's stamp may be from its instant [s].
        patience: What counts as a late reading, not as a jump.
        since: Local time at which an answer without this reading was asked for [s].

    Returns:
        The narrower estimate; a fresh one if the clock jumped.
    """
    lower = remote - jitter + latency - received
    upper = remote + jitter + latency - max(sent - period, since)
    trip = received - sent
    if estimate.known:
        widened = abs(received - estimate.at) * drift_ppm * 1e-6
        low, high = max(estimate.lower - widened, lower), min(estimate.upper + widened, upper)
        # Intervals that do not meet: one of the readings was late, or a clock was set.
        doubt = max(0.0, low - high)
        conflicts = estimate.conflicts + 1 if doubt > 0.0 else 0
        if doubt < patience.jump and conflicts < patience.lasting:
            best = min(trip, estimate.best_trip + widened)
            # A late reading only moves the upper bound: keep room for the shortest trip above it.
            if period > 0.0 or conflicts:
                high = max(high, low + best)
            held = None
            if estimate.samples >= SETTLED:
                most = SLEW * abs(received - estimate.at)
                before = estimate.offset
                off = 0.5 * (low + high) - before
                held = before + min(max(off, -most), most)
            return ClockEstimate(
                lower=low,
                upper=high,
                held=held,
                at=received,
                samples=estimate.samples + 1,
                jumps=estimate.jumps,
                conflicts=conflicts,
                doubt=doubt,
                round_trip=trip,
                best_trip=best,
                first_offset=estimate.first_offset,
                first_at=estimate.first_at,
            )
    middle = 0.5 * (lower + upper)
    jumps = estimate.jumps + (1 if estimate.known else 0)
    return ClockEstimate(
        lower,
        upper,
        received,
        1,
        jumps,
        round_trip=trip,
        best_trip=trip,
        first_offset=middle,
        first_at=received,
    )


def widen(estimate: ClockEstimate, by: float) -> ClockEstimate:
    """Return the estimate with bounds that are ``by`` [s] further out."""
    return msgspec.structs.replace(estimate, lower=estimate.lower - by, upper=estimate.upper + by)


def unwrap_ms(previous: int | None, clock_ms: int) -> int:
    """Continue a millisecond counter across its wrap.

    Args:
        previous: The last unwrapped value, or None.
        clock_ms: The counter as read, 0 .. 2^31 - 1.

    Returns:
        The unwrapped value nearest to ``previous``, so that a step back stays a step back.
    """
    if previous is None:
        return clock_ms
    span = 1 << 31
    step = (clock_ms - previous) % span
    if step >= span // 2:
        step -= span
    return previous + step
