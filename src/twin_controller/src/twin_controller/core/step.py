"""One step of the twin controller: (setup, state, event) -> (state, actions)."""

from __future__ import annotations

import math

import msgspec

from twin_controller.core import reports, triggers
from twin_controller.core.actions import AnyAction, Decided, Do, OverrideReal, Perform, Reply
from twin_controller.core.events import (
    AnyEvent,
    ClockProbe,
    LinkChanged,
    MoveEnded,
    Operator,
    RealAlarm,
    RealMeasured,
    TwinMeasured,
    TwinMotion,
    TwinPlan,
)
from twin_controller.core.following.follow import bounds_of, follow_twin, stream_real
from twin_controller.core.following.gate import check_setpoint
from twin_controller.core.observing import change
from twin_controller.core.observing.divergence import DivergenceState
from twin_controller.core.observing.measure import clock_probed, link_changed, real_measured, twin_measured
from twin_controller.core.perform import perform
from twin_controller.core.state import CoreState, Setup
from twin_controller.core.supervise import cap_speed, judge_divergence
from twin_controller.core.table import RESUMING, Mode, Row, Trigger, look_up

replace = msgspec.structs.replace
Result = tuple[CoreState, list[AnyAction]]

LEADERS = {Mode.REAL_LEADS: "real", Mode.TWIN_LEADS: "twin", Mode.OPERATOR_LEADS: "operator"}
ONSET_TRIGGERS = (Trigger.REAL_MOVED, Trigger.TWIN_MOVED, Trigger.TWIN_MOVED_UNALIGNED, Trigger.REAL_TOOK_OVER)


def step(setup: Setup, state: CoreState, event: AnyEvent) -> Result:
    """Take one input in and decide.

    Args:
        setup: Profile and numbers.
        state: Everything known so far.
        event: The input; ``event.now`` never decreases.

    Returns:
        The new state, and the actions in the order in which they are to be carried out.
    """
    actions: list[AnyAction] = []
    state = _absorb(setup, state, event)
    state = triggers.drop_stale(setup, state, event.now)
    state = _remember_pauses(setup, state, event.now)
    trigger = _first_that_counts(setup, state, event)
    if trigger is not None:
        state, done = _transition(setup, state, trigger, event.now)
        actions += done
    if isinstance(event, Operator):
        state, done = _operate(setup, state, event)
        actions += done
    if isinstance(event, RealMeasured):
        state, done = _command_followers(setup, state, event.now)
        actions += done
    state, done = cap_speed(setup, state, event.now)
    return replace(state, links_up=_usable(state)), actions + done


def _first_that_counts(setup: Setup, state: CoreState, event: AnyEvent) -> Trigger | None:
    """Return the most urgent trigger that means something in this mode."""
    found = triggers.link_triggers(setup, state) or reports.side_triggers(setup, state, event.now)
    if isinstance(event, RealMeasured | TwinMeasured | TwinPlan | TwinMotion):
        found = [*found, *triggers.leader_triggers(setup, state), *triggers.rest_triggers(setup, state, event.now)]
    return next((trigger for trigger in found if not look_up(state.mode, trigger, state.paused_mode).silent), None)


def _usable(state: CoreState) -> bool:
    """Return whether both sides are connected and fresh."""
    return all(side.connected and side.history for side in (state.real, state.twin)) and state.motion is not None


def _absorb(setup: Setup, state: CoreState, event: AnyEvent) -> CoreState:
    """Take the input's data in; decide nothing."""
    match event:
        case LinkChanged():
            return link_changed(state, event)
        case RealMeasured():
            state = real_measured(setup, state, event)
            stream = state.stream
            if stream is not None and event.streaming and not event.paused:
                state = replace(state, stream=replace(stream, seen=True))
            return state if event.own_program else replace(state, program_was_off=True)
        case RealAlarm():
            return replace(state, alarm=event.text)
        case TwinMeasured():
            return judge_divergence(setup, twin_measured(setup, state, event))
        case TwinPlan():
            return replace(state, plan=event)
        case TwinMotion():
            return replace(state, motion=event)
        case ClockProbe():
            return clock_probed(setup, state, event)
        case MoveEnded():
            return replace(state, move_pending=False, why=state.why if event.success else f"the twin's move: {event.message}")
    return state


def _remember_pauses(setup: Setup, state: CoreState, now: float) -> CoreState:
    """Note that a side has paused, and agree on positions once a stopped side stands still."""
    if state.mode is Mode.PAUSED and state.flags is not None and state.motion is not None:
        real, twin = state.paused_seen
        seen = (real or state.flags.paused, twin or state.motion.state in ("pausing", "paused"))
        return state if seen == state.paused_seen else replace(state, paused_seen=seen)
    if state.mode is not Mode.STOPPED or now - state.mode_since < setup.config.settle.minimum_ms * 1e-3:
        return state
    for name in ("real", "twin"):
        side = getattr(state, name)
        if side.history and not side.change.baseline and change.stands_still(side.change, now, setup.config.change):
            agreed = change.take_baseline(side.change, setup.to_border(side.last.q), setup.config.change)
            state = replace(state, **{name: replace(side, change=agreed)})
    return state


def _transition(setup: Setup, state: CoreState, trigger: Trigger, now: float, command: Operator | None = None) -> Result:
    """Look the row up, carry its state changes out, record the decision."""
    row = look_up(state.mode, trigger, state.paused_mode)
    if row.silent:
        return state, []
    before, seen = state.mode, triggers.onsets(setup, state)
    why = f"{trigger.value}{_detail(state, trigger)}: {row.why}" if row.why else trigger.value
    state = _enter(state, row, trigger, now)
    actions: list[AnyAction] = []
    for do in row.do:
        state, done = perform(setup, state, do, why, now, command)
        actions += done
    shown = trigger in ONSET_TRIGGERS
    decision = Decided(
        seq=state.seq + 1,
        now=now,
        mode_before=before.value,
        trigger=trigger.name,
        mode_after=state.mode.value,
        leader=state.leader,
        actions=tuple(do.name for do in row.do),
        why=why,
        onset_real=seen.real if shown else None,
        onset_twin=seen.twin if shown else None,
        onset_uncertainty=seen.uncertainty if shown else 0.0,
    )
    kept = (*state.decisions, decision)[-setup.config.decision_history :]
    return replace(state, seq=decision.seq, why=why, decisions=kept), [decision, *actions]


def _detail(state: CoreState, trigger: Trigger) -> str:
    """Return what a person wants to know beside the trigger."""
    if trigger is Trigger.LINK_LOST:
        down = [f"{name}: {side.reason}" for name, side in (("real", state.real), ("twin", state.twin)) if not side.history]
        return f" ({'; '.join(down)})"
    return f" ({state.alarm})" if trigger is Trigger.REAL_FAULT and state.alarm else ""


def _enter(state: CoreState, row: Row, trigger: Trigger, now: float) -> CoreState:
    """Change the mode and forget what belonged to the old one."""
    if trigger is Trigger.ACKNOWLEDGE:
        state = replace(state, needs_acknowledge=False)
    if trigger is Trigger.RESET_FAILED:
        state = replace(state, reset_since=None)
    mode = row.to or state.mode
    if mode is state.mode and mode is not Mode.OFFLINE:
        return state
    paused = state.mode if mode is Mode.PAUSED else None
    active = paused or mode
    follows_real = active in (Mode.ALIGNING, Mode.REAL_LEADS)
    follows_twin = active in (Mode.TWIN_LEADS, Mode.OPERATOR_LEADS)
    if mode in (Mode.STOPPED, Mode.FAULT, Mode.ESTOP, Mode.OFFLINE):
        state = replace(
            state,
            real=replace(state.real, change=change.drop_baseline(state.real.change)),
            twin=replace(state.twin, change=change.drop_baseline(state.twin.change)),
            program_was_off=False,
        )
    return replace(
        state,
        mode=mode,
        mode_since=now,
        leader=LEADERS.get(active, ""),
        follow=state.follow if follows_real else None,
        stream=state.stream if follows_twin else None,
        paused_mode=paused,
        paused_seen=(False, False),
        needs_acknowledge=trigger is Trigger.DIVERGED if mode is Mode.PAUSED else False,
        reset_since=None,
        move_pending=state.move_pending and active is Mode.OPERATOR_LEADS,
        divergence=DivergenceState() if trigger in RESUMING else state.divergence,
    )


def _operate(setup: Setup, state: CoreState, event: Operator) -> Result:
    """Judge a command of the operator; every command is answered."""
    if event.command == "SPEED":
        if not 1.0 <= event.speed_percent <= 100.0:
            return state, [Reply(event.id, False, f"speed_percent = {event.speed_percent:g} is outside [1, 100]")]
        state = replace(state, speed=replace(state.speed, cap=event.speed_percent))
        return state, [
            OverrideReal(event.speed_percent),
            Reply(event.id, True, f"speed of both capped at {event.speed_percent:g} %"),
        ]
    trigger = triggers.operator_trigger(setup, state, event)
    if trigger is None:
        allowed = ", ".join((*triggers.COMMANDS, "HOME", "MOVE", "MOVE_JOINTS", "SPEED"))
        return state, [Reply(event.id, False, f"unknown command {event.command!r}: allowed are {allowed}")]
    invalid = _invalid_target(setup, event)
    if invalid:
        return state, [Reply(event.id, False, invalid)]
    row = look_up(state.mode, trigger, state.paused_mode)
    state, actions = _transition(setup, state, trigger, event.now, event)
    text = row.why or trigger.value
    return state, [*actions, Reply(event.id, not row.refused, text if row.refused else f"{state.mode}: {text}")]


def _invalid_target(setup: Setup, event: Operator) -> str:
    """Return why the command's target or speed is invalid, or an empty text."""
    if event.command not in ("MOVE", "MOVE_JOINTS", "HOME"):
        return ""
    if not (math.isfinite(event.speed_percent) and (event.speed_percent == 0.0 or 1.0 <= event.speed_percent <= 100.0)):
        return f"speed_percent = {event.speed_percent:g} is neither 0 (default) nor in [1, 100]"
    if event.command == "MOVE":
        valid = len(event.target) == 3 and all(map(math.isfinite, event.target))
        return "" if valid else f"target = {list(event.target)} is not three finite coordinates"
    return check_setpoint(event.target, bounds_of(setup)) if event.command == "MOVE_JOINTS" else ""


def _command_followers(setup: Setup, state: CoreState, now: float) -> Result:
    """Send the follower its next set point, once for each answer of the real robot."""
    state, actions = follow_twin(setup, state, now)
    state, streamed, rejected = stream_real(setup, state, now)
    actions += streamed
    if rejected:
        state, done = _transition(setup, state, Trigger.REJECTED, now)
        state = replace(state, why=f"{state.why} ({rejected})")
        return state, actions + [_with_reason(action, rejected) for action in done]
    if not streamed:
        return state, actions
    return _start_stream(setup, state, actions, now)


def _start_stream(setup: Setup, state: CoreState, actions: list[AnyAction], now: float) -> Result:
    """Ask for the stream program behind a fresh set point; again when the robot does not report it."""
    stream, flags, config = state.stream, state.flags, setup.config.stream
    if stream is None or flags is None or flags.own_program or state.mode is Mode.PAUSED:
        return state, actions
    late = not stream.seen and now - stream.started > config.retry_ms * 1e-3 and stream.attempts < config.attempts
    if not stream.starting and not late:
        return state, actions
    stream = replace(stream, starting=False, started=now, attempts=stream.attempts + 1)
    reason = "the robot did not start it yet" if late else "the real robot follows"
    return replace(state, stream=stream), [*actions, Perform(Do.START_STREAM, reason)]


def _with_reason(action: AnyAction, reason: str) -> AnyAction:
    """Add the rejection's reason to a decision."""
    return replace(action, why=f"{action.why} ({reason})") if isinstance(action, Decided) else action
