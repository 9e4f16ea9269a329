"""What is not told counts as nothing: in events, actions and states alike."""

from __future__ import annotations

import importlib
import math
import pkgutil
from collections.abc import Iterator

import msgspec
import twin_controller.core
from twin_controller.core.lead.modes import Mode
from twin_controller.core.orders.order import GiveUp

NEVER = -1e9
"""Long before any clock's time."""
SIDE = {"deaf": (0.0, 0.0), "noise_at": NEVER, "reason": "not connected yet", "stall": (0.0, 0.0)}
TOLD = {
    "Beside.share": 1.0,
    "ChangeState.taken": (0.0, ()),
    "ClockEstimate.lower": -math.inf,
    "ClockEstimate.upper": math.inf,
    "ClockTolerance.jump": 0.1,
    "ClockTolerance.lasting": 50,
    "Distance.cap": 100.0,
    "Distance.distance": math.inf,
    "Follow.twin_stopped_at": NEVER,
    "Guard.asked": 1.0,
    "Guard.share": 1.0,
    "Lead.mode": Mode.OFFLINE,
    "Lead.operation_mode": "AUTO",
    "Lead.paused_seen": (False, False),
    "Lead.program_was_off": True,
    "Lead.why": "started; no link is up yet",
    "Order.sent": -math.inf,
    "Patience.give_up": GiveUp.NEVER,
    "RealAlarm.stops": True,
    "RealMeasured.drives_on": True,
    "RealSide.asked": NEVER,
    "Repeated.off": 4,
    "Response.at": NEVER,
    "Response.behind_at": 100.0,
    "Response.held_at": NEVER,
    "Response.spread": 0.003,
    "Speeds.cap": 100.0,
    "StopOrder.reached": True,
    **{
        f"{kind}.{name}": value
        for kind in ("Side", "RealSide", "TwinSide")
        for name, value in SIDE.items()
    },
}
"""All that counts as something before it is told."""


def structs() -> Iterator[type[msgspec.Struct]]:
    """Yield all structs that a module of the core defines."""
    for module in pkgutil.walk_packages(twin_controller.core.__path__, "twin_controller.core."):
        found = importlib.import_module(module.name)
        for each in vars(found).values():
            # A parameter of a generic struct is none, and what is imported comes where it is made.
            own = isinstance(each, type) and each.__module__ == module.name
            if own and issubclass(each, msgspec.Struct):
                yield each


def told() -> dict[str, object]:
    """Return the defaults that are more than nothing, by struct and field."""
    found: dict[str, object] = {}
    for each in structs():
        for field in msgspec.structs.fields(each):
            value = field.default
            if field.default_factory is not msgspec.NODEFAULT:
                value = field.default_factory()
            nothing = not value or (isinstance(value, msgspec.Struct) and value == type(value)())
            if value is not msgspec.NODEFAULT and not nothing:
                found[f"{each.__name__}.{field.name}"] = value
    return found


def test_what_is_not_told_counts_as_nothing_but_for_what_is_named_here() -> None:
    """No speed, no number, no place, no reason; a recording of before a field has none of it."""
    assert told() == TOLD
