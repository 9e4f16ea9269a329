"""Which acts of a client the audit tells."""

from __future__ import annotations

from typing import Any

import pytest
from rosbridge_gateway.protocol.audit import Entry, Trail


def note(trail: Trail, now: float, what: str = "publish /t", success: bool = True) -> Entry | None:
    """Note an act."""
    return trail.note(what, {"data": 1}, success, "published", now)


def test_stream_is_one_entry() -> None:
    """A hundred messages a second say nothing more than the first."""
    trail = Trail(0.0)
    entries = [note(trail, 0.01 * k) for k in range(5000)]
    assert entries[0] == Entry('publish /t {"data":1}', True, "published")
    assert not any(entries[1:])


def test_act_after_a_silence_is_told_again() -> None:
    """A command an hour later is a new one."""
    trail = Trail(0.0)
    assert [note(trail, now) is not None for now in (0.0, 9.0, 18.0, 28.0, 37.0)] == [
        True,
        False,
        False,
        True,
        False,
    ]


def test_each_name_and_each_refusal_is_told() -> None:
    """One act does not hide another, nor a refusal."""
    trail = Trail(0.0)
    assert note(trail, 0.0) and note(trail, 0.0, "publish /u") and note(trail, 0.0, success=False)


def test_flood_of_names_is_limited_and_counted() -> None:
    """Whoever invents names cannot fill the audit; how much was left out is told."""
    trail = Trail(0.0)
    entries = [note(trail, 0.0, f"publish /t{k}") for k in range(1000)]
    assert sum(entry is not None for entry in entries) == 50
    later = note(trail, 1.0)
    assert later is not None and later.outcome == "published (950 others not told)"


def test_five_acts_a_second_are_told_behind_a_flood() -> None:
    """Fifty at once, and no more than that after a silence."""
    trail = Trail(0.0)
    for now, told in ((0.0, 50), (1.0, 5), (1.5, 2), (60.0, 50)):
        entries = [note(trail, now, f"publish /t{now}_{k}") for k in range(100)]
        assert sum(entry is not None for entry in entries) == told


def test_act_that_was_left_out_is_told_when_there_is_room() -> None:
    """Left out is not the same as told."""
    trail = Trail(0.0)
    for k in range(50):
        note(trail, 0.0, f"publish /t{k}")
    assert note(trail, 0.0) is None and note(trail, 1.0) is not None


@pytest.mark.parametrize(
    ("details", "outcome", "entry"),
    [
        (None, "", Entry("call_service /s", True, "")),
        (
            [1.5, None],
            {"success": False},
            Entry("call_service /s [1.5,null]", True, '{"success":false}'),
        ),
        (
            {"a": "y" * 1000},
            "z" * 1000,
            Entry(('call_service /s {"a":"' + "y" * 1000)[:200] + "...", True, "z" * 200 + "..."),
        ),
    ],
)
def test_text_is_short_and_says_with_what(details: Any, outcome: Any, entry: Entry) -> None:
    """The first part of what was sent and answered."""
    assert Trail(0.0).note("call_service /s", details, True, outcome, 0.0) == entry
