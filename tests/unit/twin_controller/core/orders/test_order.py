"""An order is sent again each period until the side shows it, and given up after some attempts."""

import math

import msgspec
import pytest
from twin_controller.core.orders.order import GiveUp, Order, Patience, due, overdue, send

PATIENCE = Patience(0.25, 3, GiveUp.SAY_SO)


def shown(order: Order[str]) -> Order[str]:
    """Return the order as one that the side shows."""
    return msgspec.structs.replace(order, shown=True)


def test_new_order_is_due_at_once_and_counts_its_first_attempt() -> None:
    """An order that was never sent waits for nothing."""
    order = Order("on", PATIENCE)
    assert order.sent == -math.inf and order.due_at == -math.inf
    sends, failures = due([order], 7.0)
    assert sends == [Order("on", PATIENCE, 7.0, 1)] and failures == []


@pytest.mark.parametrize(("later", "sent"), [(0.0, 0), (0.24, 0), (0.25, 1), (0.26, 1), (5.0, 1)])
def test_order_is_sent_again_after_its_period_and_not_before(later: float, sent: int) -> None:
    """The period counts from the last attempt, and one look sends at most once."""
    order = send(Order("on", PATIENCE), 4.0)
    assert order.due_at == 4.25
    assert len(due([order], 4.0 + later).sends) == sent
    assert overdue(order, 4.0 + later) is bool(sent)


def test_order_is_sent_at_most_so_often_and_fails_once_the_last_attempt_had_its_time() -> None:
    """The last attempt gets its whole period; what fails is returned as it was sent last."""
    order, times, failed = Order(5, PATIENCE), [], []
    for k in range(12):
        sends, failures = due([order], 0.125 * k)
        if failures:
            failed = failures
            break
        for order in sends:
            times.append(order.sent)
    assert times == [0.0, 0.25, 0.5] and failed == [Order(5, PATIENCE, 0.5, 3)]
    assert failed[0].spent and failed[0].patience.give_up is GiveUp.SAY_SO


def test_order_without_a_limit_never_fails() -> None:
    """An emergency stop is sent as long as a side does not show it."""
    order = Order("freeze", Patience(0.5))
    for k in range(5000):
        sends, failures = due([order], 0.5 * k)
        assert len(sends) == 1 and not failures
        order = sends[0]
    assert order.attempts == 5000 and order.patience.give_up is GiveUp.NEVER


def test_order_that_is_shown_is_neither_sent_nor_given_up() -> None:
    """However long ago and however often it was sent."""
    order = Order("on", PATIENCE, 1.0, 3)
    assert due([shown(order)], 100.0) == ([], [])
    assert due([order], 100.0).failures == [order]


def test_orders_are_sorted_in_their_own_order_and_a_missing_one_is_none() -> None:
    """Several orders are looked at in one call: each is sent, given up or left alone."""
    late, spent = Order("a", PATIENCE, 0.0, 1), Order("b", PATIENCE, 0.0, 3)
    fresh = Order("c", PATIENCE, 0.9, 1)
    sends, failures = due([None, late, spent, fresh, None], 1.0)
    assert [order.wanted for order in sends] == ["a"]
    assert [order.wanted for order in failures] == ["b"]


def test_order_survives_being_recorded_with_what_it_wants() -> None:
    """The state is recorded: an order reads back as it was, its infinite time too."""
    order = Order(("on", 3), PATIENCE)
    data = msgspec.msgpack.encode(order)
    assert msgspec.msgpack.decode(data, type=Order[tuple[str, int]]) == order
