"""One step of the twin controller: (setup, state, event) -> (state, actions).

The stages stand in the order in which they need each other; each says why it has its place.
"""

from __future__ import annotations

import msgspec

from twin_controller.core.actions import AnyAction
from twin_controller.core.events import (
    AnyEvent,
    ControlAsked,
    Operator,
    RealKnown,
    RealMeasured,
)
from twin_controller.core.follow.response import measured, recalled
from twin_controller.core.lead.commands.holder import hear_command, hear_control, let_time_pass
from twin_controller.core.lead.modes import Mode
from twin_controller.core.lead.reports import (
    agree_when_stopped,
    note_ended,
    note_in_zone,
    note_operation_mode,
    note_override,
    note_pauses,
    note_stopped,
)
from twin_controller.core.lead.sending import (
    cap_both,
    note_overtaken,
    order_grippers,
    order_real,
    order_twin,
    send_setpoints,
)
from twin_controller.core.lead.table import FOLLOWS_TWIN, LEADING
from twin_controller.core.lead.transition import transition
from twin_controller.core.lead.triggers import find_trigger
from twin_controller.core.orders.state import forget_lost, hear
from twin_controller.core.safety.watch import PairTask, watch
from twin_controller.core.setup import Setup
from twin_controller.core.sides.measure import drop_stale, take_in
from twin_controller.core.state import CoreState

replace = msgspec.structs.replace
Result = tuple[CoreState, list[AnyAction]]


def step(setup: Setup, before: CoreState, event: AnyEvent) -> Result:
    """Take one input in and decide.

    Args:
        setup: Profile and numbers.
        before: Everything known so far.
        event: The input; ``event.now`` never decreases.

    Returns:
        The new state, and the actions in the order in which they are to be carried out.
    """
    now, lead = event.now, before.lead

    # 1 Take in what the sides say. First, for everything else is judged on it.
    heard = take_in(setup, before.sides, event)
    answered = isinstance(event, RealMeasured) and heard.real.flags is event
    follow = before.follow
    if answered and lead.mode in FOLLOWS_TWIN:
        held = follow.real is not None and follow.real.held
        response = measured(setup, follow.response, heard.real, held)
        follow = replace(follow, response=response)
    elif isinstance(event, RealKnown):
        follow = replace(follow, response=recalled(setup.config.response, follow.response, event))

    # 2 Drop what is stale: no decision may rest on it, no order may wait for a side that is lost.
    sides = drop_stale(setup, heard, now)
    orders = forget_lost(before.orders, sides)

    # 3 Judge safety, on all that was heard: what is too old to be followed may still be a danger.
    led, streams = lead.mode in LEADING, follow.real is not None
    catches_up = follow.real is not None and follow.real.resumes
    task = PairTask(led, led or lead.mode is Mode.IDLE, streams, catches_up)
    safety = watch(setup, before.safety, heard, event, task)

    # 4 Find the trigger: the most urgent thing that has happened. What the sides show of our orders
    # is struck off before, or a stop that is obeyed just now would count as ignored.
    told = orders.stop
    orders = hear(
        setup.config.change,
        setup.config.stop,
        orders,
        event,
        heard,
        safety.guard.moves,
        lead.mode is Mode.REAL_LEADS,
    )
    lead = note_stopped(lead, told, orders.stop)
    lead, actions = note_ended(setup, lead, event)
    lead, sent = note_in_zone(setup, lead, before.safety.guard.inside, safety.guard.inside, now)
    actions += sent
    lead, sent = note_operation_mode(setup, lead, event)
    actions += sent
    lead, speeds, sent = note_override(setup, lead, orders.speeds, event)
    actions += sent
    if speeds is not orders.speeds:
        orders = replace(orders, speeds=speeds)
    lead = note_pauses(lead, sides)
    sides = agree_when_stopped(setup, lead, sides, now)
    state = CoreState(sides, lead, orders, safety, follow)
    trigger = find_trigger(setup, state, event)

    # 5 Hear the operator: his command asks for a trigger too, but what has happened goes first. Who
    # has been silent for too long no longer holds control by now.
    state, sent = let_time_pass(setup, state, event)
    actions += sent
    command = event if isinstance(event, Operator) else None

    # 6 Lead: the table says what follows from the trigger, then, in the mode after it, from the
    # command. Before all that is sent: a side that has lost the lead gets no more set points.
    if trigger is not None:
        state, sent = transition(setup, state, trigger, now)
        actions += sent
    if command is not None:
        state, sent = hear_command(setup, state, command)
        actions += sent
    elif isinstance(event, ControlAsked):
        state, sent = hear_control(setup, state, event)
        actions += sent

    # 7 Follow: who follows now gets its set points, once for each new sample of the real robot. A
    # machine that is late takes several at once: they would all be told anew, and it never catches
    # up.
    newest = state.sides.real.history[-1:]
    sampled = isinstance(event, RealMeasured) and newest != before.sides.real.history[-1:]
    streamed = False
    if sampled and isinstance(event, RealMeasured) and event.overtaken:
        state = note_overtaken(setup, state)
    elif sampled:
        state, sent, streamed = send_setpoints(setup, state, now)
        actions += sent

    # 8 Orders: what a side should show by now and does not is sent again. Behind the set points,
    # for the stream program must find a fresh one; only a robot that answers is late with a stop.
    if sampled:
        state, sent = order_real(setup, state, streamed, now)
        actions += sent
    state, sent = order_twin(setup, state, event)
    actions += sent
    state, sent = order_grippers(setup, state, before.sides, event)
    actions += sent

    # 9 Caps: last, for they depend on who leads now and on what was limited above.
    state, sent = cap_both(setup, state, now)
    return state, actions + sent
