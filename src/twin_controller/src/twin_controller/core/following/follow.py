"""Set points for the follower: where the leader is (twin follows) or is going to be (real robot follows)."""

from __future__ import annotations

import msgspec
from scara_control.setpoints import SetpointTrack

from twin_controller.core.actions import AnyAction, FollowTwin, StreamReal
from twin_controller.core.events import Joints
from twin_controller.core.following.blend import Blend, begin_blend, finished, sample_blend
from twin_controller.core.following.gate import Bounds, Rejected, pass_setpoint
from twin_controller.core.following.turn import Turn, next_turns
from twin_controller.core.observing import echo
from twin_controller.core.observing.change import stands_still
from twin_controller.core.observing.measure import paired
from twin_controller.core.rules.table import Mode
from twin_controller.core.state import CoreState, Sample, Setup, StreamState

replace = msgspec.structs.replace

MEMORY_S = 1.0

PLANNED, UNPLANNED = 2.0, 0.5
"""So many spacings of the stream the next answer may be late before a set point is missing; our choice."""


def estimate_acceleration(history: tuple[Sample, ...], limits: Joints) -> Joints:
    """Estimate the acceleration at the newest sample from the velocities of the last three, bounded by ``limits``.

    The slope of the last interval belongs to its middle; the change of slope carries it on to the newest sample.
    """
    if len(history) < 2:
        return (0.0,) * len(limits)
    last, before = history[-1], history[-2]
    h1 = last.t - before.t
    slope = [(a - b) / h1 for a, b in zip(last.qdot, before.qdot)]
    if len(history) > 2:
        h2 = before.t - history[-3].t
        older = [(a - b) / h2 for a, b in zip(before.qdot, history[-3].qdot)]
        slope = [s + (s - o) * h1 / (h1 + h2) for s, o in zip(slope, older)]
    return tuple(min(max(s, -limit), limit) for s, limit in zip(slope, limits))


def follow_twin(setup: Setup, state: CoreState, now: float) -> tuple[CoreState, list[AnyAction]]:
    """Send the real robot's newest sample to the twin, plus what is left of the offset it started with."""
    follow = state.follow
    if follow is None or now < follow.since or not state.real.history or not state.twin.history:
        return state, []
    sample = state.real.last
    qddot = estimate_acceleration(state.real.history, setup.acceleration)
    if follow.blend is None:
        ahead = state.twin.last.t - sample.t
        leader = tuple(p + v * ahead for p, v in zip(sample.q, sample.qdot))
        offset = tuple(a - b for a, b in zip(state.twin.last.q, leader))
        slowly = state.mode is Mode.ALIGNING
        blend = begin_blend(offset, sample.t, setup.align_speeds()) if slowly else close_gap(setup, offset, sample.t)
        follow = replace(follow, blend=blend)
    assert follow.blend is not None
    gap, gap_rate, gap_curve = sample_blend(follow.blend, sample.t)
    q = tuple(a + b for a, b in zip(sample.q, gap))
    tube = echo.remember(state.twin.tube, sample.t, setup.to_border(q), MEMORY_S)
    action = FollowTwin(
        stamp=state.twin.clock.to_remote(sample.t),
        q=q,
        qdot=tuple(a + b for a, b in zip(sample.qdot, gap_rate)),
        qddot=tuple(a + b for a, b in zip(qddot, gap_curve)),
    )
    return replace(state, follow=follow, twin=replace(state.twin, tube=tube)), [action]


def close_gap(setup: Setup, offset: Joints, start: float) -> Blend:
    """Plan how the follower's offset (SI) is closed: a small one, left by late detection, at once; a large one slowly."""
    config = setup.config.align
    blend = begin_blend(offset, start, setup.align_speeds())
    if max(abs(gap) for gap in setup.to_border(offset)) <= config.catch_up:
        return replace(blend, duration=min(blend.duration, config.catch_up_ms * 1e-3))
    return blend


def aligned(setup: Setup, state: CoreState, now: float) -> bool:
    """Return whether the offset is gone and both sides are together: at rest both, or the twin with a robot that moves."""
    follow, config = state.follow, setup.config
    if follow is None or follow.blend is None or not finished(follow.blend, now):
        return False
    if now - state.mode_since < config.change.still_time_ms * 1e-3:
        return False
    if not stands_still(state.real.change, now, config.change):
        return deviation(setup, state) <= config.align.lead_tolerance
    return stands_still(state.twin.change, now, config.change) and deviation(setup, state) <= config.align.tolerance


def deviation(setup: Setup, state: CoreState) -> float:
    """Return the largest joint deviation at one instant, border units; infinite while a side is unknown."""
    if not state.real.history or not state.twin.history:
        return float("inf")
    real, twin = paired(state) or (state.real.last, state.twin.last)
    return max(abs(a - b) for a, b in zip(setup.to_border(real.q), setup.to_border(twin.q)))


def twin_ahead(setup: Setup, state: CoreState, local: float) -> tuple[Joints, float]:
    """Return where the twin is going to be at local time ``local``, and how old the data are [s].

    Its plan is used if it has one for now; else its last state is carried on at constant velocity.
    """
    stamp = state.twin.clock.to_remote(local)
    now = state.twin.clock.to_remote(state.twin.seen or local)
    plan = state.plan
    if plan is not None and plan.stamp + plan.times[-1] > now:
        track = SetpointTrack(
            plan.times, plan.q, plan.qdot, plan.qddot, extrapolation_limit=0.0, stop_accelerations=setup.acceleration
        )
        q, _, _ = track.sample(stamp - plan.stamp)
        return tuple(q), 0.0
    last = state.twin.last
    ahead = max(0.0, min(local - last.t, 0.2))
    return tuple(p + v * ahead for p, v in zip(last.q, last.qdot)), max(0.0, (state.twin.seen or last.t) - last.t)


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


def stream_real(setup: Setup, state: CoreState, now: float) -> tuple[CoreState, list[AnyAction], str]:
    """Send the real robot where the twin is going to be when it gets there.

    Returns:
        The new state, the set points that may be sent, and why the next may not.
    """
    stream = state.stream
    if stream is None or not state.twin.history or not state.real.history:
        return state, [], ""
    real, spacing = setup.config.real, setup.config.stream.period_ms
    turns = next_turns(
        now,
        state.real.last.t,
        real.sample_period_ms * 1e-3,
        spacing * 1e-3 if spacing is not None else None,
        _decided_ahead(setup, state, now),
        0.5 * state.real.clock.best_trip,
        stream.last.t if stream.last is not None else None,
    )
    actions: list[AnyAction] = []
    for turn in turns:
        state, action, reason = _stream_at(setup, state, stream, turn, now)
        if action is None:
            return state, actions, reason
        actions.append(action)
        assert state.stream is not None
        stream = state.stream
    return state, actions, ""


def _decided_ahead(setup: Setup, state: CoreState, now: float) -> float:
    """Return how far ahead set points are decided [s]: until the next answer, and as long as a plan tells the way for longer."""
    config, plan = setup.config, state.plan
    spacing = (config.stream.period_ms or 0.0) * 1e-3
    planned = plan is not None and plan.stamp + plan.times[-1] > state.twin.clock.to_remote(now)
    return config.real.poll_period_ms * 1e-3 + (PLANNED if planned else UNPLANNED) * spacing


def _stream_at(
    setup: Setup, state: CoreState, stream: StreamState, turn: Turn, now: float
) -> tuple[CoreState, StreamReal | None, str]:
    """Aim one set point at the instant at which the robot gets there, and let it through or not."""
    aim = turn.taken + state.lag
    target, _ = twin_ahead(setup, state, aim)
    if stream.blend is None:
        offset = tuple(a - b for a, b in zip(state.real.last.q, target))
        stream = replace(stream, blend=close_gap(setup, offset, aim))
    assert stream.blend is not None
    gap, _, _ = sample_blend(stream.blend, aim)
    q = tuple(a + b for a, b in zip(target, gap))
    share = min(setup.config.limit.speed_percent, state.speed.cap) * 1e-2
    last, dt = (stream.last.q, turn.taken - stream.last.t) if stream.last else (None, 0.0)
    age = now - (state.twin.seen if state.twin.seen is not None else -1e9)
    verdict = pass_setpoint(q, last, dt, age, share, setup.config.limit.source_age_ms * 1e-3, bounds_of(setup))
    if isinstance(verdict, Rejected):
        return state, None, verdict.reason
    tube = echo.remember(state.real.tube, turn.at, setup.to_border(verdict.q), MEMORY_S)
    sent = replace(stream, last=Sample(turn.taken, verdict.q, (0.0,) * len(q)))
    state = replace(state, stream=sent, speed=replace(state.speed, gate=verdict.reason), real=replace(state.real, tube=tube))
    override = state.flags.override_percent if state.flags is not None else 100.0
    return state, StreamReal(verdict.q, min(100.0, 1e4 * share / max(override, 1.0)), turn.at), ""
