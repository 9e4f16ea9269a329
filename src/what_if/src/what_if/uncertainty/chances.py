"""What may come of a motion: chances and spreads, from what came of it in many worlds."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence

import msgspec
import numpy as np

from what_if.uncertainty.spreads import Spread
from what_if.verdict import Cause, Outcome, Verdict

Z = 1.959964
"""95 of 100 of a normal distribution lie within so many deviations."""


class Tried(msgspec.Struct, frozen=True):
    """What came of a motion in one world.

    Attributes:
        causes: Why it is refused there; empty: it is not.
        collision: The first one in words; empty: there is none.
        duration_s: Time the whole takes.
        clearance_mm: The smallest; infinite if nothing moves against anything.
    """

    causes: tuple[Cause, ...]
    collision: str
    duration_s: float
    clearance_mm: float


class Chances(msgspec.Struct, frozen=True):
    """What may come of a motion.

    Attributes:
        worlds: In so many it was tried.
        seed: Of their drawing.
        collision: Share of worlds in which bodies hit each other.
        collision_low: The share of all worlds is that or more, with 97.5 of 100.
        collision_high: It is that or less, likewise.
        likeliest: What hits what most often, in words; empty: nothing does.
        refused: Share of worlds in which it is refused for any reason.
        causes: How often for which one.
        duration_s: Mean time that the whole takes.
        duration_spread_s: Standard deviation of it.
        duration_low_s: 25 of 1,000 worlds take less.
        duration_high_s: 25 of 1,000 take more.
        clearance_low_mm: 25 of 1,000 have less.
        spreads: What is not exactly known, how well, and who says so.
    """

    worlds: int
    seed: int
    collision: float
    collision_low: float
    collision_high: float
    likeliest: str
    refused: float
    causes: dict[str, int]
    duration_s: float
    duration_spread_s: float
    duration_low_s: float
    duration_high_s: float
    clearance_low_mm: float
    spreads: tuple[Spread, ...]


def tried(verdict: Verdict) -> Tried:
    """Return what of a verdict counts."""
    refusing = verdict.reasons if verdict.outcome is Outcome.REFUSED else ()
    against = [r for r in refusing if r.cause not in (Cause.SPEED, Cause.EFFORT)]
    first = next((r.text for r in against if r.cause is Cause.COLLISION), "")
    near = verdict.clearance.distance_mm if verdict.clearance else math.inf
    return Tried(tuple(r.cause for r in against), first, verdict.duration_s, near)


def chances_of(found: Sequence[Tried], spreads: Sequence[Spread], seed: int) -> Chances:
    """Count what came of a motion.

    Args:
        found: In each world; at least one.
        spreads: What was drawn.
        seed: With which seed.
    """
    hits = Counter(one.collision for one in found if one.collision)
    causes = Counter(cause.value for one in found for cause in set(one.causes))
    low, high = interval(hits.total(), len(found))
    times = np.array([one.duration_s for one in found])
    near = np.array([one.clearance_mm for one in found])
    return Chances(
        len(found),
        seed,
        hits.total() / len(found),
        low,
        high,
        hits.most_common(1)[0][0] if hits else "",
        sum(bool(one.causes) for one in found) / len(found),
        dict(sorted(causes.items())),
        float(times.mean()),
        float(times.std()),
        float(np.quantile(times, 0.025)),
        float(np.quantile(times, 0.975)),
        # The lower of two, not between them: there is no mean of a number and infinity.
        float(np.quantile(near, 0.025, method="lower")),
        tuple(spreads),
    )


def interval(hits: int, worlds: int) -> tuple[float, float]:
    r"""Return between what a share lies, with 95 of 100.

    .. math:: \frac{p + z^2/2n \mp z \sqrt{p (1 - p) / n + z^2 / 4 n^2}}{1 + z^2 / n}

    It is as wide as for random worlds; those of an even drawing lie nearer.

    Source:
        Wilson, Probable inference (1927).

    Example:
        >>> [round(share, 4) for share in interval(0, 1000)]
        [0.0, 0.0038]
    """
    p, square = hits / worlds, Z * Z / worlds
    middle = (p + 0.5 * square) / (1.0 + square)
    half = Z * math.sqrt(p * (1.0 - p) / worlds + 0.25 * square / worlds) / (1.0 + square)
    return max(0.0, middle - half), min(1.0, middle + half)


def chances_lines(found: Chances) -> list[str]:
    """Return the chances in words."""
    chance, low, high = (
        100.0 * share for share in (found.collision, found.collision_low, found.collision_high)
    )
    lines = [
        f"worlds     {found.worlds} were drawn (seed {found.seed})",
        f"collision  {chance:.1f} %, between {low:.1f} and {high:.1f} % with 95 of 100",
    ]
    if found.likeliest:
        lines.append(f"           most often: {found.likeliest}")
    others = [f"{name} in {n}" for name, n in found.causes.items() if name != Cause.COLLISION.value]
    if others:
        lines.append(
            f"refused    {100.0 * found.refused:.1f} %, besides collisions: {', '.join(others)}"
        )
    lines.append(
        f"time       {found.duration_s:.2f} s ± {found.duration_spread_s:.3f} s; 95 of 100 between "
        f"{found.duration_low_s:.2f} and {found.duration_high_s:.2f} s"
    )
    for source in dict.fromkeys(spread.source for spread in found.spreads):
        named = (spread for spread in found.spreads if spread.source == source)
        lines.append(f"drawn      {source}: {'; '.join(map(_drawn, named))}")
    return lines


def _drawn(spread: Spread) -> str:
    return f"{spread.words} ± {spread.deviation:g} {spread.unit}"
