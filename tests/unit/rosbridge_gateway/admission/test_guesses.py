"""Wrong tokens: how long the next one waits."""

from __future__ import annotations

import pytest
from rosbridge_gateway.admission.tokens import Guesses
from rosbridge_gateway.config import GuessLimits

LIMITS = GuessLimits(first_delay=0.5, longest_delay=4.0, forgotten_after=100.0, addresses=3)
HOST = "192.0.2.1"


def test_each_wrong_token_costs_twice_the_delay_before_up_to_the_longest() -> None:
    """An hour of guesses is no more than an hour divided by the longest delay."""
    guesses, now, delays = Guesses(LIMITS), 0.0, []
    for _ in range(6):
        assert guesses.wait(HOST, now) == 0.0
        delays.append(guesses.wrong(HOST, now))
        assert guesses.wait(HOST, now) == delays[-1]
        now += delays[-1]
    assert delays == [0.5, 1.0, 2.0, 4.0, 4.0, 4.0]


def test_delay_never_overflows() -> None:
    """Weeks of guesses."""
    guesses = Guesses(LIMITS)
    assert [guesses.wrong(HOST, float(k)) for k in range(3000)][-1] == 4.0


def test_wrong_tokens_are_forgotten_after_a_while() -> None:
    """Who mistyped yesterday begins anew."""
    guesses = Guesses(LIMITS)
    assert [guesses.wrong(HOST, now) for now in (0.0, 1.0, 101.1)] == [0.5, 1.0, 0.5]


def test_other_addresses_do_not_wait() -> None:
    """One guesser keeps nobody else out."""
    guesses = Guesses(LIMITS)
    guesses.wrong(HOST, 0.0)
    assert guesses.wait("192.0.2.2", 0.0) == 0.0


def test_memory_is_bounded_and_the_oldest_is_forgotten_first() -> None:
    """A guesser with many addresses costs no more than so many records."""
    guesses = Guesses(LIMITS)
    for k in range(1000):
        guesses.wrong(f"10.0.{k // 256}.{k % 256}", 0.0)
    assert len(guesses) == 3
    assert guesses.wait("10.0.3.231", 0.0) == 0.5 and guesses.wait("10.0.0.0", 0.0) == 0.0


@pytest.mark.parametrize(
    ("first", "second"),
    [
        ("2001:db8::1", "2001:db8::ffff:2"),
        ("fe80::1%eth0", "fe80::2%eth1"),
        ("::ffff:192.0.2.1", "192.0.2.1"),
    ],
)
def test_addresses_of_one_subscriber_count_as_one(first: str, second: str) -> None:
    """Else IPv6 gives as many attempts as one likes."""
    guesses = Guesses(LIMITS)
    guesses.wrong(first, 0.0)
    assert guesses.wait(second, 0.0) == 0.5
