"""Hear who asks: control goes from hand to hand, and only its holder's commands begin a motion."""

from __future__ import annotations

import msgspec
from scara_ros.names import Seat

from twin_controller.core import control as rules
from twin_controller.core.actions import AnyAction, Reply
from twin_controller.core.control import Control, Outcome
from twin_controller.core.events import AnyEvent, ControlAsked, Operator, Tick
from twin_controller.core.lead.operator import operate
from twin_controller.core.lead.state import cancelled, end_epoch, record_notice
from twin_controller.core.setup import Setup
from twin_controller.core.state import CoreState

replace = msgspec.structs.replace
Result = tuple[CoreState, list[AnyAction]]

ACTIONS = ("TAKE", "ASK", "GIVE", "DENY", "RELEASE", "KEEP")
LEND = "LEND"
"""What a motion node says before it moves the twin for somebody; no person need prove anything."""


def let_time_pass(setup: Setup, state: CoreState, event: AnyEvent) -> Result:
    """Take control from who gives no sign of life or no answer."""
    control, limits = state.lead.control, setup.config.control
    if control.holder == rules.NOBODY:
        return state, []
    kept = rules.end_loan(control, event.now)
    if isinstance(event, Tick) and event.own_gap > 0.0:
        kept = rules.forgive(kept, event.own_gap)
    if kept is not control:
        control, state = kept, _with_control(state, kept)
    keep_s, answer_s = limits.keep_ms * 1e-3, limits.answer_ms * 1e-3
    lost = rules.expire(control, event.now, keep_s, answer_s)
    if lost is None:
        return state, []
    return _note(setup, state, lost, "", event.now)


def hear_control(setup: Setup, state: CoreState, event: ControlAsked) -> Result:
    """Judge what somebody wants with control; it is always answered, with the answer last."""
    refused = _invalid(event)
    if refused:
        return state, [Reply(event.id, False, refused)]
    seat = Seat(event.person, event.session)
    if event.action == LEND:
        lend_s = setup.config.control.lend_ms * 1e-3
        outcome = rules.lend(state.lead.control, event.local, event.now, lend_s)
    else:
        outcome = _outcome(state.lead.control, event, seat)
    state, actions = _note(setup, state, outcome, seat.name, event.now)
    return state, [*actions, Reply(event.id, outcome.success, outcome.text)]


def hear_command(setup: Setup, state: CoreState, event: Operator) -> Result:
    """Judge a command: first whether this person may begin a motion, then by the table.

    STOP, PAUSE and ESTOP are for everybody, also for who is not the person that is named. What was
    asked for before the pair was stopped or paused is refused here, in the step that would begin
    it.
    """
    if event.command in rules.ENDING:
        state, actions = operate(setup, state, event)
        # Also where it changes nothing: whoever asked before it did not know of it.
        lead = end_epoch(state.lead, event.command, event.now)
        return replace(state, lead=lead), actions
    seat, control = Seat(event.person, event.session), state.lead.control
    refused = event.unproven or rules.refusal(control, seat, event.now, event.local)
    if not refused and event.command != "SPEED":
        # A cap moves nothing, and a lower one is never too late.
        refused = cancelled(state.lead, event.asked, event.now)
    if refused:
        return state, [Reply(event.id, False, refused)]
    return operate(setup, _with_control(state, rules.heard(control, seat, event.now)), event)


def _invalid(event: ControlAsked) -> str:
    """Return why nothing can be done with control, or an empty text."""
    if event.action == LEND:
        return event.unproven
    if event.action not in ACTIONS:
        return f"unknown action {event.action!r}: allowed are {', '.join(ACTIONS)}"
    if event.unproven:
        return event.unproven
    if not event.person:
        return "persons hold control: give a name of persons.yaml and the person's token"
    return ""


def _outcome(control: Control, event: ControlAsked, seat: Seat) -> Outcome:
    now, moves = event.now, event.moves
    match event.action:
        case "TAKE":
            return rules.take(control, seat, moves, now)
        case "ASK":
            return rules.ask(control, seat, moves, now)
        case "GIVE":
            return rules.give(control, seat, now)
        case "DENY":
            return rules.deny(control, seat)
        case "RELEASE":
            return rules.release(control, seat, now)
    return rules.keep(control, seat, moves, now)


def _note(setup: Setup, state: CoreState, outcome: Outcome, who: str, now: float) -> Result:
    """Keep the new state of control; what people should know is a decision."""
    state = _with_control(state, outcome.control)
    if not outcome.happened:
        return state, []
    history = setup.config.decision_history
    lead, decision = record_notice(
        state.lead, outcome.happened, outcome.text, (), history, now, who
    )
    return replace(state, lead=lead), [decision]


def _with_control(state: CoreState, control: Control) -> CoreState:
    return replace(state, lead=replace(state.lead, control=control))
