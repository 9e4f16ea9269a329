"""Say what has happened: conditions on the state become the triggers of the table."""

from __future__ import annotations

import msgspec
import numpy as np

from twin_controller.core.control import unasked
from twin_controller.core.events import (
    AnyEvent,
    Operator,
    RealMeasured,
    TwinMeasured,
    TwinMotion,
    TwinPlan,
)
from twin_controller.core.follow.real import jogs_ahead
from twin_controller.core.follow.twin import aligned, sent_to_rest
from twin_controller.core.lead.modes import COMMANDS, MOVES, Mode, Trigger
from twin_controller.core.lead.reports import moved_since_pause, resume_blocked, side_triggers
from twin_controller.core.lead.standing import moved_since
from twin_controller.core.lead.table import LEADING, look_up
from twin_controller.core.orders.order import fresh
from twin_controller.core.orders.state import held_there
from twin_controller.core.orders.stop import disobeyed, twin_disobeyed
from twin_controller.core.orders.stream import unstartable
from twin_controller.core.safety.guard import Guard
from twin_controller.core.setup import Setup
from twin_controller.core.sides import change
from twin_controller.core.sides.pairing import deviation
from twin_controller.core.sides.side import Side
from twin_controller.core.state import CoreState
from twin_controller.estimation.rhythm import ENOUGH

UNLED = (Mode.OFFLINE, Mode.FAULT)
"""Nobody leads and the mode stays; the real robot's own side can start it all the same."""


AT_REST = (Mode.STOPPED, Mode.PAUSED, Mode.STANDSTILL)
"""Both were told to stand: only a real robot that moves all the same counts for safety."""


class Onsets(msgspec.Struct, frozen=True):
    """When each side moved on our clock [s], and how uncertain their difference is."""

    real: float | None = None
    twin: float | None = None
    uncertainty: float = 0.0


def find_trigger(setup: Setup, state: CoreState, event: AnyEvent) -> Trigger | None:
    """Return the most urgent trigger that means something in this mode."""
    lead, now = state.lead, event.now
    # Without its links the pair cannot be judged: what a side reported before counts no more.
    found = link_triggers(setup, state) or side_triggers(setup, state, now)
    # Only a side that answers can ignore a stop.
    if isinstance(event, TwinMeasured) and twin_disobeyed(state.orders.twin_stop, now):
        found = [Trigger.TWIN_STOP_IGNORED, *found]
    if isinstance(event, RealMeasured) and disobeyed(state.orders.stop, setup.config.stop, now):
        found = [Trigger.STOP_IGNORED, *found]
    if isinstance(event, RealMeasured | TwinMeasured | TwinPlan | TwinMotion):
        # Counts in a monitored standstill alone: a side has left the place where it came to rest.
        sides, config = (state.sides.real, state.sides.twin), setup.config.change
        if any(change.moved(side.change, config) for side in sides):
            found = [*found, Trigger.STANDSTILL_LOST]
        found = [
            *found,
            *safety_triggers(state, now),
            *leader_triggers(setup, state),
            *rest_triggers(setup, state, now),
        ]
    counts = (each for each in found if not look_up(lead.mode, each, lead.paused).silent)
    return next(counts, None)


def link_triggers(setup: Setup, state: CoreState) -> list[Trigger]:
    """Return LINK_LOST on the edge, or LINKS_READY while OFFLINE and both sides are usable.

    An alignment waits for the sensors of people too: it would be stopped at once.
    """
    sides, config = state.sides, setup.config
    if state.lead.links_up and not sides.usable:
        return [Trigger.LINK_LOST]
    known = (
        sides.real.clock.samples >= config.real.samples
        and sides.twin.clock.samples >= config.twin.probes
    )
    if sides.real.flags is not None and not sides.real.flags.motion.qdot:
        # Speeds are differences over its clock, which is too rough before its rhythm is known; that
        # all stamps are even tells of the clock's ticks alone.
        known = known and sides.real.rhythm.count >= ENOUGH
    seeing = not state.safety.separation.silent
    ready = state.lead.mode is Mode.OFFLINE and sides.usable and known and seeing
    if ready:
        stopped = state.lead.was_stopped
        return [Trigger.LINKS_READY_STOPPED if stopped else Trigger.LINKS_READY]
    return []


def safety_triggers(state: CoreState, now: float) -> list[Trigger]:
    """Return what forbids the present motion: a zone on its way, a person too close, too fast.

    In a mode that a safety stop does not change only a real robot that moves counts, and not while
    a stop is on its way.
    """
    mode, safety = state.lead.mode, state.safety
    guard = safety.guard if state.sides.real.history else Guard()
    led = mode not in UNLED
    again = guard.moves and not fresh(state.orders.safety_stop, now)
    counts = again or (led and mode not in AT_REST)
    found = {
        Trigger.KEEP_OUT: (led and safety.way.violation) or (counts and guard.violation),
        Trigger.TOO_CLOSE: counts and safety.separation.too_close,
        Trigger.TOO_FAST: counts and guard.too_fast,
    }
    return [trigger for trigger, holds in found.items() if holds]


def onsets(setup: Setup, state: CoreState) -> Onsets:
    """Return when each side's change began; a side without a confirmed one has none."""
    sides = state.sides
    real, twin = _onset(setup, sides.real), _onset(setup, sides.twin)
    # An announcement tells of the twin's motion before any sample can.
    ahead = _planned_onset(setup, state)
    if twin is None or (ahead is not None and ahead < twin):
        twin = ahead
    return Onsets(real, twin, sides.real.clock.uncertainty + sides.twin.clock.uncertainty)


def _onset(setup: Setup, side: Side) -> float | None:
    confirmed = change.moved(side.change, setup.config.change)
    if confirmed:
        return side.change.onset
    return None


def _planned_onset(setup: Setup, state: CoreState) -> float | None:
    """Return when the twin's announced motion leaves its agreed position [s]; None without one."""
    twin = state.sides.twin
    plan, motion, baseline = twin.plan, twin.motion, twin.change.baseline
    if plan is None or motion is None or not baseline:
        return None
    # Right after a stop, what was said of a jog before it may still be on its way.
    jogs = plan.jog and state.lead.mode is Mode.IDLE
    if motion.state not in ("announcing", "moving") and not jogs:
        return None
    threshold = setup.config.change.hysteresis
    # What the plan holds from before this mode is no motion in it.
    begin = twin.clock.to_remote(state.lead.since) - plan.stamp
    for offset, row in plan.rows:
        if offset < begin:
            continue
        if max(abs(a - b) for a, b in zip(setup.to_border(row), baseline)) > threshold:
            return twin.clock.to_local(plan.stamp + offset)
    return None


def leader_triggers(setup: Setup, state: CoreState) -> list[Trigger]:
    """Say who moved first, once both sides' data reach past the earlier onset."""
    real, twin = state.sides.real, state.sides.twin
    if state.lead.mode not in (Mode.IDLE, Mode.STOPPED) or not state.sides.known:
        return []
    found = onsets(setup, state)
    if state.lead.mode is Mode.STOPPED:
        # Nothing from here moves the robot then: who does stands beside it, and is first.
        return [Trigger.REAL_MOVED] if found.real is not None else []
    wait = setup.config.change.confirm_wait_ms * 1e-3
    if found.real is None and found.twin is None:
        return []
    if found.real is None and found.twin is not None:
        # The real robot may have moved too: its data must reach past what would be a tie.
        tie = found.twin + found.uncertainty
        waits = real.last.time < tie and found.twin <= twin.last.time
        if waits or _may_be_first(real, tie, wait):
            return []
        return [_twin_moved(setup, state)]
    assert found.real is not None
    if found.twin is None:
        waits = twin.last.time < found.real
        if waits or _may_be_first(twin, found.real - found.uncertainty, wait):
            return []
        return [Trigger.REAL_MOVED]
    # Closer than the clocks are known is a tie, and the real robot wins it.
    if found.real <= found.twin + found.uncertainty:
        return [Trigger.REAL_MOVED]
    return [_twin_moved(setup, state)]


def _may_be_first(side: Side, onset: float, wait: float) -> bool:
    """Return whether a change that is not confirmed yet began before ``onset`` [s].

    That shows within a few samples, so it is waited for no longer than ``wait`` [s].
    """
    began = side.change.onset
    return began is not None and began < onset and side.last.time < onset + wait


def _twin_moved(setup: Setup, state: CoreState) -> Trigger:
    """Return whether the twin may lead.

    It must be the motion of who holds control, if somebody does, and its agreed position that of
    the real robot.
    """
    if unstartable(setup, state.sides.real.flags):
        return Trigger.TWIN_MOVED_UNLED
    if unasked(state.lead.control):
        return Trigger.TWIN_MOVED_UNASKED
    if pair_agreed(setup, state):
        return Trigger.TWIN_MOVED
    return Trigger.TWIN_MOVED_UNALIGNED


def pair_agreed(setup: Setup, state: CoreState) -> bool:
    """Return whether the twin may lead: the agreed positions are close, no reset came since."""
    if state.lead.must_align:
        return False
    real, twin = state.sides.real.change.baseline, state.sides.twin.change.baseline
    pair = list(zip(real, twin))
    return bool(pair) and max(abs(a - b) for a, b in pair) <= setup.config.align.lead_tolerance


def _goes_on(setup: Setup, real: Side, now: float) -> bool:
    """Return whether the robot is under way: each of its newest readings is off each oldest one.

    One reading alone, however far off, may be a damaged answer.
    """
    config = setup.config.change
    if change.stands_still(real.change, now, config) or len(real.history) < 2 * config.window:
        return False
    rows = np.array([setup.to_border(sample.q) for sample in real.history])
    apart = np.abs(rows[-config.window :, np.newaxis] - rows[: config.window]).max(axis=-1)
    return bool(apart.min() > config.hysteresis)


def rest_triggers(setup: Setup, state: CoreState, now: float) -> list[Trigger]:
    """Return whether an alignment or a motion has ended."""
    config, lead, sides = setup.config, state.lead, state.sides
    if lead.mode is Mode.ALIGNING:
        if aligned(setup, state.follow.twin, sides, lead.since, now):
            if change.stands_still(sides.real.change, now, config.change):
                return [Trigger.ALIGNED]
            if _goes_on(setup, sides.real, now):
                return [Trigger.CAUGHT_UP]
        failed = now - lead.since > config.align.timeout_ms * 1e-3
        if failed:
            return [Trigger.ALIGN_FAILED]
        return []
    if lead.mode not in LEADING or not _both_rest(setup, state, now):
        return []
    if deviation(setup, sides) <= config.settle.tolerance:
        flags = sides.real.flags
        unled = flags is not None and flags.streaming and not flags.paused
        unled = unled and lead.mode is Mode.REAL_LEADS
        return [Trigger.AT_REST_STREAMED if unled else Trigger.AT_REST]
    since = max(sides.real.change.still_since, sides.twin.change.still_since, lead.since)
    if now - since > config.settle.timeout_ms * 1e-3:
        return [Trigger.UNSETTLED]
    return []


def _both_rest(setup: Setup, state: CoreState, now: float) -> bool:
    """Return whether nothing moves and nobody is going to."""
    lead, sides, config = state.lead, state.sides, setup.config
    flags, motion = sides.real.flags, sides.twin.motion
    if flags is None or motion is None or flags.own_program or lead.move_pending:
        return False
    # A leader that has only just begun still stands.
    if now - lead.since < config.settle.minimum_ms * 1e-3:
        return False
    # A twin that leads may follow a trajectory that stands for a moment.
    ended = ("idle", "following") if lead.mode is Mode.REAL_LEADS else ("idle",)
    if motion.state not in ended or jogs_ahead(sides.twin, now):
        return False
    if not sent_to_rest(setup, state.follow.twin, now):
        return False
    return all(
        change.stands_still(side.change, now, config.change) for side in (sides.real, sides.twin)
    )


def operator_trigger(setup: Setup, state: CoreState, event: Operator) -> Trigger | None:
    """Return the trigger of an operator's command, None for one that is not in the table."""
    if event.command in MOVES:
        # A stopped side that was moved since has another place than the agreed one.
        apart = state.lead.mode is Mode.STOPPED and moved_since(setup, state.sides)
        agreed = pair_agreed(setup, state) and not apart
        return Trigger.MOVE if agreed else Trigger.MOVE_UNALIGNED
    flags = state.sides.real.flags
    if event.command == "ACKNOWLEDGE" and not state.lead.needs_acknowledge:
        return Trigger.ACKNOWLEDGE_NOTHING
    if event.command == "RESUME" and resume_blocked(state):
        return Trigger.RESUME_BLOCKED
    if event.command == "RESUME" and held_there(setup.config.stop, state.orders, flags):
        return Trigger.RESUME_HELD
    if event.command == "RESUME" and moved_since_pause(setup, state):
        return Trigger.RESUME_MOVED
    if event.command == "RESET" and not (state.lead.links_up and state.sides.usable):
        return Trigger.RESET_BLOCKED
    if event.command == "RESET" and flags is not None and flags.estop_pressed:
        return Trigger.RESET_PRESSED
    if event.command in COMMANDS:
        return Trigger[event.command]
    return None
