r"""How fast a robot that stands beside a zone may begin to move.

A start is seen some milliseconds after it, and its speed and gain are known only samples later. So
close to a zone a stop alone comes too late, and the robot's override is lowered before anything
moves: a robot that begins in the worst direction, gains all the speed it can in the time
:math:`t_d` until it brakes, and then brakes, must still stand before the zone.
"""

from __future__ import annotations

import msgspec
from scara_config import KeepOut
from scara_control.keep_out.zones import point_may_reach

from twin_controller.core.events import Joints
from twin_controller.core.setup import Setup

LEAST_PERCENT = 2
"""Slower than this nothing can be told of a direction; nearer to a zone it helps no more."""


class Beside(msgspec.Struct, frozen=True):
    """Where the robot stood last, and the part of the joints' largest speed it may begin with."""

    share: float = 1.0
    # Since when it stands there [s], and the zones at that time: judged once for each standstill.
    since: float | None = None
    zones: tuple[KeepOut, ...] = ()


def judge_start(setup: Setup, beside: Beside, q: Joints, since: float) -> Beside:
    """Judge where the robot stands, unless that has been done.

    Args:
        setup: Profile and numbers.
        beside: As judged before.
        q: Where it stands, SI.
        since: Since when [s].
    """
    zones = setup.keep_out
    if beside.since == since and beside.zones is zones:
        return beside
    return Beside(start_share(setup, q), since, zones)


def start_share(setup: Setup, q: Joints) -> float:
    """Return the part of the joints' largest speed from which no start ends in a zone.

    In whole percent, and 1 far from zones: a robot there is not slowed.
    """
    if not _may_enter(setup, q, 1.0):
        return 1.0
    low, high = LEAST_PERCENT, 100
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if _may_enter(setup, q, middle * 1e-2) else (middle, high)
    return low * 1e-2


def _may_enter(setup: Setup, q: Joints, share: float) -> bool:
    """Return whether a start at ``share`` of the largest speeds may end in a zone."""
    ways = start_ways(setup, share)
    return any(point_may_reach(point, q, ways, setup.keep_out) for point in setup.points)


def start_ways(setup: Setup, share: float) -> Joints:
    r"""Return how far each joint comes from rest until it stands again, SI.

    With the jerk :math:`j` up to the acceleration :math:`a`, but no faster than
    :math:`p \dot q_{max}`, for the time :math:`t_d`; then it brakes.

    Args:
        setup: Profile and numbers.
        share: Part of the largest speeds, :math:`p`.
    """
    rows = zip(setup.velocity, setup.acceleration, setup.jerk, setup.braking)
    return tuple(_start_way(share * v, a, j, b, setup.braking_delay) for v, a, j, b in rows)


def _start_way(most: float, quickest: float, jerk: float, braking: float, delay: float) -> float:
    rising = min(delay, quickest / jerk)
    steady, gained = delay - rising, 0.5 * jerk * rising**2
    way = jerk * rising**3 / 6.0 + gained * steady + 0.5 * jerk * rising * steady**2
    reached = min(gained + jerk * rising * steady, most)
    return min(way, most * delay) + reached**2 / (2.0 * braking)
