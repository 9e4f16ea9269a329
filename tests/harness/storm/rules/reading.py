"""Read a history: motions, ways, and the times at which somebody else is to blame."""

from __future__ import annotations

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from harness.scenes.truth import Row
from harness.storm.rules.history import SIDES, Deed, History, Joint

STILL = 0.004
"""A joint slower than this part of its greatest speed stands."""
REST_S = 0.25
"""A side that stood for so long has come to rest: what follows is another motion."""
ENDS_A_PROGRAM = ("pendant abort",)
"""Stops that end what runs and do not stay."""
JUST_BEFORE_S = 0.05
"""A side that moved so shortly before an abort has been ended by it."""
PUBLISHED_S = 0.03
"""A decision is published so long after it was carried out, at most."""
ALIGNED_S = 0.3
"""The twin comes to rest within this after its alignment has ended."""


@dataclass(frozen=True)
class Motion:
    """One motion between two rests, its largest way [deg or mm] and whose it is."""

    begin: float
    end: float
    way: float
    joint: str


def between(rows: Sequence[Row], begin: float, end: float = math.inf) -> Sequence[Row]:
    """Return the rows within [begin, end]."""
    first = bisect_left(rows, begin, key=lambda row: row[0])
    return rows[first : bisect_right(rows, end, key=lambda row: row[0])]


def lives(history: History, side: str) -> list[Sequence[Row]]:
    """Return the rows of a side in parts: a side that is started again stands elsewhere."""
    edges = [-math.inf, *sorted(history.births.get(side, ())), math.inf]
    rows = history.truth[side]
    parts = [between(rows, a, math.nextafter(b, -math.inf)) for a, b in pairwise(edges)]
    return [part for part in parts if part]


def share(row: Row, joints: Sequence[Joint]) -> float:
    """Return the largest speed of a joint as a part of its greatest."""
    return max(abs(speed) / joint.velocity for speed, joint in zip(row[2], joints))


def way(rows: Sequence[Row], joints: Sequence[Joint]) -> tuple[float, str]:
    """Return how far a joint went [deg or mm], at most, and which."""
    if not rows:
        return 0.0, ""
    columns = list(zip(*(row[1] for row in rows)))
    ways = [((max(q) - min(q)) / joint.scale, joint.name) for q, joint in zip(columns, joints)]
    return max(ways)


def first_beyond(rows: Sequence[Row], limit: float, joints: Sequence[Joint]) -> float:
    """Return when a joint was first further than ``limit`` [deg or mm] from the first row."""
    for at, q, _ in rows:
        ways = (abs(b - a) / joint.scale for a, b, joint in zip(rows[0][1], q, joints))
        if max(ways) > limit:
            return at
    return rows[-1][0]


def motions(rows: Sequence[Row], joints: Sequence[Joint]) -> list[Motion]:
    """Return the motions of one life, each between two rests."""
    moving = [row[0] for row in rows if share(row, joints) > STILL]
    if not moving:
        return []
    cuts = [k for k, (a, b) in enumerate(pairwise(moving), 1) if b - a > REST_S]
    found = []
    for first, last in pairwise([0, *cuts, len(moving)]):
        begin, end = moving[first], moving[last - 1]
        found.append(Motion(begin, end, *way(between(rows, begin, end), joints)))
    return found


def ramp(rows: Sequence[Row], at: float, joints: Sequence[Joint]) -> float:
    """Return how long a side needs to stand, from its speed at ``at`` [s]."""
    before = between(rows, at - 0.2, at)
    if not before:
        return 0.0
    speeds = zip(before[-1][2], joints)
    return max(abs(v) / joint.acceleration + joint.acceleration / joint.jerk for v, joint in speeds)


def reached(history: History, side: str, at: float) -> float:
    """Return from when on a stop of ``at`` can have reached a side: no fault hinders it then."""
    for strike in sorted(history.strikes, key=lambda strike: strike.begun):
        until = strike.ended + strike.grace.get(side, -math.inf)
        if strike.begun <= at + REST_S and until > at:
            at = until
    return at


def stops(history: History, deed: Deed) -> bool:
    """Return whether a deed was a stop, acknowledged, with something to end.

    An abort at the pendant ends the robot's program. While both sides stand there is none to end,
    and the robot does as it will with the next one: hold and emergency stop stay, an abort does
    not.
    """
    if deed.kind != "stop" or not deed.acknowledged:
        return False
    if deed.name not in ENDS_A_PROGRAM:
        return True
    return any(
        share(row, history.joints) > STILL
        for side in SIDES
        for row in between(history.truth[side], deed.sent - JUST_BEFORE_S, deed.sent)
    )


def aligning(history: History) -> list[tuple[float, float]]:
    """Return when the twin went to the robot's pose by the controller's own decision."""
    found = []
    begun: float | None = None
    for decided in history.decisions:
        if begun is None and decided.after == "ALIGNING":
            begun = decided.at - PUBLISHED_S
        elif begun is not None and decided.after != "ALIGNING":
            found.append((begun, decided.at + ALIGNED_S))
            begun = None
    return found if begun is None else [*found, (begun, math.inf)]


def without(
    rows: Sequence[Row], begin: float, end: float, holes: Sequence[tuple[float, float]]
) -> list[Sequence[Row]]:
    """Return the rows within [begin, end] in the parts that lie outside the holes."""
    parts = []
    for a, b in sorted(holes):
        if b <= begin or a >= end:
            continue
        parts.append(between(rows, begin, a))
        begin = b
    return [part for part in (*parts, between(rows, begin, end)) if part]
