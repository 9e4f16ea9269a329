"""What a side was told ends with the side; what it may still be doing does not."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import HOME, SETUP, idle_pair
from scara_control.joint_motion import JointMotion
from twin_controller.core.actions import Command
from twin_controller.core.events import LinkChanged, RealMeasured, SideName
from twin_controller.core.orders.gripper import Grips, Order, Patience, tell
from twin_controller.core.orders.speed import Speeds
from twin_controller.core.orders.state import Orders
from twin_controller.core.orders.stop import StopOrder, hear_stop, stop_patience
from twin_controller.core.step import step

replace = msgspec.structs.replace


def order(wanted: float) -> Order[float]:
    """Return an order that was sent long ago, and is not shown."""
    return Order(wanted, Patience(1e3), sent=1.0, attempts=1)


def after_loss(side: SideName) -> Orders:
    """Return what is left of what both sides were told after the link to one of them is cut."""
    pair = idle_pair()
    switch = Order(True, Patience(1e3), sent=1.0, attempts=1)
    told = replace(
        pair.state.orders,
        grips=Grips(real=switch, twin=switch),
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


@pytest.mark.parametrize(("part", "over"), [(0.5, False), (1.1, True)])
def test_a_program_that_was_left_paused_is_watched_for_a_moment(part: float, over: bool) -> None:
    """After HOLD is back: one that went on by it would be stopped anew, one that stays is not."""
    config = SETUP.config.stop
    order = tell(None, Command.STOP_REAL, stop_patience(config), 1.0)
    stop = StopOrder(order, 1.0, left=True, given_back=10.0)
    sent = 10.0 + part * config.retry_ms * 1e-3
    event = RealMeasured(
        sent, sent, sent, 0, JointMotion.at_rest(HOME), own_program=True, paused=True
    )
    assert hear_stop(stop, event, True, config) == (None if over else stop)
