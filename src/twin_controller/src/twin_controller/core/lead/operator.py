"""Judge the operator's commands; every one is answered.

Where a move leads is judged by one function, before it is accepted and while it is only asked
about: what the page shows as reachable is accepted, and what it refuses is refused.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import msgspec
from scara_control.errors import ScaraControlError
from scara_control.kinematics.arm_kinematics import parse_elbow

from twin_controller.core.actions import AnyAction, Reply
from twin_controller.core.events import Joints, Operator
from twin_controller.core.follow.limit import check_setpoint
from twin_controller.core.follow.real import bounds_of
from twin_controller.core.lead import triggers
from twin_controller.core.lead.modes import Trigger
from twin_controller.core.lead.table import look_up
from twin_controller.core.lead.transition import detail, transition
from twin_controller.core.orders.speed_caps import real_cap, speed_answer
from twin_controller.core.safety.zones import judge_way
from twin_controller.core.setup import Setup
from twin_controller.core.sides.side import TwinSide
from twin_controller.core.state import CoreState

replace = msgspec.structs.replace
Result = tuple[CoreState, list[AnyAction]]

MOVES = ("MOVE", "MOVE_JOINTS", "HOME")


class Judged(NamedTuple):
    """Where a move leads, and why it may not be made."""

    # Joint positions at its end, SI; empty if they are not known.
    target: Joints = ()
    # The elbow branch of a point; empty where a branch has no name.
    elbow: str = ""
    # In words; empty if nothing is against it.
    refusal: str = ""


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
    if event.command == "SPEED":
        return _cap(setup, state, event)
    trigger = triggers.operator_trigger(setup, state, event)
    if trigger is None:
        allowed = ", ".join((*triggers.COMMANDS, "HOME", "MOVE", "MOVE_JOINTS", "SPEED"))
        unknown = f"unknown command {event.command!r}: allowed are {allowed}"
        return state, [Reply(event.id, False, unknown)]
    invalid = _invalid_target(setup, event) or _forbidden(setup, state, trigger)
    if not invalid and trigger is Trigger.MOVE and judge_target:
        invalid = judge_move(setup, state.sides.twin, event).refusal
    if invalid:
        return state, [Reply(event.id, False, invalid)]
    row = look_up(state.lead.mode, trigger, state.lead.paused)
    state, actions = transition(setup, state, trigger, event.now, event)
    text = row.why or trigger.value
    if row.refused:
        answer = text + detail(state, trigger)
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
    allowed = real_cap(setup, speeds, state.safety, state.lead.leader)
    answer = speed_answer(speeds, state.sides.real.flags, allowed)
    # Stage 9 sends what follows from it.
    state = replace(state, orders=replace(state.orders, speeds=speeds))
    return state, [Reply(event.id, True, answer)]


def _forbidden(setup: Setup, state: CoreState, trigger: Trigger) -> str:
    """Return why no move may begin now: a person, a hold, or a program."""
    sides, separation = state.sides, state.safety.separation
    if separation.too_close and trigger in (Trigger.MOVE, Trigger.ALIGN):
        return separation.reason
    if trigger is not Trigger.MOVE:
        return ""
    flags = sides.real.flags
    if flags is not None and flags.held_there:
        return "the real robot is held at its pendant: let it go there"
    if flags is not None and flags.own_program:
        return "the real robot runs a program of its own: STOP ends it"
    return ""


def judge_move(setup: Setup, twin: TwinSide, event: Operator) -> Judged:
    """Judge a move from where the twin stands: its target, the kinematics, the way's zones.

    Whether a move may begin at all now is judged by ``lead.allowed.refusals``: that does not
    depend on the target.

    Args:
        setup: Profile and numbers.
        twin: The twin; one that was never seen cannot be judged.
        event: MOVE, MOVE_JOINTS or HOME.
    """
    if event.command not in MOVES:
        return Judged(refusal=f"command = {event.command!r}: allowed are {', '.join(MOVES)}")
    invalid = _invalid_target(setup, event) or _missing_point(event)
    if invalid:
        return Judged(refusal=invalid)
    if not twin.history:
        return Judged(refusal="where the twin stands is not known: wait for its link")
    start = twin.last.q
    try:
        target, elbow = _destination(setup, start, event)
    except ScaraControlError as error:
        return Judged(refusal=str(error))
    margin = setup.config.cell.keep_out_clearance_mm
    way = judge_way(setup.points, setup.keep_out, start, target, setup.velocity, margin)
    return Judged(target, elbow, way.violation)


def _missing_point(event: Operator) -> str:
    """Return why a point counts as left out: a message's fields are 0 unless somebody fills them.

    The point (0, 0, 0) is in the robot's own base.
    """
    if event.command != "MOVE" or any(event.target):
        return ""
    return "x, y and z are 0, which is in the robot's base: MOVE needs the point to move to"


def _invalid_target(setup: Setup, event: Operator) -> str:
    """Return why the command's target or speed is invalid, or an empty text."""
    if event.command not in MOVES:
        return ""
    percent = event.speed_percent
    if not (percent == 0.0 or 1.0 <= percent <= 100.0):
        return f"speed_percent = {percent:g} is neither 0 (default) nor in [1, 100]"
    if event.command == "MOVE":
        valid = len(event.target) == 3 and all(map(math.isfinite, event.target))
        if valid:
            return ""
        return f"target = {list(event.target)} is not three finite coordinates"
    if event.command == "MOVE_JOINTS":
        return check_setpoint(event.target, bounds_of(setup))
    return ""


def _destination(setup: Setup, start: Joints, event: Operator) -> tuple[Joints, str]:
    """Return where a move leads the twin's joints, by the same kinematics that the twin uses.

    Raises:
        ScaraControlError: The point is out of reach, or there is no such elbow.
    """
    if event.command == "HOME":
        return setup.home, ""
    if event.command == "MOVE_JOINTS":
        return event.target, ""
    columns = [setup.names.index(joint.name) for joint in setup.tool.joints]
    x, y, z = event.target
    seed = [start[column] for column in columns]
    answer = setup.tool.inverse(x, y, z, parse_elbow(event.elbow), seed)
    q = list(start)
    for column, position in zip(columns, answer.chosen.q):
        q[column] = position
    branch = answer.chosen.elbow
    if branch is None:
        return tuple(q), ""
    return tuple(q), branch.value
