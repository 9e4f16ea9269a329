"""Take measurements in: clocks, histories, changes, standstill, lag."""

from __future__ import annotations

import msgspec

from twin_controller.core.events import ClockProbe, LinkChanged, RealMeasured, SideName, TwinMeasured
from twin_controller.core.observing import change, clock, echo
from twin_controller.core.observing.clock import ClockEstimate
from twin_controller.core.rules.table import LEADING, Mode
from twin_controller.core.state import HISTORY, CoreState, Sample, Setup, Side

replace = msgspec.structs.replace

FUTURE_S = 0.1
"""A stamp so far ahead [s] shows that a clock jumped; a simulator that catches up may be a little ahead."""

FOLLOWING_REAL = (Mode.TWIN_LEADS, Mode.OPERATOR_LEADS)


def link_changed(state: CoreState, event: LinkChanged) -> CoreState:
    """Forget what was known of a side when its link changes: nothing old may count after a reconnect."""
    jumps = (state.real if event.side == "real" else state.twin).clock.jumps
    side = Side(connected=event.connected, reason=event.reason, clock=ClockEstimate(jumps=jumps))
    if event.side == "real":
        return replace(state, real=side, flags=None, clock_ms=None, alarm="")
    return replace(state, twin=side, motion=None, plan=None, speed=replace(state.speed, cap_sent=None))


def side_lost(state: CoreState, side: SideName, reason: str) -> CoreState:
    """Forget a side whose link stands but whose data cannot be used."""
    return link_changed(state, LinkChanged(0.0, side, True, reason))


def real_measured(setup: Setup, state: CoreState, event: RealMeasured) -> CoreState:
    """Take one answer of the real robot in."""
    config = setup.config
    clock_ms = clock.unwrap_ms(state.clock_ms, event.clock_ms)
    if clock_ms == state.clock_ms:
        return state
    estimate = clock.observe(
        state.real.clock,
        clock_ms * 1e-3,
        event.sent,
        event.received,
        config.real.clock_drift_ppm,
        config.real.sample_period_ms * 1e-3,
        config.real.sample_latency_ms * 1e-3,
    )
    if estimate.jumps != state.real.clock.jumps:
        lost = side_lost(state, "real", "its clock jumped")
        return replace(lost, real=replace(lost.real, clock=ClockEstimate(jumps=estimate.jumps)))
    sample = Sample(estimate.to_local(clock_ms * 1e-3), event.q, event.qdot)
    seen = min(event.received, sample.t + estimate.uncertainty)
    side = _sampled(setup, replace(state.real, clock=estimate, seen=seen), sample)
    state = replace(state, real=side, flags=event, clock_ms=clock_ms)
    return replace(state, lag=_adapted_lag(setup, state)) if state.mode in FOLLOWING_REAL else state


def twin_measured(setup: Setup, state: CoreState, event: TwinMeasured) -> CoreState:
    """Take one joint state of the twin in; before its clock is known it only shows that the twin lives."""
    side = state.twin
    if not side.clock.known:
        return state
    sample = Sample(side.clock.to_local(event.stamp), event.q, event.qdot)
    if side.history and sample.t <= side.last.t:
        return state
    latest = sample.t - side.clock.uncertainty
    if latest > event.now + FUTURE_S:
        return side_lost(state, "twin", f"its stamps are {latest - event.now:.3g} s ahead of its clock")
    seen = min(event.now, sample.t + side.clock.uncertainty)
    return replace(state, twin=_sampled(setup, replace(side, seen=seen), sample))


def clock_probed(setup: Setup, state: CoreState, event: ClockProbe) -> CoreState:
    """Narrow the estimate of the twin's clock."""
    estimate = clock.observe(state.twin.clock, event.remote, event.sent, event.received, setup.config.twin.clock_drift_ppm)
    if estimate.jumps != state.twin.clock.jumps:
        lost = side_lost(state, "twin", "its clock jumped")
        return replace(lost, twin=replace(lost.twin, clock=ClockEstimate(jumps=estimate.jumps)))
    return replace(state, twin=replace(state.twin, clock=estimate))


def _sampled(setup: Setup, side: Side, sample: Sample) -> Side:
    """Append a sample and judge whether the side moved."""
    config = setup.config.change
    if side.history and sample.t <= side.last.t:
        return side
    border = setup.to_border(sample.q)
    rest = config.hysteresis + 0.5 * 10.0**-config.decimals
    own = echo.is_echo(side.tube, sample.t, border, config.echo_memory_ms * 1e-3, rest, config.echo_tolerance)
    # A side that counts as standing may still move by its tolerance.
    duration, reach = setup.config.settle.timeout_ms * 1e-3, setup.config.settle.tolerance + 2.0 * config.still_tolerance
    known = change.settle(side.change, sample.t, config, duration, reach)
    return replace(
        side,
        history=(*side.history, sample)[-HISTORY:],
        change=change.update(known, sample.t, border, config, echo=own),
        echoed=side.echoed + own,
    )


def agree(setup: Setup, side: Side) -> Side:
    """Take a side's newest position as agreed."""
    agreed = change.take_baseline(side.change, side.last.t, setup.to_border(side.last.q), setup.config.change)
    return replace(side, change=agreed)


def interpolate(history: tuple[Sample, ...], t: float) -> Sample | None:
    """Return the side at ``t`` by cubic interpolation inside the history, None outside."""
    for before, after in zip(reversed(history[:-1]), reversed(history[1:])):
        if before.t <= t <= after.t:
            return _hermite(before, after, t)
    return None


def paired(state: CoreState) -> tuple[Sample, Sample] | None:
    """Return the newest sample of the real robot that the twin's history covers, and the twin at that instant."""
    for real in reversed(state.real.history[-4:]):
        twin = interpolate(state.twin.history, real.t)
        if twin is not None:
            return real, twin
    return None


def _hermite(before: Sample, after: Sample, t: float) -> Sample:
    """Interpolate between two samples by position and velocity."""
    h = after.t - before.t
    u = (t - before.t) / h
    a, b, c, d = (1 + 2 * u) * (1 - u) ** 2, u * (1 - u) ** 2 * h, u * u * (3 - 2 * u), u * u * (u - 1) * h
    da, db, dc, dd = 6 * u * (u - 1) / h, (1 - u) * (1 - 3 * u), 6 * u * (1 - u) / h, u * (3 * u - 2)
    q = tuple(a * p + b * v + c * r + d * w for p, v, r, w in zip(before.q, before.qdot, after.q, after.qdot))
    qdot = tuple(da * p + db * v + dc * r + dd * w for p, v, r, w in zip(before.q, before.qdot, after.q, after.qdot))
    return Sample(t, q, qdot)


LAG_GAIN = 0.02
LAG_SPEED = 0.1


def _adapted_lag(setup: Setup, state: CoreState) -> float:
    r"""Correct the real robot's lag by what remains: :math:`\delta = \sum \dot q (q_{twin} - q_{real}) / \sum \dot q^2`."""
    pair = paired(state)
    if pair is None or state.mode not in LEADING:
        return state.lag
    real, twin = pair
    speed = [v / limit for v, limit in zip(twin.qdot, setup.velocity)]
    energy = sum(v * v for v in speed)
    if energy < LAG_SPEED**2:
        return state.lag
    behind = sum(v * (a - b) / limit for v, a, b, limit in zip(speed, twin.q, real.q, setup.velocity)) / energy
    low, high = (bound * 1e-3 for bound in setup.config.real.follow_lag_range_ms)
    return min(max(state.lag + LAG_GAIN * behind, low), high)
