"""The rules of limits: range, speed, and the share that a robot that follows may use."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise

from harness.scenes.truth import Row
from harness.storm.rules.history import SIDES, History, Joint, Violation
from harness.storm.rules.reading import REST_S, between, lives
from harness.storm.rules.servo import fastest

RANGE_DEG_MM = 0.15
"""What a joint may show beyond its range: a servo that settles at its end."""
SPEED = 1.02
"""What a joint may show beyond its speed."""
SPAN_S = 0.018
"""Speeds by positions are taken over so long at least."""
PATH_SPEED = 1.05
"""What positions may show beyond the speed: rounding over ``SPAN_S``."""
FOLLOWS, MEASURING = 0.80, 0.01
"""What a robot that follows is told at most, and what measuring may add."""
TURNS_S = 0.3
"""So shortly before it may have gone the other way: the drive has both speeds to get over."""
TAKES_OVER_S = 0.1
"""A robot that begins on its own is seen to lead within this."""


def beyond_limits(history: History) -> Iterator[Violation]:
    """No joint leaves its range or is faster than it may be."""
    for side in SIDES:
        for life in lives(history, side):
            yield from _grouped(side, "a joint beyond its range", _out_of_range(history, life))
            yield from _grouped(side, "a joint beyond its speed", _too_fast(history, life))


Finding = tuple[float, float, str]
"""When, by how much, in words."""


def _out_of_range(history: History, life: Sequence[Row]) -> Iterator[Finding]:
    for at, q, _ in life:
        for value, joint in zip(q, history.joints):
            over = max(joint.lower - value, value - joint.upper) / joint.scale
            if over > RANGE_DEG_MM:
                yield at, over, f"{joint.name} is {over:.2f} deg or mm beyond its range"


def _too_fast(history: History, life: Sequence[Row]) -> Iterator[Finding]:
    for at, _, qdot in life:
        for speed, joint in zip(qdot, history.joints):
            part = abs(speed) / joint.velocity
            if part > SPEED:
                yield at, part, f"{joint.name} says {100 * part:.1f} % of its speed"
    before = 0
    for k, (at, q, _) in enumerate(life):
        while before + 1 < k and at - life[before + 1][0] >= SPAN_S:
            before += 1
        span = at - life[before][0]
        if span < SPAN_S:
            continue
        for joint, part in zip(history.joints, _parts(life[before][1], q, span, history.joints)):
            if part > PATH_SPEED:
                yield at, part, f"{joint.name} goes at {100 * part:.1f} % of its speed"


def _parts(
    before: Sequence[float], now: Sequence[float], span: float, joints: Sequence[Joint]
) -> list[float]:
    """Return the speed of each joint by its positions, as a part of its greatest."""
    return [abs(b - a) / span / joint.velocity for a, b, joint in zip(before, now, joints)]


def _grouped(side: str, rule: str, found: Iterator[Finding]) -> Iterator[Violation]:
    """Yield one violation for findings that follow each other, with the worst of them."""
    group: list[Finding] = []
    for finding in sorted(found):
        if group and finding[0] - group[-1][0] > REST_S:
            yield _worst(side, rule, group)
            group = []
        group.append(finding)
    if group:
        yield _worst(side, rule, group)


def _worst(side: str, rule: str, group: list[Finding]) -> Violation:
    words = max(group, key=lambda finding: finding[1])[2]
    return Violation(rule, group[0][0], group[-1][0], f"{side}: {words}")


def above_eighty(history: History) -> Iterator[Violation]:
    """The robot stays at 80 % when it follows, and at what its own drive makes of 80 %.

    It is told no more; a drive that takes more acceleration than its motor has overshoots.
    """
    for begin, end in following(history):
        over = [
            (part, row[0])
            for life in lives(history, "real")
            for row in between(life, begin, end)
            for part, allowed in _speeds(history, life, row)
            if part > allowed
        ]
        if over:
            yield Violation(
                "the robot above 80 % while it follows",
                min(at for _, at in over),
                max(at for _, at in over),
                f"real: {100 * max(over)[0]:.1f} % of a joint's speed",
            )


def _speeds(history: History, life: Sequence[Row], row: Row) -> Iterator[tuple[float, float]]:
    """Yield the speed of each joint above 80 %, and with what it may have been told no more."""
    for k, joint in enumerate(history.joints):
        part = row[2][k] / joint.velocity
        if abs(part) <= FOLLOWS + MEASURING:
            continue
        lately = between(life, row[0] - TURNS_S, row[0])
        other = min(math.copysign(qdot[k], qdot[k] * part) for _, _, qdot in lately)
        before = max(min(other / joint.velocity, 0.0), -FOLLOWS)
        yield abs(part), fastest(joint, FOLLOWS, round(before, 2)) + MEASURING


def following(history: History) -> list[tuple[float, float]]:
    """Return when the robot followed twin or operator by the controller's decisions.

    A start on the robot's own pendant, or a controller that is gone, ends it.
    """
    own = [deed for deed in history.deeds if deed.kind == "motion" and deed.sides == ("real",)]
    others = [deed.sent for deed in own]
    others += [strike.begun for strike in history.strikes if "twin_controller" in strike.name]
    found = []
    for decision, after in pairwise([*history.decisions, None]):
        if decision is None or decision.leader not in ("twin", "operator"):
            continue
        end = math.inf if after is None else after.at
        if after is not None and after.leader == "real":
            end -= TAKES_OVER_S
        end = min([end, *(at for at in others if at > decision.at)])
        found.append((decision.at, end))
    return found
