"""The first week of each cycle that a robot does again and again, and what has changed since.

A cycle is the same again where leader, program and joints are, and each joint goes as far, as
fast and for as long as before. What is done once, such as jogging, has a place until another one
needs it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import msgspec
import numpy as np

from twin_analysis.health.live.taking import HeardCycle
from twin_analysis.health.signs import Array, CycleSignals, Signs, TorqueError
from twin_analysis.health.trend import (
    LEAST,
    RECENT,
    Baseline,
    Finding,
    JointFacts,
    Monitor,
)

MOST_CYCLES, MOST_KINDS = 200, 8
"""Of a first week, and of different cycles, that are kept. Our choice."""
SAME, SAME_RANGE, SAME_S = 0.1, 0.01, 1.0
"""The same cycle again goes as far as before but for this part, or this part of the joint's range;
and takes as long but for this part, or so long. Our choice."""
PACE_S = 0.1
"""How fast a joint goes is looked at over so long: noise counts less. Our choice."""
DAY_S = 24 * 3600.0
"""So much of the time between two cycles counts for a first week: a robot that stood for longer, or
a clock that was set meanwhile, makes no week. Our choice."""

Numbers = list[float | None]


class KeptSigns(msgspec.Struct, frozen=True):
    """Signs of one cycle, as they are kept; null: nothing is known."""

    time: float
    forward: Numbers
    backward: Numbers
    coulomb: Numbers
    inertia: Numbers
    lag: Numbers
    play: Numbers
    vacuum_s: float | None


class CycleShape(msgspec.Struct, frozen=True):
    """What a cycle does.

    Attributes:
        leader, program: Who led, and by what.
        names: Of the joints.
        seconds: From its first to its last motion.
        spans: From end to end of what each joint goes [rad or m].
        paces: Mean speed of each [rad/s or m/s].
    """

    leader: str
    program: str
    names: list[str]
    seconds: float
    spans: list[float]
    paces: list[float]


class CycleKind(msgspec.Struct, frozen=True):
    """One cycle that comes again.

    Attributes:
        shape: Of the first one.
        week: The first week's.
        complete: Whether the first week is over.
        recent: The newest ones behind it.
    """

    shape: CycleShape
    week: list[KeptSigns]
    complete: bool = False
    recent: list[KeptSigns] = []

    @property
    def newest(self) -> float:
        """When it was seen last [s]."""
        return (self.recent or self.week)[-1].time

    def until(self, now: float) -> CycleKind:
        """Return it with nothing later than ``now`` [s]: the clock was ahead, and was set back.

        When a cycle was is not known then; what it said counts all the same.
        """
        week, recent = (
            [msgspec.structs.replace(each, time=min(each.time, now)) for each in rows]
            for rows in (self.week, self.recent)
        )
        return msgspec.structs.replace(self, week=week, recent=recent)


class Weeks(msgspec.Struct, frozen=True):
    """All that is kept of a robot; a file holds it."""

    kinds: list[CycleKind] = []


@dataclass(frozen=True)
class KindVerdict:
    """What is known of the cycle that was taken last.

    Attributes:
        kind: It, with what is kept of it.
        finding: What has changed.
        left_out: Joints that stood in its first week, in words.
        compared: Enough cycles were held against the first week to find a change.
    """

    kind: CycleKind
    finding: Finding | None = None
    left_out: str = ""
    compared: bool = False


def shape_of(
    heard: HeardCycle, joints: JointFacts, names: tuple[str, ...], cycle: CycleSignals
) -> CycleShape:
    """Return what a cycle does."""
    step = max(1, round(PACE_S / float(np.median(np.diff(cycle.times)))))
    ways = np.abs(np.diff(cycle.measured[::step], axis=0))
    dt = float(cycle.times[step] - cycle.times[0])
    slow = SAME_RANGE * dt * joints.of(names).fastest
    moves = np.flatnonzero((ways > slow).any(axis=1))
    seconds = dt * float(moves[-1] - moves[0] + 1) if len(moves) else dt
    return CycleShape(
        heard.leader,
        heard.program,
        list(names),
        seconds,
        np.ptp(cycle.measured, axis=0).tolist(),
        (ways.sum(axis=0) / seconds).tolist(),
    )


def is_same(a: CycleShape, b: CycleShape, joints: JointFacts) -> bool:
    """Return whether two cycles are the same one.

    Args:
        a: The one.
        b: The other one.
        joints: Those of ``a``.
    """
    if (a.leader, a.program, a.names) != (b.leader, b.program, b.names):
        return False
    if abs(a.seconds - b.seconds) > max(SAME_S, SAME * a.seconds):
        return False
    spans, paces = np.array([a.spans, b.spans]), np.array([a.paces, b.paces])
    near = np.abs(np.diff(spans, axis=0)) <= np.maximum(SAME * spans[0], SAME_RANGE * joints.ranges)
    slow = SAME_RANGE * joints.fastest
    as_fast = np.abs(np.diff(paces, axis=0)) <= np.maximum(SAME * paces[0], slow)
    return bool(near.all() and as_fast.all())


def with_cycle(
    weeks: Weeks, joints: JointFacts, shape: CycleShape, signs: KeptSigns, week_s: float
) -> tuple[Weeks, KindVerdict]:
    """Take a cycle in; return what is kept from now on, and what is known of this cycle.

    Args:
        weeks: What is kept.
        joints: All of the robot's.
        shape: What the cycle does.
        signs: What it says.
        week_s: How long a first week is [s].
    """
    own = joints.of(shape.names)
    kinds = [kind.until(signs.time) for kind in weeks.kinds]
    same = [kind for kind in kinds if is_same(kind.shape, shape, own)]
    kind = same[0] if same else CycleKind(shape, [])
    if same:
        kinds.remove(kind)
    elif len(kinds) >= MOST_KINDS:
        # One whose first week is not over gives way before one that is watched.
        kinds.remove(min(kinds, key=lambda each: (each.complete, each.newest)))
    if kind.complete:
        kind = msgspec.structs.replace(kind, recent=[*kind.recent, signs][-RECENT:])
    else:
        # The first ones stay: they are the healthy robot's.
        week = [*kind.week, signs][:MOST_CYCLES]
        gaps = np.diff([each.time for each in (*kind.week, signs)])
        # A full week keeps none that comes later: the time since its last one counts whole.
        between, since = gaps[: MOST_CYCLES - 1], gaps[MOST_CYCLES - 1 :]
        lasted = float(np.clip(between, 0.0, DAY_S).sum() + since.sum())
        over = len(week) >= LEAST and lasted >= week_s
        kind = msgspec.structs.replace(kind, week=week, complete=over)
    return Weeks([*kinds, kind]), judged(kind, joints)


def judged(kind: CycleKind, joints: JointFacts) -> KindVerdict:
    """Return what is known of a cycle by what is kept of it."""
    if not kind.complete:
        return KindVerdict(kind)
    own, finding = joints.of(kind.shape.names), None
    week = [signs_from(each) for each in kind.week]
    try:
        base = Baseline(own, week)
    except TorqueError as error:
        return KindVerdict(kind, None, str(error))
    monitor = Monitor(base)
    for each in kind.recent:
        finding = monitor.take(signs_from(each))
    return KindVerdict(kind, finding, base.left_out, len(kind.recent) >= RECENT)


def kept_signs(time: float, signs: Signs) -> KeptSigns:
    """Return signs as they are kept; ``time`` is Unix time [s]."""

    def kept(values: Array) -> Numbers:
        return [value if math.isfinite(value) else None for value in values.tolist()]

    return KeptSigns(
        time,
        kept(signs.forward),
        kept(signs.backward),
        kept(signs.coulomb),
        kept(signs.inertia),
        kept(signs.lag),
        kept(signs.play),
        signs.vacuum_s if math.isfinite(signs.vacuum_s) else None,
    )


def signs_from(kept: KeptSigns) -> Signs:
    """Return signs that were kept."""
    forward, backward, coulomb, inertia, lag, play = (
        # numpy makes NaN of None.
        np.array(row, dtype=np.float64)
        for row in (
            *(kept.forward, kept.backward, kept.coulomb),
            *(kept.inertia, kept.lag, kept.play),
        )
    )
    vacuum_s = math.nan if kept.vacuum_s is None else kept.vacuum_s
    return Signs(forward, backward, coulomb, inertia, lag, play, vacuum_s)
