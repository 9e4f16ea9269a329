"""Set points for the real robot: where the twin is going to be when the robot gets there."""

from __future__ import annotations

from typing import NamedTuple

import msgspec
from scara_control.joint_track import JointTrack

from twin_controller.core.actions import StreamReal
from twin_controller.core.events import Joints
from twin_controller.core.follow.blend import sample_blend
from twin_controller.core.follow.limit import (
    Bounds,
    Rejected,
    judge_setpoint,
    slow_setpoint,
)
from twin_controller.core.follow.memory import RealFollows
from twin_controller.core.follow.schedule import SendSlot, next_slots
from twin_controller.core.follow.twin import close_gap
from twin_controller.core.setup import Setup
from twin_controller.core.sides.pairing import paired
from twin_controller.core.sides.side import RealSide, Sample, Sides, TwinSide

replace = msgspec.structs.replace

PLANNED, UNPLANNED = 2.0, 0.5
"""The next answer may be late by so many spacings before a set point is missing; our choice."""

LONGEST_AHEAD_S = 0.2
"""The twin's last state is carried on at constant velocity for so long at most [s]."""

LAG_GAIN = 0.02
LAG_SPEED = 0.1


class Streamed(NamedTuple):
    """What is remembered of the stream, what is sent now, and why the next is not."""

    follows: RealFollows | None
    setpoints: list[StreamReal]
    rejected: str


def stream_real(
    setup: Setup,
    follows: RealFollows | None,
    sides: Sides,
    lag: float,
    cap: float,
    now: float,
) -> Streamed:
    """Make the set points that are due until the next answer of the robot.

    Args:
        setup: Profile and numbers.
        follows: What is remembered of the stream.
        sides: Both sides.
        lag: How far the robot follows behind its set points [s].
        cap: The operator's cap of the program speed [percent].
        now: Time [s].
    """
    setpoints: list[StreamReal] = []
    if follows is None or not sides.known:
        return Streamed(follows, setpoints, "")
    for slot in _slots(setup, follows, sides, now):
        aim = slot.taken_at + lag
        made = _setpoint(setup, follows, sides, slot, aim, cap, now)
        if isinstance(made, Rejected):
            return Streamed(follows, setpoints, made.reason)
        follows, setpoint = made
        setpoints.append(setpoint)
    return Streamed(follows, setpoints, "")


def _slots(setup: Setup, follows: RealFollows, sides: Sides, now: float) -> list[SendSlot]:
    """Return when the set points are sent that are decided now."""
    config = setup.config
    spacing, last = None, None
    if config.stream.period_ms is not None:
        spacing = config.stream.period_ms * 1e-3
    if follows.last is not None:
        last = follows.last.t
    return next_slots(
        now,
        sides.real.last.t,
        config.real.sample_period_ms * 1e-3,
        spacing,
        _decided_ahead(setup, sides.twin, now),
        0.5 * sides.real.clock.best_trip,
        last,
    )


def _decided_ahead(setup: Setup, twin: TwinSide, now: float) -> float:
    """Return how far ahead set points are decided [s].

    Until the next answer, and longer while a plan tells where the twin goes.
    """
    config = setup.config
    spacing = (config.stream.period_ms or 0.0) * 1e-3
    longer = PLANNED if planned(twin, now) else UNPLANNED
    return config.real.poll_period_ms * 1e-3 + longer * spacing


def _setpoint(
    setup: Setup,
    follows: RealFollows,
    sides: Sides,
    slot: SendSlot,
    aim: float,
    cap: float,
    now: float,
) -> tuple[RealFollows, StreamReal] | Rejected:
    """Aim one set point at the instant at which the robot gets there, and let it through or not."""
    real, limit = sides.real, setup.config.limit
    target = twin_ahead(setup, sides.twin, aim)
    blend = follows.blend
    if blend is None:
        offset = tuple(a - b for a, b in zip(real.last.q, target))
        blend = close_gap(setup, offset, aim)
    gap, _, _ = sample_blend(blend, aim)
    q = tuple(a + b for a, b in zip(target, gap))
    asked = _judged(setup, follows, sides, slot, q, aim, now)
    if isinstance(asked, Rejected):
        return asked
    last, dt = None, 0.0
    if follows.last is not None:
        last, dt = follows.last.q, min(slot.taken_at - follows.last.t, _longest_step(setup))
    told = min(limit.told_percent, cap) * 1e-2
    passed = slow_setpoint(asked, last, dt, told, bounds_of(setup))
    still = (0.0,) * len(q)
    follows = replace(
        follows,
        blend=blend,
        asked=Sample(slot.taken_at, asked, still),
        last=Sample(slot.taken_at, passed.q, still),
        slowed=passed.reason,
    )
    return follows, StreamReal(passed.q, _program_speed(setup, real, cap), slot.send_at)


def _judged(
    setup: Setup,
    follows: RealFollows,
    sides: Sides,
    slot: SendSlot,
    q: Joints,
    aim: float,
    now: float,
) -> Joints | Rejected:
    """Judge what the twin asks for against what it asked for before."""
    before, dt = None, 0.0
    slack = (0.0,) * len(q)
    if follows.asked is not None:
        before, dt = follows.asked.q, slot.taken_at - follows.asked.t
        if not planned(sides.twin, sides.twin.seen or now):
            # What is carried on at constant velocity is off by what the twin speeds up meanwhile,
            # and its samples are up to a spacing older or younger than those before.
            ahead = min(max(0.0, aim - sides.twin.last.t), LONGEST_AHEAD_S)
            slack = tuple(2.0 * dt * ahead * most for most in setup.acceleration)
    # A twin that was never seen is as old as can be.
    age = now - (sides.twin.seen if sides.twin.seen is not None else -1e9)
    age_limit = setup.config.limit.source_age_ms * 1e-3
    return judge_setpoint(q, before, dt, slack, age, age_limit, bounds_of(setup))


def _longest_step(setup: Setup) -> float:
    """Return the longest time that one step of a set point may make use of [s].

    Where set points were left out, the robot has stood for the rest: it catches up bit by bit.
    """
    period = setup.config.stream.period_ms or setup.config.real.poll_period_ms
    return period * 1e-3


def _program_speed(setup: Setup, real: RealSide, cap: float) -> float:
    """Return the speed of the robot's stream program: no more than its set points have.

    A robot that was late may not catch up faster either. It runs its program at its override: what
    it is told makes up for that.
    """
    override = real.flags.override_percent if real.flags is not None else 100.0
    return min(100.0, 100.0 * min(setup.config.limit.told_percent, cap) / max(override, 1.0))


def planned(twin: TwinSide, local: float) -> bool:
    """Return whether the twin's plan reaches beyond local time ``local``."""
    plan = twin.plan
    return plan is not None and plan.stamp + plan.times[-1] > twin.clock.to_remote(local)


def twin_ahead(setup: Setup, twin: TwinSide, local: float) -> Joints:
    """Return where the twin is going to be at local time ``local``.

    Its plan is used if it has one for now; else its last state is carried on at constant velocity.
    """
    plan = twin.plan
    if plan is not None and planned(twin, twin.seen or local):
        track = JointTrack(
            plan.times,
            plan.q,
            plan.qdot,
            plan.qddot,
            extrapolation_limit=0.0,
            stop_accelerations=setup.acceleration,
        )
        q, _, _ = track.sample(twin.clock.to_remote(local) - plan.stamp)
        return tuple(q)
    last = twin.last
    ahead = max(0.0, min(local - last.t, LONGEST_AHEAD_S))
    return tuple(p + v * ahead for p, v in zip(last.q, last.qdot))


def bounds_of(setup: Setup) -> Bounds:
    """Return what the real robot may be told."""
    config = setup.config.limit
    return Bounds(
        names=setup.names,
        lower=setup.lower,
        upper=setup.upper,
        velocity=setup.velocity,
        units=tuple(joint.si_unit for joint in setup.joints),
        tolerance=tuple(config.position_tolerance * scale for scale in setup.scale),
        step_margin=config.step_margin,
    )


def adapted_lag(setup: Setup, lag: float, sides: Sides) -> float:
    r"""Correct the real robot's lag by what remains while it follows.

    .. math:: \delta = \sum \dot q (q_{twin} - q_{real}) / \sum \dot q^2
    """
    pair = paired(sides)
    if pair is None:
        return lag
    real, twin = pair
    speed = [v / limit for v, limit in zip(twin.qdot, setup.velocity)]
    energy = sum(v * v for v in speed)
    # At a crawl the position error is noise, and the quotient means nothing.
    if energy < LAG_SPEED**2:
        return lag
    rows = zip(speed, twin.q, real.q, setup.velocity)
    behind = sum(v * (a - b) / limit for v, a, b, limit in rows) / energy
    low, high = (bound * 1e-3 for bound in setup.config.real.follow_lag_range_ms)
    return min(max(lag + LAG_GAIN * behind, low), high)
