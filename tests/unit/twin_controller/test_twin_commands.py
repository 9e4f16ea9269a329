"""Motion commands to the twin: sent again until reported, at most as often as the file says."""

from __future__ import annotations

from harness.pair import SETUP
from twin_controller.core.orders.order import Order, Patience
from twin_controller.twin.commands import Packet, Repeat, heard, lost_text, patience, told

LIMITS = Patience(0.1, 3)
PACKET = {"command": 1, "id": 7, "reason": "both are stopped"}


def open_order(now: float = 10.0) -> Order[Packet]:
    """Return a command that was sent once."""
    return told(PACKET, LIMITS, now)


def test_the_shipped_file_repeats_twenty_times_every_tenth_of_a_second() -> None:
    """The first one and 20 repeats: the values from before they stood in the file."""
    shipped = patience(SETUP.config.twin)
    assert (shipped.period, shipped.most) == (0.1, 21)


def test_a_reported_command_is_forgotten() -> None:
    """Its number comes back."""
    assert heard(open_order(), 7, 10.05) == Repeat(None)


def test_nothing_is_repeated_when_nothing_is_open() -> None:
    """Reports come all the time."""
    assert heard(None, 3, 10.0) == Repeat(None)


def test_an_unreported_command_waits_for_its_period() -> None:
    """Another number is no report of ours, and a report may be under way."""
    order = open_order()
    assert heard(order, 6, 10.05) == Repeat(order)


def test_an_unreported_command_is_sent_again_until_it_is_given_up() -> None:
    """Each repeat carries the same packet; after the last one it is said."""
    order, now, sent = open_order(), 10.0, 1
    while True:
        now += 0.11
        repeat = heard(order, 6, now)
        if repeat.order is None:
            break
        assert repeat.again == PACKET and repeat.lost is None
        order, sent = repeat.order, sent + 1
    assert sent == 3
    assert repeat.lost == PACKET and repeat.again is None
    assert lost_text(PACKET) == "the twin does not obey command 7: both are stopped"
