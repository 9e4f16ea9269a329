"""Carry out the commands of a row: what changes in the state, and what the shell has to send."""

from __future__ import annotations

import msgspec

from twin_controller.core.actions import AnyAction, Command, MoveTwin, SendReal, SendTwin
from twin_controller.core.events import Operator
from twin_controller.core.follow.memory import RealFollows, TwinFollows
from twin_controller.core.follow.response import begun
from twin_controller.core.lead.triggers import onsets
from twin_controller.core.orders.state import OWN_COMMAND, told_twin
from twin_controller.core.orders.stop import (
    GIVES_HOLD,
    MOVING_TWIN,
    STOPPING,
    STOPPING_TWIN,
    TAKES_HOLD,
    tell_estop,
    tell_stop,
    tell_twin_stop,
    under_way,
)
from twin_controller.core.orders.stream import ask_for_stream, begin_stream
from twin_controller.core.setup import Setup
from twin_controller.core.sides.measure import arrived
from twin_controller.core.sides.side import Sides
from twin_controller.core.state import CoreState

replace = msgspec.structs.replace
Result = tuple[CoreState, list[AnyAction]]

TO_TWIN = (
    Command.STOP_TWIN,
    Command.PAUSE_TWIN,
    Command.RESUME_TWIN,
    Command.ESTOP_TWIN,
    Command.RESET_TWIN,
    Command.YIELD_TWIN,
)


def carry_out(
    setup: Setup,
    state: CoreState,
    command: Command,
    reason: str,
    now: float,
    asked: Operator | None,
) -> Result:
    """Return the state after one command and what the shell has to do for it.

    Args:
        setup: Profile and numbers.
        state: The state in the mode just entered.
        command: The command.
        reason: Why, in plain words; it ends up in the text of aborted moves.
        now: Time of the decision [s].
        asked: The operator's command that caused it, if one did.
    """
    state = _note_order(setup, state, command, now, asked is not None)
    follows = state.follow.real
    if command is Command.RESUME_TWIN and follows is not None:
        # The robot was held where it was, the twin a little further on the way: it waits there, so
        # that the robot comes to it and then goes the same way. Stage 8 sends the command.
        follows = replace(follows, resumes=True)
        return replace(state, follow=replace(state.follow, real=follows)), []
    if command in TO_TWIN:
        return send_twin(state, command, reason, now)
    match command:
        case Command.BEGIN_ALIGN | Command.BEGIN_FOLLOW_TWIN:
            # Once the twin listens again after a stop.
            quiet = state.follow.twin_stopped_at + setup.config.twin.stop_quiet_ms * 1e-3
            twin = TwinFollows(max(now, quiet), command is Command.BEGIN_ALIGN)
            return replace(state, follow=replace(state.follow, twin=twin)), []
        case Command.BEGIN_STREAM:
            return _begin_stream(setup, state, now), []
        case Command.BASELINE:
            sides = Sides(arrived(setup, state.sides.real), arrived(setup, state.sides.twin))
            return replace(state, sides=sides), []
        case Command.START_STREAM:
            # It is asked for in stage 8, behind the first set point of this lead.
            orders = state.orders
            if orders.stream is not None:
                orders = replace(orders, stream=ask_for_stream(orders.stream))
            return replace(state, orders=orders), []
        case Command.RELEASE_TWIN:
            return state, [SendTwin(command, reason)]
        case Command.MOVE_TWIN if asked is not None:
            number = state.lead.move + 1
            lead = replace(state.lead, move_pending=True, move=number, move_failed="")
            state = replace(state, lead=lead)
            do, target, speed = asked.command, asked.target, asked.speed_percent
            if do == "HOME":
                # To the twin it is a move of the joints, with a speed of its own.
                do, target = "MOVE_JOINTS", setup.home
                speed = speed or setup.config.home.speed_percent
            way = asked.path, asked.speed_mm_s, asked.via, asked.corner_mm, number
            return state, [MoveTwin(do, target, speed, asked.elbow, asked.asked, asked.yaw, *way)]
    return state, [SendReal(command, reason)]


def _note_order(
    setup: Setup, state: CoreState, command: Command, now: float, asked: bool
) -> CoreState:
    """Open the order that a command stands for, and close the one that it ends."""
    orders, config = state.orders, setup.config
    if command in (Command.ESTOP_REAL, Command.ESTOP_TWIN):
        orders = replace(orders, estop=tell_estop(orders.estop, config.estop, now))
    # A robot that stood when its link was lost is not stopped later, unless the operator says so.
    may_move = state.sides.real.flags is not None or orders.real_busy or asked
    if command in STOPPING and may_move:
        reached = state.sides.real.usable
        stop = tell_stop(orders.stop, command, config.stop, reached, now)
        orders = replace(orders, stop=stop)
    elif command is Command.ESTOP_REAL or command in GIVES_HOLD:
        orders = replace(orders, stop=None)
    if command in TAKES_HOLD:
        orders = replace(orders, hold_away=True)
    elif command in GIVES_HOLD:
        orders = replace(orders, hold_away=False, hold_back=now)
    if command in STOPPING_TWIN and state.sides.twin.usable:
        stopped = tell_twin_stop(orders.twin_stop, command, config.stop, now)
        orders = replace(orders, twin_stop=stopped)
    elif command in MOVING_TWIN:
        orders = replace(orders, twin_stop=None)
    return replace(state, orders=orders)


def send_twin(state: CoreState, command: Command, reason: str, now: float) -> Result:
    """Send a command to the twin under a number of its own, which the twin reports back."""
    sides, follow = state.sides, state.follow
    orders = told_twin(state.orders, sides.twin.motion, now)
    if command in (Command.STOP_TWIN, Command.ESTOP_TWIN, Command.YIELD_TWIN):
        # What it was going to do it will not do.
        sides = replace(sides, twin=replace(sides.twin, plan=None))
    if command in (Command.STOP_TWIN, Command.ESTOP_TWIN):
        # Set points are lost on it for a while.
        follow = replace(follow, twin_stopped_at=now)
    state = replace(state, sides=sides, orders=orders, follow=follow)
    return state, [SendTwin(command, reason, OWN_COMMAND | orders.told.id)]


def _begin_stream(setup: Setup, state: CoreState, now: float) -> CoreState:
    """Let the real robot follow."""
    # What slowed the last set point down counts until the next one is judged.
    follows = RealFollows(onset=onsets(setup, state).twin, slowed=state.follow.slowed)
    stopping = under_way(state.orders.stop)
    stream = begin_stream(state.sides.real.flags, stopping, setup.config.stream, now)
    return replace(
        state,
        follow=replace(
            state.follow,
            real=follows,
            response=begun(setup, state.follow.response, bool(state.sides.real.takes_ahead)),
        ),
        orders=replace(state.orders, stream=stream),
    )
