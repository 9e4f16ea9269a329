"""Set points for the twin: where the real robot was at its newest sample."""

from __future__ import annotations

import msgspec
import numpy as np
from scara_control.joint_motion import JointMotion

from twin_controller.core.actions import FollowTwin
from twin_controller.core.events import Joints
from twin_controller.core.follow.blend import Blend, begin_blend, finished, sample_blend
from twin_controller.core.follow.memory import TwinFollows
from twin_controller.core.follow.remembered import SPACING_S, Remembered, way_on, within
from twin_controller.core.setup import Setup
from twin_controller.core.sides.change import drop_baseline, stands_still, update, widened
from twin_controller.core.sides.pairing import deviation
from twin_controller.core.sides.side import RealSide, Sides

replace = msgspec.structs.replace

JERK_S = 0.0095
"""A jerk is told by speeds so far apart [s]; our choice."""
LEADS_S = 0.1
"""What a set point is by so much later [s] without a next one: the twin goes on for no longer."""
OWN_MOTION = ("announcing", "moving", "stopping")
"""What the twin shows while it does something of its own."""


def estimate_acceleration(history: tuple[JointMotion, ...], limits: Joints) -> Joints:
    """Estimate the acceleration at the newest sample from the last three velocities.

    The slope of the last interval belongs to its middle; the change of slope carries it on to the
    newest sample. ``limits`` bound the result: a difference of differences is noisy.
    """
    if len(history) < 2:
        return (0.0,) * len(limits)
    last, before = history[-1], history[-2]
    h1 = last.time - before.time
    slope = [(a - b) / h1 for a, b in zip(last.qdot, before.qdot)]
    if len(history) > 2:
        h2 = before.time - history[-3].time
        older = [(a - b) / h2 for a, b in zip(before.qdot, history[-3].qdot)]
        slope = [s + (s - o) * h1 / (h1 + h2) for s, o in zip(slope, older)]
    return tuple(min(max(s, -limit), limit) for s, limit in zip(slope, limits))


def go_on(setup: Setup, real: RealSide) -> tuple[Joints, tuple[JointMotion, ...]]:
    """Return the acceleration at the newest sample and, with its jerk, where the motion goes on to.

    A drive turns from speeding up to braking within some ten milliseconds. Readings of positions
    come as far apart: without the jerk the twin would go too far by a multiple. Of speeds that
    are told, and of instants that are known to a tick, a jerk would be noise alone: there is none.
    """
    history = real.history
    # What stands goes on standing: a damaged reading may still be in the speeds before.
    if not any(real.last.qdot):
        return (0.0,) * len(setup.acceleration), ()
    # Readings of any age make speeds whose second difference is noise.
    qddot = estimate_acceleration(history[-2:] if real.age_doubt else history, setup.acceleration)
    if real.flags is None or real.flags.motion.qdot or real.ticked:
        return qddot, ()
    apart = [history[-1]]
    for each in reversed(history[:-1]):
        # Of speeds that lie closer a second difference is noise.
        if len(apart) < 3 and apart[-1].time - each.time >= JERK_S:
            apart.append(each)
    if len(apart) < 3:
        return qddot, ()
    last, before, first = apart
    h1, h2, t = last.time - before.time, before.time - first.time, SPACING_S
    q, v, a = np.array(last.q), np.array(last.qdot), np.array(qddot)
    slope, older = (v - before.qdot) / h1, np.subtract(before.qdot, first.qdot) / h2
    # Within the next SPACING_S no joint shall be thought faster to speed up than it can be.
    most = np.array(setup.acceleration)
    jerk = np.clip(2.0 * (slope - older) / (h1 + h2), (-most - a) / t, (most - a) / t)
    there = q + t * (v + t * (a / 2.0 + t * jerk / 6.0))
    point = JointMotion(
        within(setup, there.tolist(), last.q),
        tuple((v + t * (a + t * jerk / 2.0)).tolist()),
        tuple((a + t * jerk).tolist()),
        t,
    )
    return qddot, (point,)


def follow_twin(
    setup: Setup, follows: TwinFollows | None, sides: Sides, remembered: Remembered, now: float
) -> tuple[TwinFollows | None, FollowTwin | None]:
    """Make the twin's next set point: the newest sample, plus what is left of the gap at the start.

    And the way on, where the robot does what it did before.

    Returns:
        What is remembered after it, and the set point if there is one.
    """
    if follows is None or now < follows.since or not sides.known:
        return follows, None
    sample = sides.real.last
    blend = follows.blend
    motion = sides.twin.motion
    if blend is None and motion is not None and motion.state in OWN_MOTION:
        # It takes no set points until that has ended; the gap is closed from where it is then.
        return follows, None
    if blend is None:
        # What is between both at the same instant is closed.
        twin = sides.twin.last
        leader = sample.extrapolated(twin.time)
        offset = tuple(a - b for a, b in zip(twin.q, leader))
        if follows.slowly:
            blend = begin_blend(offset, sample.time, setup.align_speeds())
        else:
            blend = close_gap(setup, offset, sample.time)
        follows = replace(follows, blend=blend, told=drop_baseline(sides.twin.change))
    qddot, points = way_on(setup, remembered, sample)
    if qddot is None:
        qddot, points = go_on(setup, sides.real)
    here = JointMotion(sample.q, sample.qdot, qddot)
    way = tuple(_with_gap(setup, point, blend, sample.time) for point in (here, *points))
    led = setup.to_border(way[0].after(LEADS_S).q)
    told = update(follows.told, now, led, widened(setup.config.change, sides.real.noise))
    follows = replace(follows, told=told)
    return follows, FollowTwin(sides.twin.clock.to_remote(sample.time), way)


def _with_gap(setup: Setup, point: JointMotion, blend: Blend, t: float) -> JointMotion:
    """Add what is left of the gap at the start; the time of ``point`` counts from ``t`` [s].

    A robot that moves on while the gap is large would take a joint of the twin beyond its end: the
    joint waits there.
    """
    gap, rate, curve = sample_blend(blend, t + point.time)
    wanted = [a + b for a, b in zip(point.q, gap)]
    ends = zip(wanted, setup.lower, setup.upper)
    q = tuple([min(max(value, lower), upper) for value, lower, upper in ends])
    free = [a == b for a, b in zip(q, wanted)]
    return JointMotion(
        q=q,
        qdot=tuple((a + b) * moves for a, b, moves in zip(point.qdot, rate, free)),
        qddot=tuple((a + b) * moves for a, b, moves in zip(point.qddot, curve, free)),
        time=point.time,
    )


def close_gap(setup: Setup, offset: Joints, start: float) -> Blend:
    """Plan how the follower's offset (SI) is closed.

    A small one was left by late detection and is closed at once, a large one slowly.
    """
    config = setup.config.align
    blend = begin_blend(offset, start, setup.align_speeds())
    if max(abs(gap) for gap in setup.to_border(offset)) <= config.catch_up:
        return replace(blend, duration=min(blend.duration, config.catch_up_ms * 1e-3))
    return blend


def aligned(
    setup: Setup, follows: TwinFollows | None, sides: Sides, since: float, now: float
) -> bool:
    """Return whether the gap is closed and both sides are together.

    Args:
        setup: Profile and numbers.
        follows: How the twin follows.
        sides: Both sides.
        since: When the alignment began [s].
        now: Time [s].
    """
    config = setup.config
    if follows is None or follows.blend is None or not finished(follows.blend, now):
        return False
    # What a standing side did before the alignment is no rest of it.
    if now - since < config.change.still_time_ms * 1e-3:
        return False
    # A robot that moves by its own program never rests: there the twin only has to be with it.
    if not stands_still(sides.real.change, now, config.change):
        return deviation(setup, sides) <= config.align.lead_tolerance
    still = stands_still(sides.twin.change, now, config.change)
    told = sent_to_rest(setup, follows, now)
    return still and told and deviation(setup, sides) <= config.align.tolerance


def sent_to_rest(setup: Setup, follows: TwinFollows | None, now: float) -> bool:
    """Return whether the twin has long been told to stay where it is.

    A set point that leads elsewhere, and be it by one damaged reading, may still be on its way to a
    twin that stands: what it does about that is no motion of its own.
    """
    return follows is None or stands_still(follows.told, now, setup.config.change)
