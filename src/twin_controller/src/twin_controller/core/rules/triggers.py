"""Say what has happened: conditions on the state become the triggers of the table."""

from __future__ import annotations

import msgspec

from twin_controller.core.events import Operator, SideName, TwinPlan
from twin_controller.core.following.follow import aligned, deviation
from twin_controller.core.observing import change
from twin_controller.core.observing.measure import side_lost
from twin_controller.core.rules.table import LEADING, Mode, Trigger
from twin_controller.core.safety.guard import Guard
from twin_controller.core.state import CoreState, Setup, Side

CONFIRM_S = 0.05
"""How long a change that is not confirmed yet is waited for [s]; a few samples."""

UNLED = (Mode.OFFLINE, Mode.FAULT)
"""Nobody leads and the mode stays; the real robot's own side can start it all the same."""


class Onsets(msgspec.Struct, frozen=True):
    """When each side moved on the controller's clock [s], and how uncertain their difference is."""

    real: float | None = None
    twin: float | None = None
    uncertainty: float = 0.0


def drop_stale(setup: Setup, state: CoreState, now: float) -> CoreState:
    """Forget a side that has been silent for too long."""
    sides: tuple[tuple[SideName, Side, float], ...] = (
        ("real", state.real, setup.config.real.stale_ms),
        ("twin", state.twin, setup.config.twin.stale_ms),
    )
    for name, side, limit_ms in sides:
        if side.connected and side.seen is not None and now - side.seen > limit_ms * 1e-3:
            state = side_lost(state, name, f"no fresh data for {limit_ms:g} ms")
    if state.motion is not None and now - state.motion.now > setup.config.twin.stale_ms * 1e-3:
        state = side_lost(state, "twin", f"its pose controller was silent for {setup.config.twin.stale_ms:g} ms")
    return state


def link_triggers(setup: Setup, state: CoreState) -> list[Trigger]:
    """Return LINK_LOST on the edge, LINKS_READY while OFFLINE and both sides are usable."""
    usable = all(side.connected and side.history for side in (state.real, state.twin)) and state.motion is not None
    if state.links_up and not usable:
        return [Trigger.LINK_LOST]
    known = state.real.clock.samples >= setup.config.real.samples and state.twin.clock.samples >= setup.config.twin.probes
    if state.mode is Mode.OFFLINE and usable and known:
        return [Trigger.LINKS_READY]
    return []


def safety_triggers(state: CoreState, now: float) -> list[Trigger]:
    """Return what forbids the present motion: a zone on its way, a person too close, the robot too fast.

    In a mode that a safety stop does not change only a real robot that moves counts, and not while a stop is on its way.
    """
    guard = state.guard if state.real.history else Guard()
    led = state.mode not in UNLED
    counts = guard.due(now) or (led and state.mode is not Mode.STOPPED)
    found = {
        Trigger.KEEP_OUT: (led and state.way.violation) or (counts and guard.violation),
        Trigger.TOO_CLOSE: counts and state.separation.too_close,
        Trigger.TOO_FAST: counts and guard.too_fast,
    }
    return [trigger for trigger, holds in found.items() if holds]


def onsets(setup: Setup, state: CoreState) -> Onsets:
    """Return when each side's change began; a side without a confirmed one has none."""
    config = setup.config.change
    real = state.real.change.onset if change.moved(state.real.change, config) else None
    twin = state.twin.change.onset if change.moved(state.twin.change, config) else None
    ahead = _planned_onset(setup, state)
    if twin is None or (ahead is not None and ahead < twin):
        twin = ahead
    return Onsets(real, twin, state.real.clock.uncertainty + state.twin.clock.uncertainty)


def _planned_onset(setup: Setup, state: CoreState) -> float | None:
    """Return when the twin's announced motion leaves its agreed position [s], None if nothing is announced."""
    plan, motion, baseline = state.plan, state.motion, state.twin.change.baseline
    if plan is None or motion is None or motion.state not in ("announcing", "moving") or not baseline:
        return None
    return _first_row_away(setup, plan, baseline, state)


def _first_row_away(setup: Setup, plan: TwinPlan, baseline: tuple[float, ...], state: CoreState) -> float | None:
    threshold = setup.config.change.hysteresis
    begin = state.twin.clock.to_remote(state.mode_since) - plan.stamp
    for offset, row in zip(plan.times, plan.q):
        if offset < begin:
            continue
        if max(abs(a - b) for a, b in zip(setup.to_border(row), baseline)) > threshold:
            return state.twin.clock.to_local(plan.stamp + offset)
    return None


def leader_triggers(setup: Setup, state: CoreState) -> list[Trigger]:
    """Say who moved first, once both sides' data reach past the earlier onset; a tie goes to the real robot."""
    if state.mode not in (Mode.IDLE, Mode.STOPPED) or not state.real.history or not state.twin.history:
        return []
    found = onsets(setup, state)
    if found.real is None and found.twin is None:
        return []
    if found.real is None:
        assert found.twin is not None
        tie = found.twin + found.uncertainty
        waits = state.real.last.t < tie and found.twin <= state.twin.last.t
        return [] if waits or _may_be_first(state.real, tie) else [_twin_moved(setup, state)]
    if found.twin is None:
        waits = state.twin.last.t < found.real
        return [] if waits or _may_be_first(state.twin, found.real - found.uncertainty) else [Trigger.REAL_MOVED]
    if found.real <= found.twin + found.uncertainty:
        return [Trigger.REAL_MOVED]
    return [_twin_moved(setup, state)]


def _may_be_first(side: Side, onset: float) -> bool:
    """Return whether a side's change that is not confirmed yet began before ``onset`` [s]; that shows within a few samples."""
    began = side.change.onset
    return began is not None and began < onset and side.last.t < onset + CONFIRM_S


def _twin_moved(setup: Setup, state: CoreState) -> Trigger:
    """Return whether the twin may lead: only one whose agreed position is the real robot's."""
    return Trigger.TWIN_MOVED if pair_agreed(setup, state) else Trigger.TWIN_MOVED_UNALIGNED


def pair_agreed(setup: Setup, state: CoreState) -> bool:
    """Return whether the agreed positions of both sides are close enough for the twin to lead, and it may by its last stop."""
    if state.must_align:
        return False
    pair = list(zip(state.real.change.baseline, state.twin.change.baseline))
    return bool(pair) and max(abs(a - b) for a, b in pair) <= setup.config.align.lead_tolerance


def rest_triggers(setup: Setup, state: CoreState, now: float) -> list[Trigger]:
    """Return whether an alignment or a motion has ended."""
    config = setup.config
    if state.mode is Mode.ALIGNING:
        if aligned(setup, state, now):
            return [Trigger.ALIGNED]
        return [Trigger.ALIGN_FAILED] if now - state.mode_since > config.align.timeout_ms * 1e-3 else []
    if state.mode not in LEADING or not _both_rest(setup, state, now):
        return []
    if deviation(setup, state) <= config.settle.tolerance:
        return [Trigger.AT_REST]
    since = max(state.real.change.still_since, state.twin.change.still_since, state.mode_since)
    return [Trigger.UNSETTLED] if now - since > config.settle.timeout_ms * 1e-3 else []


def _both_rest(setup: Setup, state: CoreState, now: float) -> bool:
    """Return whether nothing moves and nobody is going to."""
    flags, motion = state.flags, state.motion
    if flags is None or motion is None or flags.own_program or state.move_pending:
        return False
    if now - state.mode_since < setup.config.settle.minimum_ms * 1e-3:
        return False
    if motion.state not in ("idle", "following"):
        return False
    return all(change.stands_still(side.change, now, setup.config.change) for side in (state.real, state.twin))


def operator_trigger(setup: Setup, state: CoreState, event: Operator) -> Trigger | None:
    """Return the trigger of an operator's command, None for one that is not in the table."""
    if event.command in ("MOVE", "MOVE_JOINTS", "HOME"):
        return Trigger.MOVE if pair_agreed(setup, state) else Trigger.MOVE_UNALIGNED
    if event.command == "RESUME" and state.resume_blocked:
        return Trigger.RESUME_BLOCKED
    if event.command == "RESET" and not state.links_up:
        return Trigger.RESET_BLOCKED
    return Trigger.__members__.get(event.command) if event.command in COMMANDS else None


COMMANDS = ("STOP", "PAUSE", "RESUME", "RESET", "ESTOP", "ALIGN", "ACKNOWLEDGE")
