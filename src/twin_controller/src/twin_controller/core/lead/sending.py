"""Stages 7 to 9 of a step: set points, orders and caps, as the lead asks for them."""

from __future__ import annotations

import msgspec
from scara_control.motion.commands import STOPPED_AGAIN

from twin_controller.core.actions import AnyAction, Command, SendReal
from twin_controller.core.events import AnyEvent, TwinMeasured, TwinMotion
from twin_controller.core.follow.ahead import stream_ahead
from twin_controller.core.follow.blend import finished
from twin_controller.core.follow.pace import follower_pace
from twin_controller.core.follow.real import stream_real
from twin_controller.core.follow.remembered import Remembered, note_sample
from twin_controller.core.follow.response import SLOWEST_PERCENT
from twin_controller.core.follow.twin import follow_twin
from twin_controller.core.lead.effects import send_twin
from twin_controller.core.lead.modes import Mode
from twin_controller.core.lead.standing import moves_in_stop, real_stands
from twin_controller.core.lead.state import record_notice
from twin_controller.core.lead.table import FOLLOWS_TWIN
from twin_controller.core.lead.transition import reject
from twin_controller.core.orders.gripper import Notice, rest, watch_grippers
from twin_controller.core.orders.order import send
from twin_controller.core.orders.speed import Leader, cap_speeds
from twin_controller.core.orders.state import held_there
from twin_controller.core.orders.stop import (
    TAKES_HOLD,
    may_give_back,
    speeds_since,
    stop_again,
    tell_twin_stop,
    twin_stop_again,
)
from twin_controller.core.orders.stream import begins_late, start_stream
from twin_controller.core.safety.fastest import Cap
from twin_controller.core.setup import Setup
from twin_controller.core.sides.measure import remember
from twin_controller.core.sides.side import Sides
from twin_controller.core.state import CoreState

replace = msgspec.structs.replace
Result = tuple[CoreState, list[AnyAction]]


def send_setpoints(
    setup: Setup, state: CoreState, now: float
) -> tuple[CoreState, list[AnyAction], bool]:
    """Send the follower its next set points; tell whether the stream program may be started."""
    sides, follow, cap = state.sides, state.follow, state.orders.speeds.cap
    actions: list[AnyAction] = []
    remembered = _noted(setup, state)
    twin_follows, setpoint = follow_twin(setup, follow.twin, sides, remembered, now)
    if setpoint is not None:
        at = sides.real.last.time
        way = [(at + point.time, point.q) for point in setpoint.points]
        twin = remember(setup, sides.twin, way)
        sides = replace(sides, twin=twin)
        actions.append(setpoint)
    # A pause ends the stream; RESUME begins it anew where the robot stands.
    paused = state.lead.mode is Mode.PAUSED
    follows = None if paused else follow.real
    stream = stream_ahead if sides.real.takes_ahead else stream_real
    streamed = stream(setup, follows, sides, follow.response, cap, now)
    told = [(setpoint.t, setpoint.q) for setpoint in streamed.told]
    sides = replace(sides, real=remember(setup, sides.real, told))
    actions += streamed.setpoints
    follow = replace(
        follow,
        twin=twin_follows,
        real=follow.real if paused else streamed.follows,
        remembered=remembered,
    )
    state = replace(state, sides=sides, follow=follow)
    if not streamed.rejected:
        return state, actions, bool(streamed.setpoints)
    # A set point that may not be sent ends the lead: nothing is repaired, and nothing left out.
    state, stopped = reject(setup, state, streamed.rejected, now)
    return state, actions + stopped, False


def note_overtaken(setup: Setup, state: CoreState) -> CoreState:
    """Take a sample in that nobody follows, for a newer one has come in already."""
    return replace(state, follow=replace(state.follow, remembered=_noted(setup, state)))


def _noted(setup: Setup, state: CoreState) -> Remembered:
    """Return what is remembered of the real robot's ways, with the newest sample if it leads."""
    if state.follow.twin is None or not state.sides.known:
        return state.follow.remembered
    return note_sample(setup, state.follow.remembered, state.sides)


def order_real(setup: Setup, state: CoreState, streamed: bool, now: float) -> Result:
    """Ask the real robot for its stream program, and tell it again to stop, where that is due."""
    orders, flags, asked = state.orders, state.sides.real.flags, list[SendReal]()
    stream, stop = orders.stream, orders.stop
    # A stream begins behind the stop of the one before: HOLD is back then.
    may = stop is None or stop.given_back is not None
    if streamed and may and stream is not None and flags is not None:
        held = held_there(setup.config.stop, orders, flags)
        stream, asked = start_stream(stream, flags, held, now)
        stop = None if asked else stop
    stop, again = stop_again(stop, setup.config.stop, now)
    away = orders.hold_away or any(each.command in TAKES_HOLD for each in again)
    state = replace(state, orders=replace(orders, stream=stream, stop=stop, hold_away=away))
    state, back = _give_hold_back(setup, state, now)
    state, resumed = _resume_twin(state, now)
    return state, [*asked, *again, *back, *resumed]


def _give_hold_back(setup: Setup, state: CoreState, now: float) -> Result:
    """Give the robot's HOLD back once it has stopped and nobody wants it held.

    This is the one place where a stop ends: whatever follows it finds HOLD back. In PAUSED it stays
    away until RESUME, in an emergency stop until RESET.
    """
    orders, flags = state.orders, state.sides.real.flags
    if not orders.hold_away or flags is None or orders.estop is not None:
        return state, []
    stop = orders.stop
    if stop is not None:
        stopped = may_give_back(stop, setup.config.stop, now)
    else:
        # The stop was struck off with a link that was lost, or the pair left PAUSED otherwise.
        wanted = state.lead.mode is Mode.PAUSED
        stopped = not wanted and real_stands(setup, state, flags, now)
    if not stopped:
        return state, []
    if stop is not None:
        stop = replace(stop, given_back=now)
    orders = replace(orders, stop=stop, hold_away=False, hold_back=now)
    return replace(state, orders=orders), [
        SendReal(Command.GIVE_HOLD_BACK, "the real robot stands")
    ]


def _resume_twin(state: CoreState, now: float) -> Result:
    """Let a twin that waits after a pause go on once the robot has come to it."""
    follows = state.follow.real
    if follows is None or follows.blend is None or state.lead.mode not in FOLLOWS_TWIN:
        return state, []
    if not follows.resumes or not finished(follows.blend, now):
        return state, []
    follows = replace(follows, resumes=False)
    state = replace(state, follow=replace(state.follow, real=follows))
    return send_twin(state, Command.RESUME_TWIN, "the real robot has come to it", now)


def order_twin(setup: Setup, state: CoreState, event: AnyEvent) -> Result:
    """Tell the twin again to stop, where its newest sample shows that it moves on, or again."""
    stop, now = state.orders.twin_stop, event.now
    if isinstance(event, TwinMeasured | TwinMotion) and moves_in_stop(setup, state, now):
        told = state.orders.told.sent + setup.config.stop.heard_ms * 1e-3
        slowest, _ = speeds_since(state.sides.twin, told, setup.velocity)
        if slowest < setup.config.stop.restart_percent * 1e-2:
            # It had obeyed: this is another motion, and no disobedience.
            stop = tell_twin_stop(None, Command.STOP_TWIN, setup.config.stop, now)
            state = replace(state, orders=replace(state.orders, twin_stop=stop))
        return send_twin(state, Command.STOP_TWIN, STOPPED_AGAIN, now)
    again = twin_stop_again(stop, now) if isinstance(event, TwinMeasured) else None
    if stop is None or again is None:
        return state, []
    stop = replace(stop, order=send(stop.order, now))
    state = replace(state, orders=replace(state.orders, twin_stop=stop))
    return send_twin(state, again, "the twin moves on", now)


def order_grippers(setup: Setup, state: CoreState, before: Sides, event: AnyEvent) -> Result:
    """Pass a gripper's switch on; who leads decides whether the robot's gripper may be told."""
    if rest(state.orders.grips, before, state.sides, event):
        return state, []
    config, lead, actions = setup.config, state.lead, list[AnyAction]()
    refusal = ""
    if lead.mode not in (Mode.IDLE, *FOLLOWS_TWIN):
        refusal = f"in {lead.mode}: not passed on to the real robot"
    if not setup.switches_gripper:
        refusal = "and not passed on: the robot's own programs switch its gripper"
    if not setup.writes:
        refusal = f"and not passed on: {setup.only_followed}"
    grips, made = watch_grippers(
        config.gripper, state.orders.grips, before, state.sides, event, refusal
    )
    for each in made:
        if isinstance(each, Notice):
            lead, decision = record_notice(
                lead, each.trigger, each.why, each.actions, config.decision_history, event.now
            )
            actions.append(decision)
        else:
            actions.append(each)
    return replace(state, lead=lead, orders=replace(state.orders, grips=grips)), actions


def cap_both(setup: Setup, state: CoreState, now: float) -> Result:
    """Keep the speed caps, and remember whether both sides are usable for the next step's edge."""
    orders, lead = state.orders, state.lead
    leader = Leader(lead.leader, state.follow.slowed)
    pace = follower_pace(setup, state.follow, state.sides, orders.speeds.cap, now)
    late = begins_late(orders.stream, orders.stop)
    if late:
        # Its set points would run away from it, and it would leap behind them.
        pace = Cap(SLOWEST_PERCENT, late)
    speeds, sent = cap_speeds(
        setup,
        orders.speeds,
        state.sides,
        state.safety,
        leader,
        pace,
        now,
    )
    if lead.links_up != state.sides.usable:
        lead = replace(lead, links_up=state.sides.usable)
    return replace(state, lead=lead, orders=replace(orders, speeds=speeds)), sent
