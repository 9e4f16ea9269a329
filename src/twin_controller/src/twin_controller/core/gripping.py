"""The grippers of both sides: who switched his own, and what the other one is told. Positions play no part in it.

A switch of the real robot's gripper is always passed on to the twin; one of the twin's only while the twin may command the
robot. A switch is the change of a side's own level that we have not ordered: nothing is replayed after a reconnect, and
neither a stop nor a lost link switches anything. An order counts as delivered when the side shows it.
"""

from __future__ import annotations

import msgspec

from twin_controller.core.actions import AnyAction, Decided, Grip
from twin_controller.core.events import AnyEvent, GripAnswered, RealMeasured, SideName, TwinGripper
from twin_controller.core.rules.table import Mode
from twin_controller.core.state import CoreState, GripOrder, Gripper, Setup

replace = msgspec.structs.replace
Result = tuple[CoreState, list[AnyAction]]

TO_REAL = (Mode.IDLE, Mode.TWIN_LEADS, Mode.OPERATOR_LEADS)
NAMES: dict[SideName, str] = {"real": "the real robot's gripper", "twin": "the twin's gripper"}


def watch_grippers(setup: Setup, state: CoreState, event: AnyEvent) -> Result:
    """Take in what a gripper shows, pass a switch on, and see that orders are obeyed.

    Args:
        setup: Profile and numbers.
        state: The state after everything else of this step.
        event: The input of this step.

    Returns:
        The state after, and the actions: orders, and a decision for each order, refusal and trouble.
    """
    actions: list[AnyAction] = []
    state = _forget_lost(state)
    if isinstance(event, RealMeasured) and event.gripper is not None and state.real.history:
        state, actions = _shows(setup, state, "real", Gripper(event.gripper, event.vacuum), event.now)
    elif isinstance(event, TwinGripper) and state.twin.connected:
        state, actions = _shows(setup, state, "twin", Gripper(event.on, event.holding, event.part), event.now)
    elif isinstance(event, GripAnswered) and not event.success:
        state, actions = _trouble(setup, state, "GRIPPER_REFUSED", f"{NAMES[event.side]}: {event.message}", event.now)
    state, done = _see_to_orders(setup, state, event.now)
    state, judged = _judge(setup, state, event.now)
    return state, [*actions, *done, *judged]


def _forget_lost(state: CoreState) -> CoreState:
    """Forget the gripper of a side whose data cannot be used; an order to it is not sent again."""
    if not state.real.history and (state.grip_real.on is not None or state.order_real):
        state = replace(state, grip_real=Gripper(), order_real=None)
    if not state.twin.connected and (state.grip_twin.on is not None or state.order_twin):
        state = replace(state, grip_twin=Gripper(), order_twin=None)
    return state


def _shows(setup: Setup, state: CoreState, side: SideName, shown: Gripper, now: float) -> Result:
    """Take in what a side shows; a switch that nobody ordered is its own."""
    before: Gripper = getattr(state, f"grip_{side}")
    if shown == before:
        return state, []
    state = replace(state, **{f"grip_{side}": shown})
    order: GripOrder | None = getattr(state, f"order_{side}")
    if order is not None and order.on == shown.on:
        return replace(state, **{f"order_{side}": None}), []
    if before.on is None or before.on == shown.on:
        return state, []
    return _pass_on(setup, state, "twin" if side == "real" else "real", bool(shown.on), now)


def _pass_on(setup: Setup, state: CoreState, side: SideName, on: bool, now: float) -> Result:
    """Order the same of the other side, or say why not."""
    other: Gripper = getattr(state, f"grip_{side}")
    source = NAMES["twin" if side == "real" else "real"]
    text = f"{source} was switched {_level(on)}"
    if other.on is None:
        return _trouble(setup, state, "GRIPPER_REFUSED", f"{text}: {NAMES[side]} is not there", now)
    if side == "real" and state.mode not in TO_REAL:
        return _trouble(setup, state, "GRIPPER_REFUSED", f"{text} in {state.mode}: not passed on to the real robot", now)
    if other.on == on and getattr(state, f"order_{side}") is None:
        return state, []
    state = replace(state, **{f"order_{side}": GripOrder(on, now, 1)})
    state, decision = _decide(setup, state, "GRIPPER_SWITCHED", f"{text}: {NAMES[side]} follows", now, (f"GRIP_{side.upper()}",))
    return state, [decision, Grip(side, on)]


def _see_to_orders(setup: Setup, state: CoreState, now: float) -> Result:
    """Send an order again that the side does not show; give up after some attempts, and say so."""
    config = setup.config.gripper
    actions: list[AnyAction] = []
    for side in NAMES:
        order: GripOrder | None = getattr(state, f"order_{side}")
        if order is None or now - order.sent < config.retry_ms * 1e-3:
            continue
        if order.attempts < config.attempts:
            state = replace(state, **{f"order_{side}": GripOrder(order.on, now, order.attempts + 1)})
            actions.append(Grip(side, order.on))
            continue
        state = replace(state, **{f"order_{side}": None})
        text = f"{NAMES[side]} was told {order.attempts} times to be {_level(order.on)} and is not"
        state, done = _trouble(setup, state, "GRIPPER_UNDELIVERED", text, now)
        actions += done
    return state, actions


def _judge(setup: Setup, state: CoreState, now: float) -> Result:
    """Say it when the grippers do not do the same for a while; forget old trouble when they do."""
    real, twin = state.grip_real, state.grip_twin
    differ = None not in (real.on, twin.on) and (real.on, real.holding) != (twin.on, twin.holding)
    if not differ:
        settled = state.order_real is None and state.order_twin is None and real.on is not None and twin.on is not None
        if state.grip_differ is None and not (settled and state.grip_trouble):
            return state, []
        return replace(state, grip_differ=None, grip_trouble="" if settled else state.grip_trouble), []
    if state.grip_differ is None:
        return replace(state, grip_differ=now), []
    waited = now - state.grip_differ
    if state.grip_trouble or state.order_real or state.order_twin or waited < setup.config.gripper.agree_ms * 1e-3:
        return state, []
    text = f"the grippers differ: real {gripper_text(real)}, twin {gripper_text(twin)}"
    return _trouble(setup, state, "GRIPPERS_DIFFER", text, now)


def _trouble(setup: Setup, state: CoreState, trigger: str, text: str, now: float) -> Result:
    state, decision = _decide(setup, replace(state, grip_trouble=text), trigger, text, now)
    return state, [decision]


def _decide(
    setup: Setup, state: CoreState, trigger: str, why: str, now: float, actions: tuple[str, ...] = ()
) -> tuple[CoreState, Decided]:
    """Record a decision that changes no mode."""
    decision = Decided(state.seq + 1, now, state.mode.value, trigger, state.mode.value, state.leader, actions, why)
    kept = (*state.decisions, decision)[-setup.config.decision_history :]
    return replace(state, seq=decision.seq, decisions=kept), decision


def gripper_text(gripper: Gripper) -> str:
    """Return a gripper's state in one word, or with the part that it holds: off, on, holding, unknown."""
    if gripper.on is None:
        return "unknown"
    if gripper.holding:
        return f"holding {gripper.part}".rstrip()
    return _level(gripper.on)


def _level(on: bool) -> str:
    return "on" if on else "off"
