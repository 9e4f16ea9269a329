"""What a connection may take in a time."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rosbridge_gateway.protocol.rate import Budget, RateLimit


def budget(shared: RateLimit | None = None) -> Budget:
    """Return one of 100 packets, 10,000 bytes and 0.05 s of processor time a second."""
    return Budget(100.0, 10_000.0, 0.05, burst=0.2, now=0.0, shared=shared)


def test_what_fits_waits_for_nothing() -> None:
    """A fifth of a second's worth is free at once."""
    mine = budget()
    for _ in range(20):
        mine.packet(0.0)
    mine.received(2000, 0.0)
    mine.computed(0.01, 0.0)
    assert mine.wait(0.0) == 0.0


@pytest.mark.parametrize(
    ("packets", "octets", "seconds", "wait"),
    [(30, 0, 0.0, 0.1), (0, 12_000, 0.0, 1.0), (0, 0, 0.02, 0.2), (30, 12_000, 0.02, 1.0)],
)
def test_what_was_taken_beyond_is_paid_back_by_waiting(
    packets: int, octets: int, seconds: float, wait: float
) -> None:
    """The bucket in the deepest debt decides; afterwards it is free again."""
    mine = budget()
    for _ in range(packets):
        mine.packet(0.0)
    mine.received(octets, 0.0)
    mine.computed(seconds, 0.0)
    assert mine.wait(0.0) == pytest.approx(wait)
    assert mine.wait(wait / 2) == pytest.approx(wait / 2)
    assert mine.wait(wait + 1e-9) == 0.0


def test_processor_time_of_all_counts_together() -> None:
    """Who has taken nothing waits too when the others of its kind have taken all."""
    shared = RateLimit(0.1, 0.01, 0.01, 0.0)
    first, second = budget(shared), budget(shared)
    first.computed(0.06, 0.0)
    assert second.wait(0.0) == pytest.approx(0.5)


@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 0.1)), max_size=50))
def test_who_waits_as_told_never_takes_more_than_its_share(
    steps: list[tuple[float, float]],
) -> None:
    """Over any time: burst and share, and the one piece of work that was under way."""
    mine, now, taken, largest = budget(), 0.0, 0.0, 0.0
    for pause, work in steps:
        now += pause
        now += mine.wait(now)
        mine.computed(work, now)
        taken, largest = taken + work, max(largest, work)
        assert taken <= 0.05 * 0.2 + 0.05 * now + largest + 1e-6


def test_clock_that_does_not_go_on_gives_nothing() -> None:
    """Two readings of one instant, in any order, fill a bucket once."""
    bucket = RateLimit(10.0, 5.0, 0.0, 1.0)
    bucket.spend(1.0, 0.5)
    assert bucket.wait(1.0) == pytest.approx(0.1)
    assert not bucket.allow(1.15) and bucket.allow(1.21)
