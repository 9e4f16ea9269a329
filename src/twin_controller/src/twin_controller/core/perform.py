"""Carry out the actions of the state table: what changes in the state, and what the shell has to do."""

from __future__ import annotations

import msgspec

from twin_controller.core.actions import AnyAction, Do, MoveTwin, Perform
from twin_controller.core.events import Operator
from twin_controller.core.observing.measure import agree
from twin_controller.core.rules.reports import OWN_COMMAND
from twin_controller.core.rules.triggers import onsets
from twin_controller.core.state import CoreState, Follow, Owed, Setup, StreamState

replace = msgspec.structs.replace

STOPPING = (Do.STOP_REAL, Do.HOLD_REAL)
TO_TWIN = (Do.STOP_TWIN, Do.PAUSE_TWIN, Do.RESUME_TWIN, Do.ESTOP_TWIN, Do.RESET_TWIN)


def perform(
    setup: Setup, state: CoreState, do: Do, reason: str, now: float, command: Operator | None
) -> tuple[CoreState, list[AnyAction]]:
    """Return the state after one action and what the shell has to do for it.

    Args:
        setup: Profile and numbers.
        state: The state in the mode just entered.
        do: The action.
        reason: Why, in plain words; it ends up in the text of aborted moves.
        now: Time of the decision [s].
        command: The operator's command that caused it, if one did.
    """
    if do in (Do.ESTOP_REAL, Do.ESTOP_TWIN):
        state = replace(state, estop_at=now)
    if do in STOPPING and (state.flags is not None or state.real_busy or command is not None):
        before = state.owed.attempts if state.owed is not None and state.owed.do is do else 0
        state = replace(state, owed=Owed(do, now, before + 1))  # a robot that stood when its link was lost is not stopped later
    elif do in (Do.RELEASE_REAL, Do.ESTOP_REAL):
        state = replace(state, owed=None)
    if do in TO_TWIN:
        number = OWN_COMMAND | (state.command_id + 1)
        state = replace(state, command_id=state.command_id + 1, asked=state.motion, asked_at=now)
        if do in (Do.STOP_TWIN, Do.ESTOP_TWIN):
            state = replace(state, twin_stopped_at=now, plan=None)
        return state, [Perform(do, reason, number)]
    match do:
        case Do.BEGIN_ALIGN | Do.BEGIN_FOLLOW_TWIN:
            quiet = state.twin_stopped_at + setup.config.twin.stop_quiet_ms * 1e-3
            return replace(state, follow=Follow(None, max(now, quiet))), []
        case Do.BEGIN_STREAM:
            onset = onsets(setup, state).twin
            ends = state.stream is not None and state.stream.ending
            loaded = state.flags is not None and state.flags.streaming and not ends
            return replace(state, stream=StreamState(started=now, loaded=loaded, onset=onset)), []
        case Do.BASELINE:
            return replace(state, real=agree(setup, state.real), twin=agree(setup, state.twin)), []
        case Do.START_STREAM:
            ending = state.flags is not None and state.flags.streaming
            return replace(state, stream=replace(state.stream or StreamState(), starting=True, ending=ending, loaded=False)), []
        case Do.RESET_REAL:
            state = replace(state, reset_since=now)
        case Do.MOVE_TWIN:
            return _move_twin(setup, state, command)
    return state, [Perform(do, reason)]


def _move_twin(setup: Setup, state: CoreState, command: Operator | None) -> tuple[CoreState, list[AnyAction]]:
    """Pass the operator's move on to the twin."""
    assert command is not None
    target, speed, kind = command.target, command.speed_percent, command.command
    if kind == "HOME":
        target, speed, kind = setup.home, speed or setup.config.home.speed_percent, "MOVE_JOINTS"
    return replace(state, move_pending=True), [MoveTwin(kind, target, speed, command.elbow)]
