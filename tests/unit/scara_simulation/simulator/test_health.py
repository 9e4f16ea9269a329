"""What the operator is told about the simulation."""

from __future__ import annotations

import msgspec
import pytest
from scara_simulation.health import SaturationWatch, Status, judge
from scara_simulation.real_time import DeadlineReport

BEFORE = Status(
    paused=False,
    whole=True,
    steps=1000,
    real_time_factor=1.0,
    deadlines=DeadlineReport(500, 0, 0.1, 0.2, 0.3),
    stalls=1,
    skipped_steps=10,
    clock_steps=0,
    saturated_steps={"joint_1": 5, "joint_2": 0},
    limited_steps=0,
    refused=2,
    last_refusal="",
)


@pytest.mark.parametrize(
    ("changes", "level", "text"),
    [
        ({}, "ok", "running"),
        ({"paused": True, "real_time_factor": 0.0}, "ok", "paused"),
        ({"stalls": 2, "skipped_steps": 60}, "warn", "1 stalls, 50 steps skipped"),
        ({"clock_steps": 1}, "warn", "the system clock was stepped 1 times"),
        (
            {"refused": 3, "last_refusal": "joint_1 = nan"},
            "warn",
            "1 commands refused: joint_1 = nan",
        ),
        ({"limited_steps": 2}, "warn", "set point kept inside its limits in 2 joint steps"),
        ({"real_time_factor": 0.5}, "error", "too slow: 0.50 of real time instead of 1"),
        ({"real_time_factor": 0.5, "whole": False}, "ok", "running"),
    ],
)
def test_new_trouble_is_named(changes, level, text):
    """Only what is new since the last report counts."""
    assert judge(msgspec.structs.replace(BEFORE, **changes), BEFORE, 1.0) == (level, text)


def test_as_fast_as_possible_is_never_too_slow():
    """Without a wanted speed none can be missed."""
    assert judge(msgspec.structs.replace(BEFORE, real_time_factor=0.1), BEFORE, 0.0)[0] == "ok"


def test_first_report_says_started():
    """There is nothing to compare with."""
    assert judge(BEFORE, None, 1.0) == ("ok", "started")


def test_saturation_is_told_beside_other_troubles():
    """The words are those of the watch."""
    level, text = judge(BEFORE, BEFORE, 1.0, "joint_1 was at its effort limit")
    assert (level, text) == ("warn", "joint_1 was at its effort limit")


def watched(*counts: int, every: int = 1000) -> list[str]:
    """Return what is said of reports ``every`` so many steps; the window has 1000, 2 % are free."""
    watch = SaturationWatch(1000, 2.0)
    return [
        watch.judge(k * every, {"joint_1": 0, "joint_2": count}) for k, count in enumerate(counts)
    ]


def test_few_steps_at_the_effort_limit_in_a_window_are_no_trouble():
    """One in thousands, or all that is allowed: a hand sees nothing of it."""
    assert watched(0, 1, 2, 22, 42) == [""] * 5


def test_too_many_steps_at_the_effort_limit_name_the_joint_and_the_share():
    """And no longer than they are in the window."""
    first, second, third, fourth = watched(0, 21, 221, 222)
    assert (first, fourth) == ("", "")
    assert second.startswith("joint_2 was at its effort limit in 2.1 % of the last 1000 steps, ")
    assert third.startswith("joint_2 was at its effort limit in 20.0 % of the last 1000 steps, ")
    assert third.endswith("allowed are 2 %: it cannot follow so fast")


def test_share_of_saturated_steps_does_not_depend_on_how_often_reports_come():
    """Reports come on changes too: three steps of a hundred are not three percent of a window."""
    assert watched(0, 3, 3, 3, 3, every=100) == [""] * 5
    many = watched(*range(0, 60, 3), every=100)
    assert many[6] == "" and many[7].startswith("joint_2 was at its effort limit in 2.1 %")
    assert all(many[7:])


def test_report_that_comes_a_little_early_ends_its_window():
    """Else the next one would look back over two, and a hard second would be halved."""
    assert watched(0, 0, 25, every=990)[2].startswith("joint_2 was at its effort limit in 2.5 %")
