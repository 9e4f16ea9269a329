r"""How old a reading is where the robot stamps its answer, not the reading: from the motion itself.

A robot that shows its plain clock answers at any time :math:`c`, with positions that it renewed
last at :math:`s \le c`. It renews them on a grid of its own clock, so period :math:`p` and phase
:math:`\varphi` tell that instant,

.. math:: s = \varphi + p \left\lfloor \frac{c - \varphi}{p} \right\rfloor .

Nobody tells :math:`p` and :math:`\varphi`. But a robot moves smoothly: with the right grid its
positions lie on a smooth curve over :math:`s`, with a wrong one they stray by speed times the error
of the instants. A cubic goes through each stretch by least squares, and the grid that leaves least
in all stretches together is the one.

A robot that stands tells less: its encoders' noise changes with each renewal and with nothing else.
Two answers with the same positions are one reading, two others are not, which leaves few grids of a
robot that renews its readings less often than it is asked.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import msgspec
import numpy as np
import numpy.typing as npt

FloatArray: TypeAlias = npt.NDArray[np.float64]

TICK_MS = 2
"""Of a controller's plain clock [src]; readings are renewed at a tick."""
PERIODS_MS = range(2 * TICK_MS, 17, TICK_MS)
"""Periods that are looked for [ms]; below that a reading's age is that of its stamp, about."""
GRIDS = ((0, 0), *((p, phase) for p in PERIODS_MS for phase in range(0, p, TICK_MS)))
"""Period and phase of each grid [ms], the stamps as they are first."""
_PERIODS, _PHASES = (np.array(column, float)[1:, None] for column in zip(*GRIDS))
STRETCH, EACH, SETTLED_EACH = 8, 1, 4
"""A curve goes through so many readings, and is drawn again each so many, once the grid is known
more seldom."""
FEWEST, ENOUGH, MOST = 3, 6, 40
"""So many curves tell a likely grid, so many a certain one; so many that show none leave the stamps
as they are."""
DEGREE = 3
"""Of the curve: what a motion of limited jerk strays from it in 0.08 s is less than what a wrong
grid leaves."""
UNKNOWN_AGE_MS, UNKNOWN_AGE_S = 4.0, 0.0023
"""Mean [ms] and standard deviation [s] of the age of a reading while nothing is known of it: of any
up to 8 ms, as most robots interpolate [src]."""
MOVES = 0.01
"""A stretch counts if its fastest joint goes on with this part of its greatest speed; below it a
wrong instant is hidden by noise. Our choice."""
PAIRS, SAME = 40, 3
"""A grid is told at rest by so many answers, so many of which gave a reading again; our choice."""
FORGET = 0.9
"""What was left before counts so much after another stretch: a robot may be set up anew."""
BETTER, LIKELY, CLEARLY = 9.0, 4.0, 2.0
"""A grid is taken that leaves so much less than the stamps as they are, and than each other one;
squares. Our choice: it happened in none of 1,000 drawn moves of a robot without a grid."""
WRONG = 2.0
"""A grid is given up that leaves so much more than the best one; squares."""


class Latch(msgspec.Struct, frozen=True):
    """When the robot renews its readings, as far as its motion has shown.

    Attributes:
        period_ms: Of the grid; 0: none is taken.
        phase_ms: Of the grid, 0 .. period.
        left: What each grid has left, the stamps as they are first; squares.
        rows: The newest readings: stamp [ms], then the joints.
        fresh: So many of them were in no stretch yet.
        drawn: So many curves were drawn.
        pairs: So many answers were compared with the one before, and so many of them were the same.
        against: How many of them speak against each grid.
        changed_ms: The stamp of the newest answer that was another one.
        settled: It is known how old the readings are: by a grid, or as their stamps say.
    """

    period_ms: int = 0
    phase_ms: int = 0
    left: tuple[float, ...] = ()
    rows: tuple[tuple[float, ...], ...] = ()
    fresh: int = 0
    drawn: int = 0
    pairs: tuple[int, int] = (0, 0)
    against: tuple[float, ...] = ()
    changed_ms: float = 0.0
    settled: bool = False

    @property
    def grid(self) -> tuple[int, int, bool]:
        """What instants are told by: another one moves them."""
        return self.period_ms, self.phase_ms, self.settled

    @property
    def period(self) -> float:
        """Of the grid [s], once it is clear which; else 0."""
        return self.period_ms * 1e-3 if self.settled else 0.0

    @property
    def doubt(self) -> float:
        """Standard deviation of a reading from its instant [s] until that is known to a tick."""
        return 0.0 if self.period_ms or self.settled else UNKNOWN_AGE_S

    def instant(self, clock_ms: float) -> float:
        """Return when the reading was renewed that came with a stamp [ms of the robot's clock]."""
        if not self.period_ms:
            return clock_ms if self.settled else clock_ms - UNKNOWN_AGE_MS
        return clock_ms - (clock_ms - self.phase_ms) % self.period_ms


def renewed(latch: Latch, clock_ms: float, q: Sequence[float], velocity: Sequence[float]) -> Latch:
    """Take one reading in.

    Args:
        latch: What is known so far.
        clock_ms: Its stamp [ms of the robot's clock].
        q: Joint positions, SI.
        velocity: Greatest speed of each joint, SI.
    """
    row = (clock_ms, *shares_of(q, velocity))
    if latch.rows and not latch.settled:
        latch = _compared(latch, latch.rows[-1], row)
    rows, fresh = (*latch.rows, row)[-STRETCH:], latch.fresh + 1
    replace = msgspec.structs.replace
    if len(rows) < STRETCH or fresh < (SETTLED_EACH if latch.settled else EACH):
        return replace(latch, rows=rows, fresh=fresh)
    latch = replace(latch, rows=rows, fresh=0)
    table = np.array(rows)
    stamps, way = table[:, 0] - table[0, 0], table[:, 1:]
    if float(np.abs(way[-1] - way[0]).max()) < MOVES * 1e-3 * stamps[-1]:
        return latch
    left = _left(table[0, 0], stamps, way)
    if latch.left:
        left += FORGET * np.array(latch.left)
    drawn = min(latch.drawn + 1, MOST)
    return _judged(replace(latch, drawn=drawn, left=tuple([float(value) for value in left])))


def shares_of(q: Sequence[float], velocity: Sequence[float]) -> tuple[float, ...]:
    """Return joint positions in parts of their joints' greatest speed [s]."""
    return tuple([position / most for position, most in zip(q, velocity)])


def cut(latch: Latch) -> Latch:
    """Return what stays known of a robot that was lost.

    No curve goes through the gap, and what it showed before says nothing against another grid: it
    may have been switched off.
    """
    return Latch(latch.period_ms, latch.phase_ms, settled=latch.settled)


def _compared(latch: Latch, before: tuple[float, ...], row: tuple[float, ...]) -> Latch:
    """Take in whether an answer gives the reading before it again."""
    replace = msgspec.structs.replace
    stamps, same = (before[0], row[0]), before[1:] == row[1:]
    if same and row[0] - latch.changed_ms > PERIODS_MS[-1]:
        # It stands so quietly that nothing changes: the same positions tell nothing.
        return replace(latch, pairs=(0, 0), against=())
    renewed_at = np.concatenate(
        [[stamps], np.array(stamps) - np.mod(np.array(stamps) - _PHASES, _PERIODS)]
    )
    against = (renewed_at[:, 0] == renewed_at[:, 1]) != same
    total = against + (np.array(latch.against) if latch.against else 0.0)
    compared, again = latch.pairs
    latch = replace(
        latch,
        pairs=(compared + 1, again + same),
        against=tuple([float(count) for count in total]),
        changed_ms=latch.changed_ms if same else row[0],
    )
    if latch.pairs[0] < PAIRS or latch.pairs[1] < SAME:
        return latch
    possible = np.flatnonzero(total == 0.0)
    # The first one is no grid: the stamps as they are.
    if len(possible) != 1 or not possible[0]:
        return latch
    period, phase = GRIDS[int(possible[0])]
    return replace(latch, settled=True, period_ms=period, phase_ms=phase)


def _judged(latch: Latch) -> Latch:
    """Take what leaves clearly least, a grid or the stamps; keep what was taken before."""
    left = np.array(latch.left)
    best = int(np.argmin(left))
    period, phase = GRIDS[best]
    others = float(np.partition(left, 1)[1])
    clear = others > CLEARLY * left[best] and (not best or left[0] > BETTER * left[best])
    taken = left[GRIDS.index((latch.period_ms, latch.phase_ms))]
    if latch.drawn < FEWEST or (latch.settled and taken <= WRONG * left[best]):
        return latch
    replace = msgspec.structs.replace
    if clear and latch.drawn >= ENOUGH:
        return replace(latch, settled=True, period_ms=period, phase_ms=phase)
    if latch.settled or latch.drawn >= MOST:
        return replace(latch, settled=True)
    # Grids of other periods that leave as little give nearly the same instants so far.
    if left[0] > LIKELY * left[best]:
        return replace(latch, period_ms=period, phase_ms=phase)
    return latch


def _left(begin: float, stamps: FloatArray, way: FloatArray) -> FloatArray:
    """Return what a cubic leaves of a stretch on each grid, shape (grids,); squares [s^2].

    Args:
        begin: The first stamp [ms].
        stamps: After the first one [ms], shape (n,).
        way: Joint positions in parts of their greatest speed [s], shape (n, joints).
    """
    age = np.zeros((len(GRIDS), len(stamps)))
    # The first row stays 0: the stamps as they are.
    age[1:] = np.mod(begin + stamps - _PHASES, _PERIODS)
    scaled = (stamps - age) / stamps[-1]
    powers = scaled[:, :, None] ** np.arange(DEGREE + 1)
    # What a cubic leaves is what an orthonormal basis does not take: one product for all.
    basis, _ = np.linalg.qr(powers)
    along = np.matmul(np.swapaxes(basis, 1, 2), way)
    rest = way - np.matmul(basis, along)
    total: FloatArray = np.sum(rest * rest, axis=(1, 2))
    return total
