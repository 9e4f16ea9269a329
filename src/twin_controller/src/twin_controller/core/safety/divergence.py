"""The alarms when real robot and twin come apart: beside each other's path, or late on it.

While moving, the distance of the real tool from the twin's recent path counts: a follower that is
late but on the path does not diverge. At rest, the plain distance counts. How far the tools are
apart at the same instant has a limit of its own, which only tells.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache, partial
from itertools import pairwise

import msgspec
from scara_control.joint_motion import JointMotion
from scara_control.kinematics.screws import Point, ScrewModel, tool_position

from twin_controller.config import Divergence
from twin_controller.core.events import Joints
from twin_controller.core.setup import Setup
from twin_controller.core.sides import change
from twin_controller.core.sides.pairing import paired
from twin_controller.core.sides.side import Sides

SLOWEST_M_S = 0.05
"""A tool slower than this is not late by a time [m/s]; our choice."""
NEW_SHARE = 0.1
"""Share of the newest sample in the mean delay: at 100 Hz a mean of about 0.1 s; our choice."""
MOST = 1e6
"""A joint faster than this is none [rad/s or m/s]; our choice."""
GLANCE_S = 1e-3
"""How far ahead a tool's velocity is taken from its joints' [s]; our choice."""


class DivergenceState(msgspec.Struct, frozen=True):
    """Last checks and the alarm; distances in mm."""

    recent: tuple[bool, ...] = ()
    alarm: bool = False
    distance_mm: float = 0.0


class DelayState(msgspec.Struct, frozen=True):
    """How far the tools are apart at the same instant, lag and all.

    Attributes:
        judged: Checks and alarm of that distance.
        late: So much time the real robot is behind the twin on its way, negative: ahead of it [s].
            A mean, kept while the tools are too slow to tell.
    """

    judged: DivergenceState = DivergenceState()
    late: float = 0.0


def path_distance(point: Point, path: Sequence[Point]) -> float:
    """Return the distance [m] of ``point`` from the polyline ``path``, one corner at least."""
    nearest = math.dist(point, path[0])
    px, py, pz = point
    for (ax, ay, az), (bx, by, bz) in pairwise(path):
        sx, sy, sz = bx - ax, by - ay, bz - az
        length = sx * sx + sy * sy + sz * sz
        if length == 0.0:
            continue  # the path stands still here: the corner is that of its neighbours
        part = ((px - ax) * sx + (py - ay) * sy + (pz - az) * sz) / length
        part = min(max(part, 0.0), 1.0)
        foot = (ax + part * sx, ay + part * sy, az + part * sz)
        nearest = min(nearest, math.dist(point, foot))
    return nearest


@lru_cache(maxsize=1024)
def _tool(arm: ScrewModel, columns: tuple[int, ...], q: Joints) -> Point:
    """Return where the tool is [m]; kept, since each sample of a path counts many times."""
    return tool_position(arm, [q[column] for column in columns])


def judge(
    state: DivergenceState, distance: float, limit_mm: float, config: Divergence
) -> DivergenceState:
    """Count one check, k of n with hysteresis.

    Args:
        state: The last checks.
        distance: Distance of the tools [m].
        limit_mm: The limit that holds now (path or rest).
        config: confirm, window, release_ratio.
    """
    distance_mm = distance * 1e3
    # The alarm ends below a part of its limit: at the limit it would come and go with the noise.
    limit = limit_mm * (config.release_ratio if state.alarm else 1.0)
    recent = (*state.recent, distance_mm > limit)[-config.window :]
    count = sum(recent)
    alarm = count > 0 if state.alarm else count >= config.confirm
    return DivergenceState(recent, alarm, distance_mm)


def judge_divergence(
    setup: Setup, state: DivergenceState, sides: Sides, streams: bool = False
) -> DivergenceState:
    """Compare the tools, once for each sample of the twin.

    Args:
        setup: Profile and numbers.
        state: The last checks.
        sides: Both sides.
        streams: The real robot follows the twin.
    """
    config = setup.config.divergence
    if not sides.real.history or len(sides.twin.history) < 2:
        return state
    real = sides.real.last
    reach = config.history_ms * 1e-3
    rows = [sample.q for sample in sides.twin.history if abs(sample.time - real.time) <= reach]
    if not rows:
        return state
    tool = partial(_tool, setup.arm, setup.arm_columns)
    still = all(
        [
            change.stands_still(side.change, real.time, setup.config.change)
            for side in (sides.real, sides.twin)
        ]
    )
    # What noise alone may bring is no divergence.
    least = change.NOISES * math.hypot(sides.real.noise, sides.twin.noise) * setup.tool_per_noise
    if still:
        apart = math.dist(tool(real.q), tool(rows[-1]))
        return judge(state, apart, max(config.rest_mm, least), config)
    # A robot that follows is aimed ahead of the twin: the way that the twin will take counts too.
    if streams and sides.twin.plan is not None:
        rows += [point.q for point in sides.twin.plan.setpoints.points]
    distance = path_distance(tool(real.q), [tool(q) for q in rows])
    return judge(state, distance, max(config.path_mm, least), config)


def judge_delay(setup: Setup, state: DelayState, sides: Sides) -> DelayState:
    """Compare the tools at the same instant, once for each sample of the twin.

    Args:
        setup: Profile and numbers.
        state: The last checks.
        sides: Both sides.
    """
    config, pair = setup.config.divergence, paired(sides)
    if pair is None:
        return state
    real, twin = tools(setup, pair)
    judged = judge(state.judged, math.dist(real, twin), config.delay_mm, config)
    now = _late(real, twin, tools(setup, pair, GLANCE_S))
    late = state.late if now is None else state.late + NEW_SHARE * (now - state.late)
    return DelayState(judged, late)


def tools(
    setup: Setup, pair: tuple[JointMotion, JointMotion], ahead: float = 0.0
) -> tuple[Point, Point]:
    """Return where both tools are [m], or are going to be at their speed.

    Args:
        setup: Profile and numbers.
        pair: Both sides at the same instant, the real one first.
        ahead: So much later [s].
    """
    real, twin = (
        _tool(
            setup.arm,
            setup.arm_columns,
            # A speed that is beyond all numbers, between two wild samples, leads nowhere.
            tuple(
                [q + ahead * qdot if abs(qdot) < MOST else q for q, qdot in zip(side.q, side.qdot)]
            ),
        )
        for side in pair
    )
    return real, twin


def _late(real: Point, twin: Point, later: tuple[Point, Point]) -> float | None:
    r"""Return how much time the real robot is behind the twin [s]; None: too slow to tell.

    .. math:: t = (p_{twin} - p_{real}) \cdot v / |v|^2

    where ``v`` is the mean velocity of both tools: what is beside the way is no delay.
    """
    velocity = [
        (b - a + d - c) / (2.0 * GLANCE_S) for a, b, c, d in zip(real, later[0], twin, later[1])
    ]
    square = sum(v * v for v in velocity)
    if square < SLOWEST_M_S**2:
        return None
    return sum((t - r) * v for t, r, v in zip(twin, real, velocity)) / square
