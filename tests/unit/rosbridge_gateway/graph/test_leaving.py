"""What leaves the graph waits for a master that hangs; who takes it out does not."""

from __future__ import annotations

import threading

import pytest
from harness.processes import wait_until
from rosbridge_gateway.graph import leaving_io
from rosbridge_gateway.graph.leaving_io import Leaving

LONG_S = 30.0


def test_behind_a_master_that_hangs_nobody_waits_and_the_order_stays(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One waits for the time-out of a question; who comes then goes on at once."""
    back, left = threading.Event(), []
    leaving = Leaving()

    def hang() -> None:
        assert back.wait(LONG_S)
        left.append("hung")

    monkeypatch.setattr(leaving_io, "TIMEOUT", LONG_S)
    leaving.leave(lambda: left.append("before"))
    assert left == ["before"], "it is out when this returns: it may be offered anew"
    monkeypatch.setattr(leaving_io, "TIMEOUT", 0.01)
    leaving.leave(hang)
    monkeypatch.setattr(leaving_io, "TIMEOUT", 100 * LONG_S)
    for name in ("first", "second"):
        leaving.leave(lambda name=name: left.append(name))  # type: ignore[misc]
    assert left == ["before"]
    back.set()
    wait_until(lambda: len(left) == 4, LONG_S, "all that waited")
    assert left == ["before", "hung", "first", "second"]


def test_what_cannot_be_taken_out_is_told_and_ends_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """The next is taken out all the same."""
    monkeypatch.setattr(leaving_io, "TIMEOUT", LONG_S)
    leaving, left = Leaving(), []

    def fail() -> None:
        raise KeyError("no matching cb")

    with pytest.raises(KeyError, match="no matching cb"):
        leaving.leave(fail)
    leaving.leave(lambda: left.append("next"))
    assert left == ["next"]
