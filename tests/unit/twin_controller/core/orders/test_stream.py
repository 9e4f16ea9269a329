"""What is said of a stream program that has not begun."""

from __future__ import annotations

import pytest
from twin_controller.core.actions import Command
from twin_controller.core.orders.order import Order, Patience
from twin_controller.core.orders.stop import StopOrder
from twin_controller.core.orders.stream import StreamOrder, begins_late

STOP = StopOrder(Order(Command.STOP_REAL, Patience(0.5)), 1.0)


@pytest.mark.parametrize(
    ("attempts", "shown", "stop", "text"),
    [
        (0, False, None, ""),
        (1, False, None, ""),
        (2, False, None, "the real robot has not started its stream program yet"),
        (2, True, None, ""),
        (1, False, STOP, "the real robot still ends its stream program"),
        (2, False, STOP, "the real robot still ends its stream program"),
        (1, True, STOP, ""),
    ],
)
def test_a_robot_that_follows_late_is_told_of_from_the_second_try(
    attempts: int, shown: bool, stop: StopOrder | None, text: str
) -> None:
    """Once is what each begin takes; what the stop before needs is told at once."""
    start = Order(Command.START_STREAM, Patience(0.5), attempts=attempts, shown=shown)
    assert begins_late(StreamOrder(start), stop) == text
    assert begins_late(None, stop) == ""
