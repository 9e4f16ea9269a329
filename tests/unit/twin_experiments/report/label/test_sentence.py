"""The first line of a report: good or bad, and why."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from twin_experiments.report.label.sentence import sentence
from twin_experiments.report.report_io import analyse_bag

CONFIG = Path(__file__).resolve().parents[5] / "config"
MakeBag = Callable[..., Path]


def first_sentence(bag: Path) -> str:
    """Return what the report says of the first experiment."""
    _, chosen, results = analyse_bag(bag, CONFIG)
    return sentence(results[0], chosen.robot.reach_mm, chosen.experiments.limits)


def test_a_good_experiment_says_how_near_it_came_to_each_limit(make_bag: MakeBag) -> None:
    """0.65 mm of 650 mm at rest are 0.100 %, and no more while moving in step."""
    text = first_sentence(make_bag(lag_s=0.0, offset=(0.0, 0.0, 0.00065, 0.0)))
    assert text == (
        "real_leads is good: while moving, the tools were at most 0.100 % of reach apart "
        "(limit 2 %), and at rest the error was at most 0.100 % (limit 0.2 %)."
    )


def test_a_bad_experiment_says_which_limit_and_by_how_much(make_bag: MakeBag) -> None:
    """2.6 mm are 0.400 % of 650 mm, twice the limit at rest and below the one of moving."""
    text = first_sentence(make_bag(lag_s=0.0, offset=(0.0, 0.0, 0.0026, 0.0)))
    assert text == (
        "real_leads is bad: the positioning error is 0.400 % of reach, 0.200 more than the limit "
        "of 0.2 %."
    )


@pytest.mark.parametrize(
    ("options", "text"),
    [
        (
            {"lag_s": 0.0, "frozen_after": 3.0},
            "real_leads is bad: both stood still at P1 P2 P3, expected P1 P2 P3 P1 P2 P3 P1.",
        ),
        (
            {"silent": ("twin/joint_states", "real_leads")},
            "real_leads is bad: twin: 0 samples between",
        ),
    ],
)
def test_another_reason_is_said_as_it_is(
    make_bag: MakeBag, options: dict[str, object], text: str
) -> None:
    """What is no limit of an error has its own words already."""
    assert first_sentence(make_bag(**options)).startswith(text)
