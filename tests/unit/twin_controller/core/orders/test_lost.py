"""What a side was told ends with the side; what it may still be doing does not."""

from __future__ import annotations

from typing import TypeVar

import msgspec
from harness.pair import SETUP, idle_pair
from twin_controller.core.events import LinkChanged, SideName
from twin_controller.core.orders.gripper import Grips
from twin_controller.core.orders.order import Order, Patience
from twin_controller.core.orders.speed import Speeds
from twin_controller.core.orders.state import Orders
from twin_controller.core.step import step

replace = msgspec.structs.replace


Wanted = TypeVar("Wanted", bool, float)


def order(wanted: Wanted) -> Order[Wanted]:
    """Return an order that was sent long ago, and is not shown."""
    return Order(wanted, Patience(1e3), sent=1.0, attempts=1)


def after_loss(side: SideName) -> Orders:
    """Return what is left of what both sides were told after the link to one of them is cut."""
    pair = idle_pair()
    told = replace(
        pair.state.orders,
        grips=Grips(real=order(True), twin=order(True)),
        speeds=Speeds(twin=order(40.0), real=order(40.0)),
    )
    state, _ = step(
        SETUP, replace(pair.state, orders=told), LinkChanged(pair.now, side, False, "cut")
    )
    return state.orders


def test_a_lost_twin_is_told_anew_and_the_real_robot_is_not() -> None:
    """Its cap and its gripper's switch; the other side's go on."""
    left = after_loss("twin")
    assert left.speeds.twin is None and left.grips.twin is None
    assert left.grips.real is not None


def test_a_lost_robots_gripper_is_not_switched_later_and_the_twin_goes_on() -> None:
    """Nobody knows what is under it when it answers again."""
    left = after_loss("real")
    assert left.grips.real is None and left.grips.twin is not None
    assert left.speeds.twin is not None and left.speeds.twin.wanted == 40.0
