"""Judge the operator's commands; every one is answered."""

from __future__ import annotations

import math

import msgspec

from twin_controller.core.actions import AnyAction, Reply
from twin_controller.core.events import Operator
from twin_controller.core.following.follow import bounds_of
from twin_controller.core.following.gate import check_setpoint
from twin_controller.core.rules import triggers
from twin_controller.core.rules.table import Trigger, look_up
from twin_controller.core.safety.zones import judge_way
from twin_controller.core.state import CoreState, Setup
from twin_controller.core.supervise import set_speed
from twin_controller.core.transition import detail, transition

replace = msgspec.structs.replace

MOVES = ("MOVE", "MOVE_JOINTS", "HOME")


def operate(setup: Setup, state: CoreState, event: Operator) -> tuple[CoreState, list[AnyAction]]:
    """Judge a command of the operator.

    Args:
        setup: Profile and numbers.
        state: The state before.
        event: The command.

    Returns:
        The state after, and the actions with the answer last.
    """
    if event.command == "SPEED":
        if not 1.0 <= event.speed_percent <= 100.0:
            return state, [Reply(event.id, False, f"speed_percent = {event.speed_percent:g} is outside [1, 100]")]
        state, actions, answer = set_speed(setup, state, event.speed_percent, event.now)
        return state, [*actions, Reply(event.id, True, answer)]
    trigger = triggers.operator_trigger(setup, state, event)
    if trigger is None:
        allowed = ", ".join((*triggers.COMMANDS, "HOME", "MOVE", "MOVE_JOINTS", "SPEED"))
        return state, [Reply(event.id, False, f"unknown command {event.command!r}: allowed are {allowed}")]
    invalid = _invalid_target(setup, event) or _forbidden(setup, state, event, trigger)
    if invalid:
        return state, [Reply(event.id, False, invalid)]
    row = look_up(state.mode, trigger, state.paused_mode)
    state, actions = transition(setup, state, trigger, event.now, event)
    text = row.why or trigger.value
    answer = text + detail(state, trigger) if row.refused else f"{state.mode}: {text}"
    return state, [*actions, Reply(event.id, not row.refused, answer)]


def _invalid_target(setup: Setup, event: Operator) -> str:
    """Return why the command's target or speed is invalid, or an empty text."""
    if event.command not in MOVES:
        return ""
    if not (math.isfinite(event.speed_percent) and (event.speed_percent == 0.0 or 1.0 <= event.speed_percent <= 100.0)):
        return f"speed_percent = {event.speed_percent:g} is neither 0 (default) nor in [1, 100]"
    if event.command == "MOVE":
        valid = len(event.target) == 3 and all(map(math.isfinite, event.target))
        return "" if valid else f"target = {list(event.target)} is not three finite coordinates"
    return check_setpoint(event.target, bounds_of(setup)) if event.command == "MOVE_JOINTS" else ""


def _forbidden(setup: Setup, state: CoreState, event: Operator, trigger: Trigger) -> str:
    """Return why a valid move may not begin now: a person is too close, or its way leads through a keep-out zone."""
    if state.separation.too_close and trigger in (Trigger.MOVE, Trigger.ALIGN):
        return state.separation.reason
    if trigger is not Trigger.MOVE:
        return ""
    if state.flags is not None and state.flags.own_program:
        return "the real robot runs a program of its own: STOP ends it"
    target = setup.home if event.command == "HOME" else event.target
    if event.command == "MOVE" or not state.twin.history:
        return ""
    way = judge_way(setup.points, setup.keep_out, state.twin.last.q, target, setup.velocity)
    return way.violation
