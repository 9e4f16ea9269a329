"""A stop is not done when it is sent: the real robot must show it.

A write may be lost with its connection, or a robot may refuse it. What a stop asked for is compared
with the robot's next answers; it is sent again, and a robot that does not obey in the end has its
drives switched off.
"""

from __future__ import annotations

from twin_controller.config import Stop
from twin_controller.core.actions import Command, Send
from twin_controller.core.events import RealMeasured
from twin_controller.core.orders.book import due
from twin_controller.core.orders.order import GiveUp, Order, Patience

StopOrder = Order[Command]
"""To stop or to hold the real robot."""

STOPPING = (Command.STOP_REAL, Command.HOLD_REAL)


def stop_patience(config: Stop) -> Patience:
    """Return how long the robot may take to show a stop."""
    return Patience(config.retry_ms * 1e-3, config.attempts, GiveUp.DRIVES_OFF)


def safety_patience(config: Stop) -> Patience:
    """Return how long the robot may go on moving in spite of a safety stop."""
    return Patience(config.safety_retry_ms * 1e-3)


def shows_stop(order: StopOrder, event: RealMeasured, streams: bool) -> bool:
    """Return whether an answer shows the stop.

    Args:
        order: What the robot was told.
        event: Its answer. One to a question from before the order tells nothing about it.
        streams: A stream has been begun since; its program is none that goes on.
    """
    if event.sent <= order.sent:
        return False
    if order.wanted is Command.HOLD_REAL:
        return event.paused or not (event.own_program or event.streaming)
    return not (event.own_program or (event.streaming and not streams))


def disobeyed(order: StopOrder | None, now: float) -> bool:
    """Return whether the real robot, which answers, has obeyed none of all attempts."""
    return bool(due([order], now).failures)


def stop_again(order: StopOrder | None, now: float) -> tuple[StopOrder | None, list[Send]]:
    """Send a stop again that the real robot should show by now."""
    for again in due([order], now).sends:
        return again, [Send(again.wanted, "the real robot does not show it yet")]
    return order, []
