"""A live test that fails is played again only where the machine stood still."""

from __future__ import annotations

from contextlib import nullcontext
from types import SimpleNamespace
from typing import Any

import pytest
from harness.running import repeats
from harness.running.plugin import Running


@pytest.mark.parametrize(
    ("test", "gap", "taken", "plays"),
    [
        ("tests/ros/test_x.py::test_y", 0.05, True, 2),
        ("tests/system/test_x.py::test_y", 0.0, True, 1),
        ("tests/unit/test_x.py::test_y", 0.05, None, 0),
    ],
    ids=["late", "in time", "pure: pytest itself calls it, once"],
)
def test_a_live_test_is_played_again_where_the_machine_stood_still(
    monkeypatch: pytest.MonkeyPatch, test: str, gap: float, taken: bool | None, plays: int
) -> None:
    """With the same fixtures, and its reason is noted; else it is the product's fault."""
    notes: list[str] = []
    monkeypatch.setattr(repeats.MACHINE, "stood_still", lambda since: gap)
    monkeypatch.setattr(repeats.NOTES, "add", notes.append)
    played: list[int] = []

    def play(answer: int) -> None:
        played.append(answer)
        assert len(played) > 1, "the first fails"

    item: Any = SimpleNamespace(
        nodeid=test,
        obj=play,
        funcargs={"answer": 42, "other": 0},
        _fixtureinfo=SimpleNamespace(argnames=("answer",)),
    )
    with pytest.raises(AssertionError, match="the first fails") if plays == 1 else nullcontext():
        assert Running().pytest_pyfunc_call(item) is taken
    assert played == plays * [42]
    assert [note.partition("; ")[0] for note in notes] == (
        ["the machine stood still for 50 ms"] if plays == 2 else []
    )
