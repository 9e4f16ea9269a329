"""One step of the twin controller: (setup, state, event) -> (state, actions)."""

from __future__ import annotations

import msgspec

from twin_controller.core.actions import AnyAction, Decided, Do, Perform
from twin_controller.core.events import (
    AnyEvent,
    ClockProbe,
    LinkChanged,
    MoveEnded,
    Operator,
    PersonSeen,
    RealAlarm,
    RealMeasured,
    TwinMeasured,
    TwinMotion,
    TwinPlan,
)
from twin_controller.core.following.follow import follow_twin, stream_real
from twin_controller.core.gripping import watch_grippers
from twin_controller.core.insist import ignored, insist, real_answered
from twin_controller.core.observing import change
from twin_controller.core.observing.measure import agree, clock_probed, link_changed, real_measured, twin_measured
from twin_controller.core.operate import operate
from twin_controller.core.rules import reports, triggers
from twin_controller.core.rules.table import Mode, Trigger, look_up
from twin_controller.core.safety.sightings import Person, newest
from twin_controller.core.state import CoreState, Setup
from twin_controller.core.supervise import cap_speed, judge_divergence, judge_move, watch_real
from twin_controller.core.transition import transition

replace = msgspec.structs.replace
Result = tuple[CoreState, list[AnyAction]]


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
    newest = state.real.history[-1:]
    state = _absorb(setup, state, event)
    state = triggers.drop_stale(setup, state, event.now)
    state = _remember_pauses(setup, state, event.now)
    trigger = _first_that_counts(setup, state, event)
    if trigger is not None:
        state, done = transition(setup, state, trigger, event.now)
        actions += done
    if isinstance(event, Operator):
        state, done = operate(setup, state, event)
        actions += done
    if isinstance(event, RealMeasured) and state.real.history[-1:] != newest:
        state, done = _command_followers(setup, state, event.now)
        actions += done
        state, done = insist(setup, state, event.now)
        actions += done
    state, done = watch_grippers(setup, state, event)
    actions += done
    state, done = cap_speed(setup, state, event.now)
    return replace(state, links_up=_usable(state)), actions + done


def _first_that_counts(setup: Setup, state: CoreState, event: AnyEvent) -> Trigger | None:
    """Return the most urgent trigger that means something in this mode."""
    found = triggers.link_triggers(setup, state) or reports.side_triggers(setup, state, event.now)
    if isinstance(event, RealMeasured) and ignored(setup, state, event.now):
        found = [Trigger.STOP_IGNORED, *found]
    if isinstance(event, RealMeasured | TwinMeasured | TwinPlan | TwinMotion):
        found = [
            *found,
            *triggers.safety_triggers(state, event.now),
            *triggers.leader_triggers(setup, state),
            *triggers.rest_triggers(setup, state, event.now),
        ]
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
            state = real_answered(real_measured(setup, state, event), event)
            stream = state.stream
            if stream is not None and stream.ending:
                state = replace(state, stream=replace(stream, ending=event.streaming))
            elif stream is not None and event.streaming and not event.paused:
                state = replace(state, stream=replace(stream, seen=True))
            state = watch_real(setup, state)
            return state if event.own_program else replace(state, program_was_off=True)
        case RealAlarm():
            return replace(state, alarm=event.text)
        case TwinMeasured():
            return judge_divergence(setup, twin_measured(setup, state, event))
        case TwinPlan():
            return replace(state, plan=event)
        case TwinMotion():
            return judge_move(setup, replace(state, motion=event))
        case PersonSeen():
            seen = Person(event.now - event.age, event.position, event.sensor)
            return replace(state, people=newest(state.people, seen))
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
            state = replace(state, **{name: agree(setup, side)})
    return state


def _command_followers(setup: Setup, state: CoreState, now: float) -> Result:
    """Send the follower its next set point, once for each new sample of the real robot."""
    state, actions = follow_twin(setup, state, now)
    state, streamed, rejected = stream_real(setup, state, now)
    actions += streamed
    if rejected:
        state, done = transition(setup, state, Trigger.REJECTED, now)
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
    if stream.ending and now - stream.started <= config.attempts * config.retry_ms * 1e-3:
        return state, actions
    silent = not stream.seen and not flags.paused and now - stream.started > config.retry_ms * 1e-3
    late = silent and stream.attempts < config.attempts
    if not stream.starting and not late:
        return state, actions
    stream = replace(stream, starting=False, ending=False, started=now, attempts=stream.attempts + 1)
    reason = "the robot did not start it yet" if late else "the real robot follows"
    return replace(state, stream=stream), [*actions, Perform(Do.START_STREAM, reason)]


def _with_reason(action: AnyAction, reason: str) -> AnyAction:
    """Add the rejection's reason to a decision."""
    return replace(action, why=f"{action.why} ({reason})") if isinstance(action, Decided) else action
