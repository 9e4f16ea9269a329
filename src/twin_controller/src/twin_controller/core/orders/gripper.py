"""The grippers of both sides: who switched his own, and what the other one is told.

Positions play no part in it. A switch of the real robot's gripper is always passed on to the twin;
one of the twin's only while the twin may command the robot. A switch is the change of a side's own
level that we have not ordered: nothing is replayed after a reconnect, and neither a stop nor a lost
link switches anything.
"""

from __future__ import annotations

import msgspec

from twin_controller.config import Gripper as GripperConfig
from twin_controller.core.actions import Grip
from twin_controller.core.events import AnyEvent, GripAnswered, SideName
from twin_controller.core.orders.order import Due, GiveUp, Order, Patience, due, fresh, tell
from twin_controller.core.sides.side import Gripper, Sides

replace = msgspec.structs.replace

GripOrder = Order[bool]
"""To switch the suction of one side."""

NAMES: dict[SideName, str] = {"real": "the real robot's gripper", "twin": "the twin's gripper"}


class Grips(msgspec.Struct, frozen=True):
    """What both grippers were told, and how they get on."""

    # Each ends when its side switches as it was told, is lost, or was told in vain too often.
    real: GripOrder | None = None
    twin: GripOrder | None = None
    # Since when the grippers have not done the same [s]; None: they do, or one is not known.
    differ: float | None = None
    # What was not passed on, not obeyed, or differs; empty once they do the same.
    trouble: str = ""


AGREED = Grips()
"""Nothing is ordered, and they do the same as far as they are known."""


class Notice(msgspec.Struct, frozen=True):
    """Something to be recorded as a decision that changes no mode."""

    trigger: str
    why: str
    actions: tuple[str, ...] = ()


Result = tuple[Grips, list[Notice | Grip]]


def rest(grips: Grips, before: Sides, sides: Sides, event: AnyEvent) -> bool:
    """Return whether this input leaves both grippers, and what they were told, as they were."""
    old, new = (before.real.gripper, before.twin.gripper), (sides.real.gripper, sides.twin.gripper)
    return grips == AGREED and old == new and not isinstance(event, GripAnswered)


def watch_grippers(
    config: GripperConfig,
    grips: Grips,
    before: Sides,
    sides: Sides,
    event: AnyEvent,
    refusal: str,
) -> Result:
    """Pass a switch on, and see that orders are obeyed.

    Args:
        config: How long a gripper may take.
        grips: What was told so far.
        before: Both sides before this input.
        sides: Both sides now.
        event: The input.
        refusal: Why a switch of the twin's is not passed on; empty: the twin may command the robot.

    Returns:
        What was told by now; orders and notices in the order in which they were made.
    """
    now = event.now
    # Orders that are shown now are struck off; a switch that nobody ordered is the side's own.
    real, own_real = _switched(grips.real, before.real.gripper, sides.real.gripper, now)
    twin, own_twin = _switched(grips.twin, before.twin.gripper, sides.twin.gripper, now)
    grips = replace(grips, real=real, twin=twin)
    made: list[Notice | Grip] = []
    if own_real is not None:
        grips, made = _pass_on(config, grips, sides, "twin", own_real, "", now)
    elif own_twin is not None:
        grips, made = _pass_on(config, grips, sides, "real", own_twin, refusal, now)
    elif isinstance(event, GripAnswered) and not event.success:
        grips, made = _trouble(grips, "GRIPPER_REFUSED", f"{NAMES[event.side]}: {event.message}")
    grips, repeated = _see_to_orders(grips, refusal, now)
    grips, judged = _judge(config, grips, sides, now)
    return grips, [*made, *repeated, *judged]


def _switched(
    order: GripOrder | None, before: Gripper, shown: Gripper, now: float
) -> tuple[GripOrder | None, bool | None]:
    """Return what remains of a side's order, and its level if it was switched on its own."""
    if shown.on is None:
        return order, None
    young = order is not None and fresh(order, now)
    if order is not None and order.wanted == shown.on and (shown != before or not young):
        return None, None
    # Only a change shows something: a side that is lost or new has not been switched. And behind an
    # order that took another back, a side first does what it was told before.
    if shown == before or young:
        return order, None
    if before.on is None or before.on == shown.on:
        return order, None
    return order, shown.on


def _pass_on(
    config: GripperConfig,
    grips: Grips,
    sides: Sides,
    side: SideName,
    on: bool,
    refusal: str,
    now: float,
) -> Result:
    """Order the same of the other side, or say why not."""
    if side == "real":
        source, shown, order = NAMES["twin"], sides.real.gripper, grips.real
    else:
        source, shown, order = NAMES["real"], sides.twin.gripper, grips.twin
    text = f"{source} was switched {_level(on)}"
    if shown.on is None:
        return _trouble(grips, "GRIPPER_REFUSED", f"{text}: {NAMES[side]} is not there")
    if refusal:
        return _trouble(grips, "GRIPPER_REFUSED", f"{text} {refusal}")
    if shown.on == on and order is None:
        return grips, []
    patience = Patience(config.retry_ms * 1e-3, config.attempts, GiveUp.SAY_SO)
    # It counts from one again: the side is told by a new switch, not once more.
    order = tell(None, on, patience, now)
    if side == "real":
        grips = replace(grips, real=order)
    else:
        grips = replace(grips, twin=order)
    told = (f"GRIP_{side.upper()}",)
    notice = Notice("GRIPPER_SWITCHED", f"{text}: {NAMES[side]} follows", told)
    return grips, [notice, Grip(side, on)]


def _see_to_orders(grips: Grips, refusal: str, now: float) -> Result:
    """Send again what a side does not show; give up after some attempts, and say so.

    The real robot is told nothing again once the twin may no longer command it: that was before a
    stop.
    """
    made: list[Notice | Grip] = []
    real, twin = due([grips.real], now), due([grips.twin], now)
    if refusal and real.sends and grips.real is not None:
        real = Due([], [grips.real])
    for again in real.sends:
        grips = replace(grips, real=again)
        made.append(Grip("real", again.wanted))
    for lost in real.failures:
        grips, said = _given_up(replace(grips, real=None), "real", lost)
        made += said
    for again in twin.sends:
        grips = replace(grips, twin=again)
        made.append(Grip("twin", again.wanted))
    for lost in twin.failures:
        grips, said = _given_up(replace(grips, twin=None), "twin", lost)
        made += said
    return grips, made


def _given_up(grips: Grips, side: SideName, order: GripOrder) -> Result:
    """Say that a side does not do what it was told."""
    told = f"{NAMES[side]} was told {order.attempts} times to be {_level(order.wanted)} and is not"
    return _trouble(grips, "GRIPPER_UNDELIVERED", told)


def _judge(config: GripperConfig, grips: Grips, sides: Sides, now: float) -> Result:
    """Say it when the grippers do not do the same for a while; forget old trouble when they do."""
    real, twin = sides.real.gripper, sides.twin.gripper
    known = real.on is not None and twin.on is not None
    ordered = grips.real is not None or grips.twin is not None
    if not known or (real.on, real.holding) == (twin.on, twin.holding):
        settled = known and not ordered
        return replace(grips, differ=None, trouble="" if settled else grips.trouble), []
    if grips.differ is None:
        return replace(grips, differ=now), []
    # What is being done about it, or was said already, is not said again.
    if grips.trouble or ordered or now - grips.differ < config.agree_ms * 1e-3:
        return grips, []
    text = f"the grippers differ: real {gripper_text(real)}, twin {gripper_text(twin)}"
    return _trouble(grips, "GRIPPERS_DIFFER", text)


def _trouble(grips: Grips, trigger: str, text: str) -> Result:
    return replace(grips, trouble=text), [Notice(trigger, text)]


def gripper_text(gripper: Gripper) -> str:
    """Return a gripper's state in a word: off, on, holding (and what), unknown."""
    if gripper.on is None:
        return "unknown"
    if gripper.holding:
        return f"holding {gripper.part}".rstrip()
    return _level(gripper.on)


def _level(on: bool) -> str:
    return "on" if on else "off"
