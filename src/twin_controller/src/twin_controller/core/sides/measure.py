"""Take in what the two sides say: links, clocks, samples, changes, grippers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import msgspec
import numpy as np
from scara_control.joint_motion import JointMotion

from twin_controller.core.events import (
    AnyEvent,
    ClockProbe,
    Joints,
    LinkChanged,
    RealAlarm,
    RealKnown,
    RealMeasured,
    Tick,
    TwinGripper,
    TwinMeasured,
    TwinMotion,
    TwinPlan,
)
from twin_controller.core.setup import Setup
from twin_controller.core.sides import change, clock, echo
from twin_controller.core.sides.clock import ClockEstimate, ClockTolerance
from twin_controller.core.sides.own_gap import leave_out, note_stall, silence, stall_text
from twin_controller.core.sides.side import (
    HISTORY,
    Gripper,
    RealSide,
    Side,
    Sides,
    TwinSide,
)
from twin_controller.core.sides.speeds import speeds
from twin_controller.estimation.latch import PERIODS_MS, Latch, cut, renewed, shares_of
from twin_controller.estimation.rhythm import heard

replace = msgspec.structs.replace
S = TypeVar("S", bound=Side)

FUTURE_S = 0.1
"""A stamp so far ahead [s] shows that a clock jumped; a simulator may catch up by a little."""

NOISE_EVERY_S, NOISE_GAIN = 0.5, 0.5
"""How often the noise of a side is looked for [s], and how much of what is found counts."""

DRIFTS = 4.0
"""Halves of a stretch whose means differ by so many standard deviations are no rest."""
SPREADS = 1.5
"""Nor is a stretch that strays so much more than its readings differ from one to the next."""

CLOCK_JUMPED = "its clock jumped"

MEMORY_S = 1.0
"""Set points sent to a side are remembered for so long [s]; the echo looks back half of it."""


def take_in(setup: Setup, sides: Sides, event: AnyEvent) -> Sides:
    """Return both sides after one input; those that tell nothing of a side change nothing."""
    real, twin = sides.real, sides.twin
    match event:
        case Tick(own_gap=gap, stood=stood) if gap or stood:
            sides = note_stall(sides, stood or gap, event.now)
            return leave_out(sides, gap, event.now) if gap else sides
        case LinkChanged(side="real"):
            return replace(sides, real=real_lost(real, event.reason, event.connected))
        case LinkChanged():
            return replace(sides, twin=twin_lost(twin, event.reason, event.connected))
        case RealMeasured():
            return replace(sides, real=real_measured(setup, real, event))
        case RealKnown():
            return replace(sides, real=replace(real, noise=event.noise))
        case RealAlarm():
            alarm, warning = (event.text, "") if event.stops else ("", event.text)
            return replace(sides, real=replace(real, alarm=alarm, warning=warning))
        case TwinMeasured():
            return replace(sides, twin=twin_measured(setup, twin, event))
        case TwinPlan():
            planned = replace(twin, plan=event, shares=speed_shares(event, setup.velocity))
            return replace(sides, twin=planned)
        case TwinMotion():
            return replace(sides, twin=replace(twin, motion=event))
        case TwinGripper() if twin.connected:
            shown = Gripper(event.on, event.holding, event.part)
            return replace(sides, twin=replace(twin, gripper=shown, touches=event.touches))
        case ClockProbe():
            return replace(sides, twin=clock_probed(setup, twin, event))
    return sides


def real_lost(real: RealSide, reason: str, connected: bool = True) -> RealSide:
    """Forget the real robot: nothing old may count after a reconnect, but an alarm that is on.

    Args:
        real: What was known.
        reason: Why its data cannot be used.
        connected: Its link stands all the same.
    """
    return RealSide(
        connected,
        reason,
        clock=ClockEstimate(jumps=real.clock.jumps),
        rhythm=real.rhythm,
        latch=cut(real.latch),
        noise=real.noise,
        alarm=real.alarm,
        warning=real.warning,
    )


def twin_lost(twin: TwinSide, reason: str, connected: bool = True) -> TwinSide:
    """Forget the twin, likewise; its gripper is told on change only, so it outlives a silence."""
    gripper = twin.gripper if connected else Gripper()
    fresh = ClockEstimate(jumps=twin.clock.jumps)
    return TwinSide(connected, reason, clock=fresh, gripper=gripper, noise=twin.noise)


def drop_stale(setup: Setup, sides: Sides, now: float) -> Sides:
    """Forget a side that has been silent for too long."""
    real, twin, config = sides.real, sides.twin, setup.config
    if _silent(real, now, config.real.stale_ms):
        real = real_lost(real, _named(real, f"no fresh data for {config.real.stale_ms:g} ms", now))
    if _silent(twin, now, config.twin.stale_ms):
        twin = twin_lost(twin, _named(twin, f"no fresh data for {config.twin.stale_ms:g} ms", now))
    # Samples come from the simulator, the state of motion from the pose controller: either may die.
    limit = config.twin.stale_ms
    motion = twin.motion
    if motion is not None and silence(motion.now, now, twin.deaf) > limit * 1e-3:
        silent = f"its pose controller was silent for {limit:g} ms"
        twin = twin_lost(twin, _named(twin, silent, now))
    if real is sides.real and twin is sides.twin:
        return sides
    return Sides(real, twin)


def _named(side: Side, what: str, now: float) -> str:
    """Say first that this machine stood still, if that is why."""
    cause = stall_text(side.stall, now)
    if not cause:
        return what
    return f"{cause}: {what}"


def _silent(side: Side, now: float, limit_ms: float) -> bool:
    if not side.connected or side.seen is None:
        return False
    return silence(side.seen, now, side.deaf) > limit_ms * 1e-3


def real_measured(setup: Setup, real: RealSide, event: RealMeasured) -> RealSide:
    """Take one answer of the real robot in."""
    real = _real_sampled(setup, real, event)
    # The gripper counts also where the position is an old one, but not of a robot that is lost.
    if event.gripper is not None and real.history:
        real = replace(real, gripper=Gripper(event.gripper, event.vacuum))
    return real


def _real_sampled(setup: Setup, real: RealSide, event: RealMeasured) -> RealSide:
    config = setup.config.real
    clock_ms = clock.unwrap_ms(real.clock_ms, event.clock_ms)
    # The robot latches less often than it is asked: the same clock is the same sample.
    if clock_ms == real.clock_ms:
        return replace(real, asked=event.sent)
    rhythm = heard(real.rhythm, clock_ms, 0.5 * (event.sent + event.received), event.plain_clock)
    # What the stamps are rough by is no motion: each reading lies on the robot's own grid.
    stamp = rhythm.instant(clock_ms)
    known = real.clock
    if rhythm.corrects and not real.rhythm.corrects:
        # What was bounded by stamps as rough as these may be wrong by as much.
        known = clock.widen(known, rhythm.roughness)
    if rhythm.period > real.rhythm.period:
        # Readings are older than was thought.
        known = replace(known, upper=known.upper + rhythm.period - real.rhythm.period)
    estimate = clock.observe(
        known,
        1e-3 * stamp,
        event.sent,
        event.received,
        config.clock_drift_ppm,
        rhythm.period,
        config.sample_latency_ms * 1e-3,
        rhythm.spread,
        ClockTolerance(config.clock_jump_ms * 1e-3, config.clock_conflicts),
        real.asked,
    )
    if estimate.jumps != real.clock.jumps:
        cause = stall_text(real.stall, event.now)
        lost = real_lost(real, f"{cause}: its old answers say little" if cause else CLOCK_JUMPED)
        return replace(lost, clock=ClockEstimate(jumps=estimate.jumps))
    latch, renewed_at = real.latch, stamp
    if event.plain_clock:
        latch = renewed(latch, stamp, event.motion.q, setup.velocity)
        if latch.grid != real.latch.grid:
            real = restamped(real, latch, estimate, setup.velocity)
        renewed_at = latch.instant(stamp)
        # Before a grid is known, a reading that a moving robot gives again would look like a stop.
        same = bool(real.history) and event.motion.q == real.last.q and any(real.last.qdot)
        before = real.renewed_ms if same and not latch.settled else None
        if before is not None and renewed_at - before <= PERIODS_MS[-1]:
            renewed_at = before
    sample = replace(event.motion, time=estimate.to_local(1e-3 * renewed_at))
    seen = min(event.received, sample.time + estimate.uncertainty)
    # A robot that renews its readings less often than it is asked gives one of them twice.
    again = renewed_at == real.renewed_ms
    real = replace(
        real,
        clock=estimate,
        rhythm=rhythm,
        latch=latch,
        seen=seen,
        flags=event,
        clock_ms=clock_ms,
        renewed_ms=renewed_at,
        asked=event.sent,
    )
    return real if again else _sampled(setup, real, sample)


def restamped(real: RealSide, latch: Latch, known: ClockEstimate, velocity: Joints) -> RealSide:
    """Put the newest readings where they belong, now that it is known how old they were.

    By the rows of ``latch``, whose newest is not in the history yet; ``velocity`` in SI.
    """
    stamped: list[tuple[float, JointMotion]] = []
    left = list(real.history)
    for row in reversed(latch.rows[:-1]):
        # An answer that gave a reading again is in the history only until that is known.
        if left and row[1:] == shares_of(left[-1].q, velocity):
            stamped.append((row[0], left.pop()))
        elif stamped and row[1:] == shares_of(stamped[-1][1].q, velocity):
            stamped[-1] = (row[0], stamped[-1][1])
        else:
            break
    first: dict[float, JointMotion] = {}
    for stamp, reading in reversed(stamped):
        renewed_ms = latch.instant(stamp)
        first.setdefault(renewed_ms, replace(reading, time=known.to_local(1e-3 * renewed_ms)))
    rows = tuple(first.values())
    # What came before keeps its order: nothing of it is newer than the first of them.
    before = [each for each in left if not rows or each.time < rows[0].time]
    return replace(real, history=(*before, *rows))


def twin_measured(setup: Setup, twin: TwinSide, event: TwinMeasured) -> TwinSide:
    """Take one joint state of the twin in; before its clock is known it has no time."""
    if not twin.clock.known:
        return twin
    sample = replace(event.motion, time=twin.clock.to_local(event.motion.time))
    if twin.history and sample.time <= twin.last.time:
        return twin
    latest = sample.time - twin.clock.uncertainty
    if latest > event.now + FUTURE_S:
        ahead = latest - event.now
        return twin_lost(twin, f"its stamps are {ahead:.3g} s ahead of its clock")
    seen = min(event.now, sample.time + twin.clock.uncertainty)
    return _sampled(setup, replace(twin, seen=seen), sample)


def speed_shares(plan: TwinPlan, velocity: Joints) -> Joints:
    """Return each joint's largest step in a plan against the largest of all; empty if none moves.

    Args:
        plan: Where the twin is going to be.
        velocity: Largest speed of each joint, SI.
    """
    rows = np.array([row for _, row in plan.rows])
    steps = np.ptp(rows, axis=0) / np.array(velocity)
    most = float(steps.max())
    return tuple([float(step) / most for step in steps]) if most > 0.0 else ()


def clock_probed(setup: Setup, twin: TwinSide, event: ClockProbe) -> TwinSide:
    """Narrow the estimate of the twin's clock."""
    config = setup.config.twin
    estimate = clock.observe(
        twin.clock,
        event.remote,
        event.sent,
        event.received,
        config.clock_drift_ppm,
        patience=ClockTolerance(config.clock_jump_ms * 1e-3, config.clock_conflicts),
    )
    if estimate.jumps != twin.clock.jumps:
        lost = twin_lost(twin, "its clock jumped")
        return replace(lost, clock=ClockEstimate(jumps=estimate.jumps))
    return replace(twin, clock=estimate)


def _sampled(setup: Setup, side: S, sample: JointMotion) -> S:
    """Append a sample and judge whether the side moved."""
    if side.history and sample.time <= side.last.time:
        return side
    side = _noise_found(setup, side, sample.time)
    config, settle = change.widened(setup.config.change, side.noise), setup.config.settle
    border = setup.to_border(sample.q)
    own = echo.answers(side.tube, sample.time, border, config)
    reach = change.settle_reach(settle, config)
    known = change.settle(side.change, sample.time, config, settle.timeout_ms * 1e-3, reach)
    found = change.update(known, sample.time, border, config, echo=own)
    if not sample.qdot:
        # What stands by its positions has no speed: noise over a few milliseconds would be one.
        qdot = (0.0,) * len(sample.q)
        if not change.stands_still(found, sample.time, config):
            noise = tuple(side.noise * scale for scale in setup.scale)
            qdot = speeds(
                side.history, sample, noise, setup.velocity, setup.acceleration, side.age_doubt
            )
        sample = replace(sample, qdot=qdot)
    return replace(
        side,
        history=(*side.history, sample)[-HISTORY:],
        change=found,
        echoed=side.echoed + own,
    )


def _noise_found(setup: Setup, side: S, now: float) -> S:
    """Find how noisy a side is, now and then, while it is at rest."""
    if len(side.history) < HISTORY or now < side.noise_at + NOISE_EVERY_S:
        return side
    found = noise_at_rest([setup.to_border(sample.q) for sample in side.history])
    noise = side.noise
    if found is not None:
        noise += NOISE_GAIN * (found - noise)
    return replace(side, noise=noise, noise_at=now)


def answers(setup: Setup, side: Side, sample: JointMotion) -> bool:
    """Return whether a sample is the side's answer to our own set points."""
    config = change.widened(setup.config.change, side.noise)
    return echo.answers(side.tube, sample.time, setup.to_border(sample.q), config)


def agree(setup: Setup, side: S) -> S:
    """Take a side's newest position as agreed."""
    border = setup.to_border(side.last.q)
    agreed = change.take_baseline(side.change, side.last.time, border, setup.config.change)
    return replace(side, change=agreed)


def arrived(setup: Setup, side: S) -> S:
    """Take where a side rests as agreed.

    What was sent on the way there is done: who goes that way again moves of itself.
    """
    reach = change.settle_reach(setup.config.settle, setup.config.change)
    return replace(agree(setup, side), tube=echo.rested(side.tube, reach))


def agree_at_rest(setup: Setup, side: S) -> S:
    """Agree on the position of a side that has come to rest, if none is agreed on."""
    if not side.history or side.change.baseline:
        return side
    # By its newest sample: silence is no standing.
    if not change.stands_still(side.change, side.last.time, setup.config.change):
        return side
    return agree(setup, side)


def remember(setup: Setup, side: S, setpoints: Sequence[tuple[float, Joints]]) -> S:
    """Remember set points that the side is sent: what it does about them is an echo.

    Args:
        setup: Profile and numbers.
        side: The follower.
        setpoints: When each counts [s], and its joint positions, SI; instead of those that were to
            count then or later.
    """
    if not setpoints:
        return side
    told = [(t, setup.to_border(q)) for t, q in setpoints]
    return replace(side, tube=echo.remember(side.tube, told, MEMORY_S))


def noise_at_rest(rows: Sequence[Sequence[float]]) -> float | None:
    """Return the noise of the noisiest joint.

    White noise makes readings differ as much from one to the next as over a whole stretch; motion
    does not.

    Args:
        rows: Positions of one stretch, in the unit of the answer, shape ``(n, joints)``.

    Returns:
        Its standard deviation; None if a joint moves.
    """
    q, half = np.array(rows), len(rows) // 2
    step = np.sqrt(np.mean(np.diff(q, axis=0) ** 2, axis=0) / 2.0)
    drift = np.abs(q[:half].mean(axis=0) - q[half:].mean(axis=0))
    spread = q.std(axis=0)
    moves = (drift > DRIFTS * step * (2.0 / half) ** 0.5) | (spread > SPREADS * step)
    # A joint that repeats its reading stands, whatever rounding does to the means.
    if np.any(moves & (spread > 1e-9)):
        return None
    return float(spread.max())
