"""Carry a row of the state table out: the new mode, what it forgets, its commands, the decision."""

from __future__ import annotations

import msgspec
from scara_ros.names import Seat

from twin_controller.core.actions import AnyAction, Decided
from twin_controller.core.control import NOBODY, THIS_MACHINE, Control
from twin_controller.core.events import Operator
from twin_controller.core.lead import triggers
from twin_controller.core.lead.effects import carry_out
from twin_controller.core.lead.modes import ONSET_TRIGGERS, SAFETY_TRIGGERS, Mode, Trigger
from twin_controller.core.lead.reports import reset_lacks
from twin_controller.core.lead.state import Lead, end_epoch, record
from twin_controller.core.lead.table import (
    ENDED_ON_TWIN,
    FOLLOWS_TWIN,
    LEADERS,
    RESUMING,
    Row,
    look_up,
)
from twin_controller.core.lead.unheard import unheard
from twin_controller.core.orders.order import tell
from twin_controller.core.orders.stop import defied_text, defy, safety_patience
from twin_controller.core.orders.stream import by_hand, unstartable
from twin_controller.core.safety.divergence import DelayState, DivergenceState
from twin_controller.core.setup import Setup
from twin_controller.core.sides.change import drop_baseline
from twin_controller.core.sides.own_gap import stall_text
from twin_controller.core.sides.pairing import apart_text
from twin_controller.core.sides.side import Sides
from twin_controller.core.state import CoreState

AT_ROBOT = (
    Trigger.REAL_MOVED,
    Trigger.CAUGHT_UP,
    Trigger.REAL_TOOK_OVER,
    Trigger.REAL_WAS_FIRST,
    Trigger.REAL_HELD,
    Trigger.REAL_RELEASED,
    Trigger.REAL_STOPPED,
)
"""What somebody does at the robot itself. That needs no control: who stands there comes first."""
HELD = (Mode.OFFLINE, Mode.STOPPED, Mode.STANDSTILL, Mode.ESTOP, Mode.FAULT)
"""Modes in which nothing of what ran before goes on."""
HOLDING = (*HELD, Mode.PAUSED)
"""Modes whose beginning ends all that was asked for before."""

replace = msgspec.structs.replace
Result = tuple[CoreState, list[AnyAction]]


def transition(
    setup: Setup, state: CoreState, trigger: Trigger, now: float, asked: Operator | None = None
) -> Result:
    """Look the row up, carry its commands out, record the decision.

    Args:
        setup: Profile and numbers.
        state: The state before.
        trigger: What happened.
        now: When [s].
        asked: The operator's command behind it, if there is one.

    Returns:
        The state after, and the actions; none if the row is silent.
    """
    before = state.lead
    row = row_of(setup, before, trigger)
    if row.silent:
        return state, []
    why = trigger.value
    if row.why:
        why = f"{trigger.value}{detail(setup, state, trigger)}: {row.why}"
    # What the decision was made on is looked at before the new mode forgets it.
    seen = triggers.Onsets()
    if trigger in ONSET_TRIGGERS:
        seen = triggers.onsets(setup, state)
    state = _enter(setup, state, row, trigger, now)
    actions: list[AnyAction] = []
    for command in row.commands:
        state, done = carry_out(setup, state, command, why, now, asked)
        actions += done
    lead = state.lead
    decision = Decided(
        seq=lead.seq + 1,
        now=now,
        mode_before=before.mode.value,
        trigger=trigger.name,
        mode_after=lead.mode.value,
        leader=lead.leader,
        actions=tuple(command.name for command in row.commands),
        why=why,
        onset_real=seen.real,
        onset_twin=seen.twin,
        onset_uncertainty=seen.uncertainty,
        who=_who(before.control, trigger, asked),
    )
    lead = record(replace(lead, why=why), decision, setup.config.decision_history)
    return replace(state, lead=lead), [decision, *actions]


def row_of(setup: Setup, lead: Lead, trigger: Trigger) -> Row:
    """Return what a trigger does in the present mode to the sides that hear it."""
    row = look_up(lead.mode, trigger, lead.paused)
    return row if setup.writes else unheard(row, lead.mode)


def _who(control: Control, trigger: Trigger, asked: Operator | None) -> str:
    """Return the person behind a decision, as far as it is known; empty for nobody."""
    if asked is not None:
        name = Seat(asked.person, asked.session).name or THIS_MACHINE
        return f"{name}, not proven" if asked.unproven else name
    if trigger in AT_ROBOT:
        return "at the robot"
    if trigger is not Trigger.TWIN_MOVED:
        return ""
    lent = control.lent and not control.moves
    return f"{control.holder.person}, {THIS_MACHINE}" if lent else control.holder.name


def reject(setup: Setup, state: CoreState, reason: str, now: float) -> Result:
    """Stop the pair because a set point for the real robot may not be sent, and say which."""
    state, actions = transition(setup, state, Trigger.REJECTED, now)
    why = f"{state.lead.why} ({reason})"
    state = replace(state, lead=replace(state.lead, why=why))
    # Decisions say it too; other actions have no reason.
    return state, [
        replace(action, why=f"{action.why} ({reason})") if isinstance(action, Decided) else action
        for action in actions
    ]


def detail(setup: Setup, state: CoreState, trigger: Trigger) -> str:
    """Return what a person wants to know beside the trigger, in brackets; empty if nothing."""
    words = _words(setup, state, trigger)
    return f" ({words})" if words else ""


def _words(setup: Setup, state: CoreState, trigger: Trigger) -> str:
    sides, safety = state.sides, state.safety
    real, twin = sides.real, sides.twin
    match trigger:
        case Trigger.LINK_LOST:
            both = (("real", real), ("twin", twin))
            return "; ".join(f"{name}: {side.reason}" for name, side in both if not side.history)
        case Trigger.ALIGN_FAILED:
            return apart_text(setup, sides)
        case Trigger.KEEP_OUT:
            return safety.way.violation or safety.guard.violation
        case Trigger.TOO_FAST:
            return safety.guard.too_fast
        case Trigger.TOO_CLOSE | Trigger.RESUME_BLOCKED if safety.separation.too_close:
            return safety.separation.reason
        case Trigger.AT_REST | Trigger.AT_REST_STREAMED | Trigger.UNSETTLED:
            if state.lead.leader == "real":
                return f"the twin only followed, in {twin.echoed} samples"
            return f"the real robot only followed, in {real.echoed} samples"
        case Trigger.STOP_IGNORED if state.orders.stop is not None:
            order = state.orders.stop.order
            shown = "it still moves" if order.shown else "its program goes on"
            return f"{order.wanted.value}, sent {order.attempts} times: {shown}"
        case Trigger.TWIN_STOP_IGNORED if state.orders.twin_stop is not None:
            return defied_text(state.orders.twin_stop, twin)
        case Trigger.DIVERGED:
            return stall_text(real.stall, max(real.seen or 0.0, twin.seen or 0.0))
        case Trigger.TWIN_MOVED_UNLED:
            return unstartable(setup, real.flags)
        case Trigger.REAL_FAULT:
            return real.alarm
        case Trigger.REAL_DRIVES_OFF if real.flags is not None and real.flags.estop_pressed:
            return "the emergency stop at the robot is pressed"
        case Trigger.REAL_DRIVES_OFF:
            return by_hand(real.flags)
        case Trigger.RESET_FAILED if real.flags is not None:
            return reset_lacks(setup, state, real.flags, real.flags.now)
    return _control_words(state.lead.control, trigger)


def _control_words(control: Control, trigger: Trigger) -> str:
    """Tell the holder of control that somebody else moves the pair."""
    if control.holder == NOBODY:
        return ""
    if trigger is Trigger.TWIN_MOVED_UNASKED:
        return f"{control.holder.name} holds control"
    if trigger in (Trigger.REAL_MOVED, Trigger.REAL_TOOK_OVER, Trigger.REAL_WAS_FIRST):
        return f"who stands at the robot comes first; {control.holder.name} keeps control"
    return ""


def _enter(setup: Setup, state: CoreState, row: Row, trigger: Trigger, now: float) -> CoreState:
    """Change the mode and forget what belonged to the old one."""
    state = _forget_cause(setup, state, trigger, now)
    lead = state.lead
    mode = row.to or lead.mode
    # OFFLINE is entered anew by each loss: what came meanwhile counts as little as before it.
    if mode is lead.mode and mode is not Mode.OFFLINE:
        return state
    paused = lead.mode if mode is Mode.PAUSED else None
    stopped = lead.was_stopped or lead.mode in (Mode.STOPPED, Mode.PAUSED)
    active = paused or mode
    new = replace(
        lead,
        mode=mode,
        since=now,
        was_stopped=mode is Mode.OFFLINE and (stopped or trigger in (Trigger.STOP, *ENDED_ON_TWIN)),
        leader=LEADERS.get(active, ""),
        paused=paused,
        paused_by=trigger if paused is not None else None,
        paused_seen=(False, False),
        # Before the twin may lead again.
        must_align=trigger is Trigger.RESET_DONE or (lead.must_align and mode is not Mode.ALIGNING),
        needs_acknowledge=mode is Mode.PAUSED and trigger is Trigger.DIVERGED,
        reset_since=None,
        twin_named=False,
        helpless=False,
        move_pending=lead.move_pending and active is Mode.OPERATOR_LEADS,
    )
    if mode in HOLDING:
        new = end_epoch(new, f"{mode} ({trigger.value})", now)
    state = _end_following(state, mode, active)
    if mode in HOLDING:
        # Where the sides stop is not agreed: nothing counts as a motion until they stand.
        state = replace(state, sides=_drop_baselines(state.sides))
    if mode in HELD:
        new = replace(new, program_was_off=False)
    if mode is Mode.PAUSED:
        # While it slows down, a robot that moves has not gone on.
        stop = tell(None, "standstill", safety_patience(setup.config.stop), now)
        state = replace(state, orders=replace(state.orders, safety_stop=stop))
    if mode in LEADERS and trigger not in RESUMING:
        real, twin = state.sides.real, state.sides.twin
        sides = Sides(replace(real, echoed=0), replace(twin, echoed=0))
        state = replace(state, sides=sides)
    # A pair that was moved apart while it was paused or stopped, or aligns, is measured anew.
    if trigger in RESUMING or mode is Mode.ALIGNING or lead.mode in HELD:
        safety = replace(state.safety, divergence=DivergenceState(), delay=DelayState())
        state = replace(state, safety=safety)
    if mode is not Mode.ESTOP:
        state = replace(state, orders=replace(state.orders, estop=None))
    return replace(state, lead=new)


def _forget_cause(setup: Setup, state: CoreState, trigger: Trigger, now: float) -> CoreState:
    """Forget what this decision is the answer to, so that it is not decided again at once."""
    lead, safety, orders = state.lead, state.safety, state.orders
    if trigger is Trigger.ACKNOWLEDGE:
        lead = replace(lead, needs_acknowledge=False)
    if trigger is Trigger.REAL_TOOK_OVER:
        # Where the mode stays it is told once, and not at each sample of that program.
        lead = replace(lead, program_was_off=False)
    if trigger is Trigger.RESET:
        lead = replace(lead, reset_since=now)
    if trigger is Trigger.PAUSE and lead.mode is Mode.PAUSED:
        # It is the operator's from now on: no side lets it go on.
        lead = replace(lead, paused_by=trigger)
    if trigger in (Trigger.RESET_FAILED, Trigger.LINK_LOST, Trigger.ESTOP, Trigger.STOP):
        lead = replace(lead, reset_since=None)
    if trigger is Trigger.ESTOP_IGNORED:
        lead = replace(lead, helpless=True)
    if trigger in (Trigger.TWIN_MOVED_STOPPED, Trigger.STOP):
        # A person who stops again is told again if it goes on all the same.
        lead = replace(lead, twin_named=trigger is Trigger.TWIN_MOVED_STOPPED)
    if trigger is Trigger.TWIN_MOVED_UNASKED:
        # The twin comes to rest elsewhere: it is stopped once, not at each sample from there.
        state = replace(state, sides=_drop_baselines(state.sides))
    if trigger is Trigger.TWIN_STOP_IGNORED:
        orders = replace(orders, twin_stop=defy(orders.twin_stop))
    if trigger is Trigger.KEEP_OUT:
        # The way stays known: the same move is not judged, and stopped, a second time.
        safety = replace(safety, way=replace(safety.way, violation=""))
    if trigger in SAFETY_TRIGGERS:
        patience = safety_patience(setup.config.stop)
        stop = tell(orders.safety_stop, "standstill", patience, now)
        orders = replace(orders, safety_stop=stop)
    return replace(state, lead=lead, safety=safety, orders=orders)


def _end_following(state: CoreState, mode: Mode, active: Mode) -> CoreState:
    """Forget a follower that the new mode lacks; in PAUSED ``active`` is the paused mode."""
    follow, orders = state.follow, state.orders
    # An alignment begins anew after a pause: the real robot's pose would draw the twin on.
    if mode is not Mode.ALIGNING and active is not Mode.REAL_LEADS:
        follow = replace(follow, twin=None)
    if active not in FOLLOWS_TWIN:
        follow = replace(follow, real=None)
        orders = replace(orders, stream=None)
    return replace(state, follow=follow, orders=orders)


def _drop_baselines(sides: Sides) -> Sides:
    real, twin = sides.real, sides.twin
    return Sides(
        replace(real, change=drop_baseline(real.change)),
        replace(twin, change=drop_baseline(twin.change)),
    )
