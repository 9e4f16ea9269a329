"""What the operator is told about the simulation."""

from __future__ import annotations

import msgspec
import pytest
from scara_simulation.health import Status, judge
from scara_simulation.real_time import DeadlineReport

BEFORE = Status(
    paused=False,
    steps=1000,
    real_time_factor=1.0,
    deadlines=DeadlineReport(500, 0, 0.1, 0.2, 0.3),
    stalls=1,
    skipped_steps=10,
    clock_steps=0,
    saturated_steps=5,
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
        ({"saturated_steps": 9}, "warn", "effort saturated in 4 joint steps"),
        ({"limited_steps": 2}, "warn", "set point kept inside its limits in 2 joint steps"),
        ({"real_time_factor": 0.5}, "error", "too slow: 0.50 of real time instead of 1"),
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
