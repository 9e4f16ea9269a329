"""Judge the operator's commands; every one is answered."""

from __future__ import annotations

import msgspec

from twin_controller.core.actions import AnyAction, Reply
from twin_controller.core.events import Operator
from twin_controller.core.lead.commands.judging import invalid_target, judge_move
from twin_controller.core.lead.modes import EVERY_COMMAND, Mode, Trigger
from twin_controller.core.lead.standing import real_stands, unshown
from twin_controller.core.lead.table import FOLLOWS_TWIN
from twin_controller.core.lead.transition import detail, row_of, transition
from twin_controller.core.lead.triggers import operator_trigger
from twin_controller.core.orders.speed import real_cap, speed_answer
from twin_controller.core.orders.state import held_there
from twin_controller.core.orders.stream import by_hand, unstartable
from twin_controller.core.setup import Setup
from twin_controller.core.state import CoreState

AT_THE_ROBOT = ("PAUSE", "STANDSTILL", "SPEED")
"""Commands that do nothing where the real robot does not hear them."""

replace = msgspec.structs.replace
Result = tuple[CoreState, list[AnyAction]]


def operate(setup: Setup, state: CoreState, event: Operator, judge_target: bool = True) -> Result:
    """Judge a command of the operator.

    A move is accepted only if :func:`judge_move` finds nothing against it.

    Args:
        setup: Profile and numbers.
        state: The state before.
        event: The command.
        judge_target: The way to the target is judged; else only whether a move may begin at all.

    Returns:
        The state after, and the actions with the answer last.
    """
    if event.command in AT_THE_ROBOT and not setup.writes:
        return state, [Reply(event.id, False, f"{setup.only_followed}; do it at its own pendant")]
    if event.command == "SPEED":
        return _cap(setup, state, event)
    trigger = operator_trigger(setup, state, event)
    if trigger is None:
        allowed = ", ".join(EVERY_COMMAND)
        unknown = f"unknown command {event.command!r}: allowed are {allowed}"
        return state, [Reply(event.id, False, unknown)]
    invalid = invalid_target(setup, event) or _forbidden(setup, state, trigger, event.now)
    row = row_of(setup, state.lead, trigger)
    # Kinematics by numbers take tenths of a second: only where the move would begin.
    if not invalid and not row.refused and trigger is Trigger.MOVE and judge_target:
        invalid = judge_move(setup, state.sides.twin, event).refusal
    if invalid:
        return state, [Reply(event.id, False, invalid)]
    state, actions = transition(setup, state, trigger, event.now, event)
    text = row.why or trigger.value
    if row.refused:
        answer = text + detail(setup, state, trigger)
    else:
        answer = f"{state.lead.mode}: {text}"
    return state, [*actions, Reply(event.id, not row.refused, answer)]


def _cap(setup: Setup, state: CoreState, event: Operator) -> Result:
    """Take the operator's SPEED: the cap of both sides, in every mode."""
    percent = event.speed_percent
    if not 1.0 <= percent <= 100.0:
        outside = f"speed_percent = {percent:g} is outside [1, 100]"
        return state, [Reply(event.id, False, outside)]
    speeds = replace(state.orders.speeds, cap=percent)
    flags = state.sides.real.flags
    runs = flags is not None and flags.own_program
    allowed = real_cap(setup, speeds, state.safety, state.lead.leader, runs)
    answer = speed_answer(speeds, flags, allowed)
    # Stage 9 sends what follows from it.
    state = replace(state, orders=replace(state.orders, speeds=speeds))
    return state, [Reply(event.id, True, answer)]


def _forbidden(setup: Setup, state: CoreState, trigger: Trigger, now: float) -> str:
    """Return why nothing may begin or go on now: a person, a hold, a program, the mode switch."""
    sides, separation = state.sides, state.safety.separation
    flags = sides.real.flags
    mode = state.lead.mode
    latched = setup.writes and (mode is Mode.ESTOP or (mode is Mode.FAULT and unshown(state)))
    moves = flags is not None and flags.drives_on and not real_stands(setup, state, flags, now)
    if trigger is Trigger.RESET and latched and moves:
        # RESET would give HOLD and *IMSTP back to a robot that they have not stopped.
        return "the real robot moves with its drives on: stop it there, then RESET"
    if separation.too_close and trigger in (Trigger.MOVE, Trigger.ALIGN):
        return separation.reason
    if trigger is Trigger.RESUME and state.lead.paused is Mode.REAL_LEADS and unshown(state):
        # START lets a paused program go on. One that HOLD has not reached yet would stay paused.
        return "the real robot has not shown the pause yet: RESUME once it stands"
    if trigger in (Trigger.RESUME, Trigger.RESUME_BLOCKED):
        return by_hand(flags) if state.lead.paused in FOLLOWS_TWIN else ""
    if trigger not in (Trigger.MOVE, Trigger.MOVE_UNALIGNED):
        return ""
    if held_there(setup.config.stop, state.orders, flags):
        return "the real robot is held at its pendant: let it go there"
    return unstartable(setup, flags)
