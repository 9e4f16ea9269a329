"""Set points for the real robot: where the twin is going to be when the robot gets there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import msgspec
from scara_control.joint_motion import AxisMotion
from scara_control.joint_track import JointTrack

from twin_controller.core.actions import RobotSetpoint, StreamAhead, StreamReal
from twin_controller.core.events import Joints
from twin_controller.core.follow.blend import sample_blend
from twin_controller.core.follow.limit import (
    Bounds,
    Rejected,
    judge_setpoint,
    slow_setpoint,
)
from twin_controller.core.follow.memory import RealFollows
from twin_controller.core.follow.response import Response
from twin_controller.core.follow.schedule import SendSlot, next_slots
from twin_controller.core.follow.twin import close_gap
from twin_controller.core.setup import Setup
from twin_controller.core.sides.side import RealSide, Sides, TwinSide

replace = msgspec.structs.replace

PLANNED, UNPLANNED = 2.0, 0.5
"""The next answer may be late by so many spacings before a set point is missing; our choice."""

LONGEST_AHEAD_S = 0.2
"""The twin's last state is carried on at constant velocity for so long at most [s]."""

SHORTER, LONGER = 0.8, 1.3
"""Of the spacing that is wanted: the robot's own rhythm between these is taken for it; our choice,
as answers of 3 to 8 ms leave no time for much shorter ones."""

SMOOTHING_RATE = 2e-3
"""The smoothing that is reckoned with changes by so much at most [s^2/s]; our choice."""

BELOW = 0.995
"""Set points go with this part of the program speed: a robot whose motion needs all of it, and a
rounding more, takes one interpolation period longer, and stays late. Our choice."""


Course = Callable[[int, float], AxisMotion]
"""The motion of a joint, by its place, at a local time [s]."""


class Streamed(NamedTuple):
    """What is remembered of the stream, what is sent now, and why the next is not."""

    follows: RealFollows | None
    setpoints: Sequence[StreamReal | StreamAhead]
    rejected: str = ""
    # What the robot has been told by now, from the first set point that was made or changed on.
    told: tuple[RobotSetpoint, ...] = ()


def stream_real(
    setup: Setup,
    follows: RealFollows | None,
    sides: Sides,
    response: Response,
    cap: float,
    now: float,
) -> Streamed:
    """Make the set points that are due until the next answer of the robot.

    Args:
        setup: Profile and numbers.
        follows: What is remembered of the stream.
        sides: Both sides.
        response: How the robot answers its set points.
        cap: The operator's cap of the program speed [percent].
        now: Time [s].
    """
    setpoints: list[StreamReal] = []
    told: tuple[RobotSetpoint, ...] = ()
    if follows is None or not sides.known:
        return Streamed(follows, setpoints)
    course = twin_course(setup, sides.twin, now)
    percent = program_speed(setup, sides.real, cap)
    for slot in _slots(setup, follows, sides, now):
        follows = reckon(setup, follows, slot.taken_at, response)
        follows, asked = aimed(setup, follows, sides, course, slot.send_at)
        judgement = judged(setup, follows, sides, slot, asked, cap, now)
        if isinstance(judgement, Rejected):
            return Streamed(follows, setpoints, judgement.reason, told)
        made, slowed = judgement
        follows = replace(follows, told=(made,), slowed=slowed)
        setpoints.append(StreamReal(made, percent, slot.send_at))
        # It counts from when it is written: so its delay is measured.
        told = (*told, replace(made, t=slot.send_at))
    return Streamed(follows, setpoints, "", told)


def _slots(setup: Setup, follows: RealFollows, sides: Sides, now: float) -> list[SendSlot]:
    """Return when the set points are sent that are decided now."""
    last = None
    spacing = setpoint_spacing(setup, sides.real)
    if follows.last is not None:
        last = follows.last.t
    # Decided until the next answer, and further ahead while a plan tells where the twin goes.
    longer = PLANNED if planned(sides.twin, now) else UNPLANNED
    until_next = max(setup.config.real.poll_period_ms * 1e-3, sides.real.period)
    ahead = until_next + longer * (spacing or 0.0)
    return next_slots(
        now,
        sides.real.last.time,
        sides.real.period,
        sides.real.rhythm.jitter,
        spacing,
        ahead,
        0.5 * sides.real.clock.best_trip,
        last,
    )


def setpoint_spacing(setup: Setup, real: RealSide) -> float | None:
    """Return the time between two set points [s], in the robot's rhythm if that is near enough.

    A robot may take them in the rhythm in which it renews its readings, in twice or half of that,
    or in none that is known. None: each is sent at once.
    """
    if setup.config.stream.period_ms is None:
        return None
    wanted, period = 1e-3 * setup.config.stream.period_ms, real.period
    rhythm = min((period, 2.0 * period, 0.5 * period), key=lambda one: abs(one - wanted))
    return rhythm if SHORTER * wanted <= rhythm <= LONGER * wanted else wanted


def aimed(
    setup: Setup, follows: RealFollows, sides: Sides, course: Course, at: float
) -> tuple[RealFollows, Joints]:
    """Return what the robot is asked for at ``at`` [s], to be with the twin once it does it.

    The twin's course, and what is left of the gap between both, which the first set point finds.
    """
    target = target_of(setup, follows, course, at)
    # The slowest joint's instant: the gap needs one for all.
    aim = at + max(follows.delay)
    flags = sides.real.flags
    # START counts when its pulse ends, and only then the robot goes on: the gap does not close yet.
    held = follows.resumes and flags is not None and (flags.paused or not flags.streaming)
    if follows.blend is None or held:
        offset = tuple(a - b for a, b in zip(sides.real.last.q, target))
        follows = replace(follows, blend=close_gap(setup, offset, aim))
    assert follows.blend is not None
    gap, _, _ = sample_blend(follows.blend, aim)
    return follows, tuple(a + b for a, b in zip(target, gap))


def judged(
    setup: Setup,
    follows: RealFollows,
    sides: Sides,
    slot: SendSlot,
    asked: Joints,
    cap: float,
    now: float,
) -> tuple[RobotSetpoint, str] | Rejected:
    """Let one set point through or not, and no faster than allowed.

    Args:
        setup: Profile and numbers.
        follows: Its last set point is the one before.
        sides: Both sides.
        slot: When it counts.
        asked: What the twin asks for, SI.
        cap: The operator's cap of the program speed [percent].
        now: Time [s].

    Returns:
        The set point, and why it was slowed down; empty if it was not.
    """
    real, limit, before = sides.real, setup.config.limit, follows.last
    passes = _judged(setup, before, sides, slot, asked, slot.send_at + max(follows.delay), now)
    if isinstance(passes, Rejected):
        return passes
    last, dt = None, 0.0
    if before is not None:
        longest = setup.config.stream.ahead_period_ms * 1e-3
        if not real.takes_ahead:
            spacing = setpoint_spacing(setup, real)
            longest = spacing or setup.config.real.poll_period_ms * 1e-3
        # Where set points were left out, the robot has stood: it catches up bit by bit.
        last, dt = before.q, min(slot.taken_at - before.t, longest)
    told = BELOW * min(limit.told_percent, cap) * 1e-2
    q, slowed = slow_setpoint(passes, last, dt, told, bounds_of(setup))
    return RobotSetpoint(q, t=slot.taken_at, asked=passes), slowed


def reckon(setup: Setup, follows: RealFollows, at: float, response: Response) -> RealFollows:
    """Let the delays that a set point at ``at`` [s] reckons with follow what was measured."""
    if follows.last is None or not follows.delay:
        return replace(follows, delay=response.delay, smoothing=response.smoothing)
    passed = max(0.0, at - follows.last.t)
    most = setup.config.response.change_percent * 1e-2 * passed
    rounding = SMOOTHING_RATE * passed
    return replace(
        follows,
        delay=tuple(_toward(a, b, most) for a, b in zip(follows.delay, response.delay)),
        smoothing=tuple(
            _toward(a, b, rounding) for a, b in zip(follows.smoothing, response.smoothing)
        ),
    )


def _toward(value: float, wanted: float, most: float) -> float:
    return value + min(max(wanted - value, -most), most)


def target_of(setup: Setup, follows: RealFollows, course: Course, at: float) -> Joints:
    """Return what the robot is told for ``at`` [s], so that it does what the twin does by then.

    The inverse of what its filters do to slow motion, within its range.

    Args:
        setup: The joints' ranges.
        follows: Delay [s] and smoothing [s^2] of each joint.
        course: Where each joint of the twin is at a time [s], SI.
        at: The robot's time [s].
    """
    target = []
    for k, (delay, smoothing) in enumerate(zip(follows.delay, follows.smoothing)):
        q, _, qddot = course(k, at + delay)
        ahead = q - smoothing * qddot
        target.append(min(max(ahead, min(q, setup.lower[k])), max(q, setup.upper[k])))
    return tuple(target)


def _judged(
    setup: Setup,
    last: RobotSetpoint | None,
    sides: Sides,
    slot: SendSlot,
    q: Joints,
    aim: float,
    now: float,
) -> Joints | Rejected:
    """Judge what the twin asks for against what it asked for before."""
    before, dt = None, 0.0
    slack = (0.0,) * len(q)
    if last is not None:
        before, dt = last.asked, slot.taken_at - last.t
        if not planned(sides.twin, sides.twin.seen or now):
            # What is carried on at constant velocity is off by what the twin speeds up meanwhile,
            # and its samples are up to a spacing older or younger than those before.
            ahead = min(max(0.0, aim - sides.twin.last.time), LONGEST_AHEAD_S)
            slack = tuple(2.0 * dt * ahead * most for most in setup.acceleration)
    seen = sides.twin.seen
    if seen is None:
        # A twin that was never seen is as old as can be.
        seen = -1e9
    age_limit = setup.config.limit.source_age_ms * 1e-3
    return judge_setpoint(q, before, dt, slack, now - seen, age_limit, bounds_of(setup))


def program_speed(setup: Setup, real: RealSide, cap: float) -> float:
    """Return the speed of the robot's stream program: no more than its set points have.

    A robot that was late may not catch up faster either. It runs its program at its override: what
    it is told makes up for that.
    """
    override = real.flags.override_percent if real.flags is not None else 100.0
    return min(100.0, 100.0 * min(setup.config.limit.told_percent, cap) / max(override, 1.0))


def planned(twin: TwinSide, local: float) -> bool:
    """Return whether the twin's plan reaches beyond local time ``local``."""
    plan = twin.plan
    return plan is not None and plan.end > twin.clock.to_remote(local)


def jogs_ahead(twin: TwinSide, local: float) -> bool:
    """Return whether a jog waits for the real robot at local time ``local``."""
    return twin.plan is not None and twin.plan.jog and planned(twin, local)


def twin_course(setup: Setup, twin: TwinSide, now: float) -> Course:
    """Return where the twin is going to be.

    Its plan is used if it has one for now; else its last state is carried on at constant velocity.

    Args:
        setup: Profile and numbers.
        twin: What is known of it.
        now: Local time, for a twin that was never seen [s].
    """
    plan = twin.plan
    if plan is not None and planned(twin, twin.seen or now):
        stamp = plan.stamp
        track = JointTrack.from_checked(
            plan.setpoints, extrapolation_limit=0.0, stop_accelerations=setup.acceleration
        )
        return lambda k, local: track.sample_joint(k, twin.clock.to_remote(local) - stamp)
    last = twin.last

    def carried(k: int, local: float) -> AxisMotion:
        ahead = max(0.0, min(local - last.time, LONGEST_AHEAD_S))
        return last.q[k] + last.qdot[k] * ahead, last.qdot[k], last.qddot[k]

    return carried


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
