"""A live test that fails is played again only where the machine stood still."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from harness.running import repeats
from harness.running.plugin import Running


def item(test: str, failures: int) -> tuple[Any, list[int]]:
    """Return a test that fails so often, and the list that counts its plays."""
    plays: list[int] = []

    def play(answer: int) -> None:
        plays.append(answer)
        assert len(plays) > failures, f"failure {len(plays)}"

    fixtures = SimpleNamespace(argnames=("answer",))
    made = SimpleNamespace(
        nodeid=test, obj=play, funcargs={"answer": 42, "other": 0}, _fixtureinfo=fixtures
    )
    return made, plays


@pytest.fixture
def late(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Give the notes of a machine that stands still in each scene."""
    notes: list[str] = []
    monkeypatch.setattr(repeats.MACHINE, "stood_still", lambda since: 0.05)
    monkeypatch.setattr(repeats.NOTES, "add", notes.append)
    return notes


def test_a_live_test_is_played_again_where_the_machine_stood_still(late: list[str]) -> None:
    """With the same fixtures, and its reason is noted."""
    made, plays = item("tests/ros/test_x.py::test_y", failures=1)
    assert Running().pytest_pyfunc_call(made) is True
    assert plays == [42, 42]
    (reason,) = late
    assert reason.startswith("the machine stood still for 50 ms; failure 1")


def test_a_live_test_that_fails_on_a_punctual_machine_fails(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It is the product's fault then."""
    monkeypatch.setattr(repeats.MACHINE, "stood_still", lambda since: 0.0)
    made, plays = item("tests/system/test_x.py::test_y", failures=1)
    with pytest.raises(AssertionError, match="failure 1"):
        Running().pytest_pyfunc_call(made)
    assert plays == [42]


def test_a_pure_test_is_never_played_again(late: list[str]) -> None:
    """Pytest itself calls it, once."""
    made, plays = item("tests/unit/test_x.py::test_y", failures=1)
    assert Running().pytest_pyfunc_call(made) is None
    assert plays == [] and late == []
