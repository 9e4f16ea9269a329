r"""How often a robot renews its readings, and how roughly it stamps them: from its clock alone.

Readings are renewed on a grid of the robot's own clock. With the right period all of them have the
same phase, whatever was asked when:

.. math:: R_p = \left|\overline{e^{2\pi i\,c / p}}\right|

is 1 for the period itself and each part of it, and near 0 for all others. The longest period that
the readings keep is the one; how far R is from 1 tells how far a stamp is from its reading (Mardia
and Jupp, *Directional Statistics*, sec. 2.3). By chance R is as large as r with a probability of
exp(-n r^2), so rough stamps need more readings. Until then, and where they are too rough to keep a
period at all, their readings are taken to be of some age, and what their distance from our own
clock varies by tells how rough they are.
"""

from __future__ import annotations

import math
from functools import cached_property

import msgspec

PERIODS_MS = range(1, 21)
"""Periods that are looked for [ms]; interpolation periods are 2 to 8 ms, some robots give 10."""
KEPT = 24.0
"""n R^2 of a period that is kept; our choice: parts of a period must not seem kept without it."""
AS_WELL = 8.0
"""n R^2 of a multiple of that period which is kept too: all parts of a period have about the same
R. Our choice."""
ASSUMED_MS = 8
"""Most robots are no slower than this [ms]."""
ROUGH_AGE_MS = 4
"""So old readings are at most whose rough stamps keep no period [ms]; our choice: between none and
ASSUMED_MS, for the robot's clock is taken to be in the middle of what may be."""
ENOUGH = 200
"""So many readings tell the period."""
FEW, EXACT = 20, 1.0 - 1e-9
"""So few do if all of them have the same phase: of 2 ms by chance one in a million."""
FORGET, SPREAD_FORGET = 1000, 100
"""A robot may be set up anew, and its clock drifts: about so many readings count."""
JUMPED_MS = 1000.0
"""No answer is so late: a clock that goes so far at once was started anew or set; our choice."""
ROUGH_MS = 0.7
"""Less than this is not told from readings that are of some age."""
JITTERS = 1.75
"""Nearly all stamps are within so many standard deviations; those of an even jitter all are."""
CLEAR = 0.4
"""A stamp within this part of a period tells its reading from the ones beside it."""
_TURNS = [
    [(math.cos(angle), math.sin(angle)) for angle in angles]
    for angles in (
        [2.0 * math.pi * rest / period for rest in range(period)] for period in PERIODS_MS
    )
]
"""Cosine and sine of 2 pi c / p, for each p and each rest of c."""


class Rhythm(msgspec.Struct, frozen=True, dict=True):
    """What the stamps of a robot's readings have shown so far.

    It never changes, so its period is looked for once: each reading is asked for it several times.
    """

    # Readings seen, at most FORGET.
    count: int = 0
    # The clock is read beside the readings, not renewed with them.
    plain: bool = False
    # Mean cosine and sine of 2 pi c / p for each of PERIODS_MS.
    phases: tuple[tuple[float, float], ...] = ((0.0, 0.0),) * len(PERIODS_MS)
    # Mean and variance of how far its clock is ahead of ours [ms], [ms^2]: of the last ones.
    ahead: float = 0.0
    variance: float = 0.0

    @property
    def known(self) -> bool:
        """Whether enough readings have come."""
        return self.count >= ENOUGH or self._kept_ms is not None

    @property
    def period(self) -> float:
        """The time between two readings [s]; a long one is assumed while unknown.

        Readings with rough stamps that keep none are of some age; a clock of its own is of none.
        """
        if self._kept_ms is not None:
            return self._kept_ms * 1e-3
        if not self.known:
            return ASSUMED_MS * 1e-3
        if self.plain or not self._roughness_ms:
            return PERIODS_MS[0] * 1e-3
        return ROUGH_AGE_MS * 1e-3

    @cached_property
    def jitter(self) -> float:
        """Standard deviation of a stamp from its reading [s]; 0 while unknown."""
        if not self.known:
            return 0.0
        if self._kept_ms is None:
            return 1e-3 * self._roughness_ms
        period = self._kept_ms
        kept = min(math.hypot(*self.phases[period - PERIODS_MS[0]]), 1.0)
        # The stamps are whole milliseconds: what rounding leaves of R = 1 is no jitter.
        if kept > EXACT:
            return 0.0
        return period * 1e-3 * math.sqrt(-2.0 * math.log(max(kept, 1e-9))) / (2.0 * math.pi)

    @property
    def corrects(self) -> bool:
        """Whether a stamp tells its reading's instant: it is rough, but by less than a period."""
        return self._kept_ms is not None and 0.0 < self.roughness <= CLEAR * self.period

    def instant(self, clock_ms: int) -> float:
        """Return the instant of the reading that is stamped so [ms of the robot's clock].

        The nearest one of the grid on which all readings lie, where the stamps are rough.
        """
        period = self._kept_ms
        if period is None or not self.corrects:
            return float(clock_ms)
        cosine, sine = self.phases[period - PERIODS_MS[0]]
        off = clock_ms - period * math.atan2(sine, cosine) / (2.0 * math.pi)
        return clock_ms - (off - period * round(off / period))

    @property
    def roughness(self) -> float:
        """How far a stamp may be from its reading, nearly always [s]; 0 while unknown."""
        return JITTERS * self.jitter

    @property
    def spread(self) -> float:
        """How far what :meth:`instant` gives may be from the reading [s]."""
        return 0.0 if self.corrects else self.roughness

    @property
    def _roughness_ms(self) -> float:
        """How far stamps vary beyond their rounding, age included [ms]; 0: not enough to tell."""
        # Rounding to whole milliseconds alone gives a variance of 1/12.
        excess = self.variance - 1.0 / 12.0
        return math.sqrt(excess) if excess > ROUGH_MS**2 else 0.0

    @cached_property
    def _kept_ms(self) -> int | None:
        """The period that the readings keep [ms]; None if they keep none, or it is not known."""
        kept = {p: math.hypot(*phase) for p, phase in zip(PERIODS_MS, self.phases) if p > 1}
        exact = [p for p, r in kept.items() if r >= EXACT]
        if exact and self.count >= FEW:
            return max(exact)
        base = max(kept, key=lambda p: kept[p])
        if self.count < ENOUGH or kept[base] < math.sqrt(KEPT / self.count):
            return None
        least = math.sqrt(AS_WELL / self.count)
        return max(p for p, r in kept.items() if p % base == 0 and r >= least)


def heard(rhythm: Rhythm, clock_ms: int, at: float, plain: bool = False) -> Rhythm:
    """Take the stamp of one new reading in.

    Args:
        rhythm: What is known so far.
        clock_ms: The stamp [ms of the robot's clock].
        at: Our time half-way between question and answer [s].
        plain: It is the clock's own, not that of the reading beside it.
    """
    ahead = clock_ms - 1e3 * at
    off = ahead - rhythm.ahead if rhythm.count else 0.0
    if abs(off) > JUMPED_MS:
        rhythm = Rhythm()
    count = min(rhythm.count + 1, FORGET)
    phases = []
    for turns, (cosine, sine) in zip(_TURNS, rhythm.phases):
        along, across = turns[clock_ms % len(turns)]
        phases.append((cosine + (along - cosine) / count, sine + (across - sine) / count))
    if not rhythm.count:
        return Rhythm(count, plain, tuple(phases), ahead)
    part = 1.0 / min(count, SPREAD_FORGET)
    variance = (1.0 - part) * (rhythm.variance + part * off * off)
    return Rhythm(count, plain, tuple(phases), rhythm.ahead + part * off, variance)
