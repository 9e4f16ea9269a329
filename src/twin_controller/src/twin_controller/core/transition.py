"""Carry a row of the state table out: the new mode, what it forgets, its actions and the decision."""

from __future__ import annotations

import msgspec

from twin_controller.core.actions import AnyAction, Decided
from twin_controller.core.events import Operator
from twin_controller.core.observing import change
from twin_controller.core.observing.divergence import DivergenceState
from twin_controller.core.perform import perform
from twin_controller.core.rules import triggers
from twin_controller.core.rules.table import RESUMING, Mode, Row, Trigger, look_up
from twin_controller.core.safety.zones import Way
from twin_controller.core.state import CoreState, Setup

replace = msgspec.structs.replace

LEADERS = {Mode.REAL_LEADS: "real", Mode.TWIN_LEADS: "twin", Mode.OPERATOR_LEADS: "operator"}
ONSET_TRIGGERS = (
    Trigger.REAL_MOVED,
    Trigger.REAL_WAS_FIRST,
    Trigger.REAL_TOOK_OVER,
    Trigger.TWIN_MOVED,
    Trigger.TWIN_MOVED_UNALIGNED,
)


def transition(
    setup: Setup, state: CoreState, trigger: Trigger, now: float, command: Operator | None = None
) -> tuple[CoreState, list[AnyAction]]:
    """Look the row up, carry its state changes out, record the decision.

    Args:
        setup: Profile and numbers.
        state: The state before.
        trigger: What happened.
        now: When [s].
        command: The operator's command behind it, if there is one.

    Returns:
        The state after, and the actions; none if the row is silent.
    """
    row = look_up(state.mode, trigger, state.paused_mode)
    if row.silent:
        return state, []
    before, seen = state.mode, triggers.onsets(setup, state)
    why = f"{trigger.value}{detail(state, trigger)}: {row.why}" if row.why else trigger.value
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


def detail(state: CoreState, trigger: Trigger) -> str:
    """Return what a person wants to know beside the trigger."""
    if trigger is Trigger.LINK_LOST:
        down = [f"{name}: {side.reason}" for name, side in (("real", state.real), ("twin", state.twin)) if not side.history]
        return f" ({'; '.join(down)})"
    if trigger is Trigger.KEEP_OUT:
        return f" ({state.way.violation or state.guard.violation})"
    if trigger is Trigger.TOO_FAST:
        return f" ({state.guard.too_fast})"
    if trigger in (Trigger.TOO_CLOSE, Trigger.RESUME_BLOCKED) and state.separation.too_close:
        return f" ({state.separation.reason})"
    if trigger in (Trigger.AT_REST, Trigger.UNSETTLED):
        name, side = ("twin", state.twin) if state.leader == "real" else ("real robot", state.real)
        return f" (ignored as echo: {side.echoed} samples of the {name})"
    if trigger is Trigger.STOP_IGNORED and state.owed is not None:
        return f" ({state.owed.do.value}, sent {state.owed.attempts} times)"
    return f" ({state.alarm})" if trigger is Trigger.REAL_FAULT and state.alarm else ""


def _enter(state: CoreState, row: Row, trigger: Trigger, now: float) -> CoreState:
    """Change the mode and forget what belonged to the old one."""
    if trigger is Trigger.ACKNOWLEDGE:
        state = replace(state, needs_acknowledge=False)
    if trigger in (Trigger.RESET_FAILED, Trigger.LINK_LOST):
        state = replace(state, reset_since=None)
    if trigger is Trigger.KEEP_OUT:
        state = replace(state, way=Way(state.way.target))
    if trigger in (Trigger.KEEP_OUT, Trigger.TOO_CLOSE, Trigger.TOO_FAST):
        state = replace(state, guard=replace(state.guard, stopped_at=now))
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
    if mode in LEADERS and trigger not in RESUMING:
        state = replace(state, real=replace(state.real, echoed=0), twin=replace(state.twin, echoed=0))
    return replace(
        state,
        mode=mode,
        mode_since=now,
        leader=LEADERS.get(active, ""),
        follow=state.follow if follows_real else None,
        stream=state.stream if follows_twin else None,
        paused_mode=paused,
        paused_seen=(False, False),
        must_align=trigger is Trigger.RESET_DONE or (state.must_align and mode is not Mode.ALIGNING),
        needs_acknowledge=trigger is Trigger.DIVERGED if mode is Mode.PAUSED else False,
        reset_since=None,
        move_pending=state.move_pending and active is Mode.OPERATOR_LEADS,
        divergence=DivergenceState() if trigger in RESUMING or mode is Mode.ALIGNING else state.divergence,
    )
