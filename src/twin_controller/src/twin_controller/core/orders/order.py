"""One order to a side: it counts as done when the side shows it, not when it was sent.

A write may be lost with its connection, a side may refuse it, or somebody at the side may undo it.
So an order is sent again each period until the side shows it. What counts as shown is one small
function for each kind of order.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Generic, NamedTuple, TypeVar

import msgspec
from scara_config.text_enum import StrEnum

Wanted = TypeVar("Wanted")


class GiveUp(StrEnum):
    """What it means when a side has shown an order after none of its attempts."""

    NEVER = "it is never given up"
    SAY_SO = "it is said and no longer sent"
    STOP_PAIR = "the pair is stopped"
    DRIVES_OFF = "the robot's drives are switched off"


class Patience(msgspec.Struct, frozen=True):
    """How long a side may take to show an order.

    Attributes:
        period: Time until it is sent again [s].
        most: It is sent at most this often; None: as long as it is wanted.
        give_up: What it means when the last attempt has failed too.
    """

    period: float
    most: int | None = None
    give_up: GiveUp = GiveUp.NEVER


class Order(msgspec.Struct, Generic[Wanted], frozen=True):
    """What a side was told, and how far that has come.

    Attributes:
        wanted: What the side is to show.
        patience: How long it may take.
        sent: When it was sent last [s]; minus infinity: not yet, so that it is due at once.
        attempts: How often it was sent.
        shown: The side shows it now. An order that is kept after that is due again once the side
            no longer shows it.
    """

    wanted: Wanted
    patience: Patience
    sent: float = -math.inf
    attempts: int = 0
    shown: bool = False

    @property
    def spent(self) -> bool:
        """Whether it was sent as often as it may be."""
        return self.patience.most is not None and self.attempts >= self.patience.most

    @property
    def due_at(self) -> float:
        """When it is sent again or given up if it is not shown by then [s]."""
        return self.sent + self.patience.period


def send(order: Order[Wanted], now: float) -> Order[Wanted]:
    """Return the order after it was sent once more, at ``now`` [s]."""
    return msgspec.structs.replace(order, sent=now, attempts=order.attempts + 1)


def tell(
    order: Order[Wanted] | None, wanted: Wanted, patience: Patience, now: float
) -> Order[Wanted]:
    """Return the order to show ``wanted``, sent at ``now`` [s]; the same one goes on counting."""
    if order is None or order.wanted != wanted:
        order = Order(wanted, patience)
    return send(order, now)


def fresh(order: Order[Wanted] | None, now: float) -> bool:
    """Return whether an order was sent so recently that the side need not show it yet."""
    return order is not None and now - order.sent < order.patience.period


def overdue(order: Order[Wanted], now: float) -> bool:
    """Return whether the side should show the order by ``now`` [s] and does not."""
    return not order.shown and not fresh(order, now)


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
