"""The orders that are open: which of them are sent now, and which are given up."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Generic, NamedTuple, TypeVar

from twin_controller.core.orders.order import Order, overdue, send

Wanted = TypeVar("Wanted")


class Due(NamedTuple, Generic[Wanted]):
    """What is to be done about some orders now.

    Attributes:
        sends: Those to send, as they are after that.
        failures: Those to give up; ``patience.give_up`` says what that means.
    """

    sends: list[Order[Wanted]]
    failures: list[Order[Wanted]]


def due(orders: Iterable[Order[Wanted] | None], now: float) -> Due[Wanted]:
    """Sort out which orders are due; None stands for an order that nobody has given.

    Args:
        orders: Any orders, of one side or of both.
        now: Time [s].
    """
    late = [order for order in orders if order is not None and overdue(order, now)]
    sends = [send(order, now) for order in late if not order.spent]
    return Due(sends, [order for order in late if order.spent])
