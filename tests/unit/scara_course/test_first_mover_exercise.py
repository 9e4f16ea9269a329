"""Exercise 5: who moved first, found in the table as the card tells; mistakes are named."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from typing import Any

import pytest
from harness.course import LEARNER, handed_in, marked, material
from ruamel.yaml import YAML

Numbers = dict[str, dict[str, Any]]


def onsets(learner: str, confirm: int = 3, threshold: float = 0.02) -> dict[str, dict[str, int]]:
    """Find the onset of each side in readings.csv, on its own clock [ms]."""
    text = material(5, learner)["readings.csv"]
    found: dict[str, dict[str, int]] = {}
    series: dict[tuple[str, str], list[tuple[int, float]]] = {}
    for row in csv.DictReader(text.splitlines()):
        key = row["motion"], row["side"]
        series.setdefault(key, []).append((int(row["time_ms"]), float(row["joint_1_deg"])))
    for (motion, side), readings in series.items():
        rest = sorted(value for _, value in readings[:11])[5]
        beyond = [abs(value - rest) > threshold + 1e-9 for _, value in readings]
        first = next(k for k in range(len(readings)) if all(beyond[k : k + confirm]))
        found.setdefault(motion, {})[side] = readings[first][0]
    return found


def by_card(
    learner: str = LEARNER,
    sign: int = 1,
    tie: Callable[[float, float], bool] = lambda apart, uncertain: abs(apart) < uncertain,
    change: Callable[[str, float], float] = lambda motion, apart: apart,
    **finding: Any,
) -> Numbers:
    """Follow the card, with a step done otherwise."""
    given = YAML(typ="safe").load(material(5, learner)["clocks.yaml"])
    answers: Numbers = {}
    for motion, at in onsets(learner, **finding).items():
        apart = change(motion, at["real"] - sign * given["offset_ms"] - at["twin"])
        is_tie = tie(apart, given["uncertainty_ms"])
        leader = "real" if is_tie or apart < 0 else "twin"
        answers[motion] = {
            "difference_ms": apart,
            "tie": "yes" if is_tie else "no",
            "leader": leader,
        }
    return answers


def turned(answers: Numbers, name: str, value: Callable[[Any], Any]) -> Numbers:
    """Change one answer of each motion."""
    return {motion: {**row, name: value(row[name])} for motion, row in answers.items()}


@pytest.mark.parametrize("learner", [LEARNER, *(f"learner_{k}" for k in range(20))])
def test_the_cards_way_passes_and_meets_all_four_kinds(learner: str) -> None:
    """The table alone is enough; each learner has a tie, a leading twin, and two leading robots."""
    answers = by_card(learner)
    mark = marked(5, handed_in(5, answers, learner), learner)
    assert mark.passed, mark.reason
    assert sorted((row["tie"], row["leader"]) for row in answers.values()) == [
        ("no", "real"),
        ("no", "real"),
        ("no", "twin"),
        ("yes", "real"),
    ]


RIGHT = by_card()
OTHER = {"real": "twin", "twin": "real"}


@pytest.mark.parametrize(
    ("answers", "reason"),
    [
        pytest.param(by_card(sign=0), "both clocks must be made one", id="two clocks"),
        pytest.param(by_card(sign=-1), "take the offset off", id="offset the wrong way"),
        pytest.param(by_card(tie=lambda a, u: False), "is a tie", id="no ties"),
        pytest.param(by_card(confirm=1), "three in a row", id="noise counts"),
        pytest.param(
            turned(RIGHT, "difference_ms", lambda ms: -ms), "less the twin's: its sign", id="sign"
        ),
        pytest.param(
            turned(RIGHT, "difference_ms", lambda ms: ms / 1e3), "ms, not s", id="seconds"
        ),
        pytest.param(
            turned(RIGHT, "leader", OTHER.get), r"m1: leader = \w+ is not right", id="leader"
        ),
        pytest.param(
            turned(RIGHT, "tie", {"yes": "no", "no": "yes"}.get), "tie = ", id="ties turned round"
        ),
        pytest.param(
            turned(RIGHT, "difference_ms", lambda ms: ms + 5),
            r"m1: difference_ms = -?\d+ is not within 1",
            id="one reading late",
        ),
        pytest.param(
            by_card(change=lambda motion, ms: 0.0), "difference_ms = 0 is not within", id="nothing"
        ),
        pytest.param(
            turned(RIGHT, "leader", lambda _: "operator"), "leader = operator", id="nobody asked"
        ),
    ],
)
def test_a_wrong_way_is_refused_and_named(answers: Numbers, reason: str) -> None:
    """Each for its own reason."""
    mark = marked(5, handed_in(5, answers))
    assert not mark.passed and re.search(reason, mark.reason), mark.reason


def test_the_file_of_answers_does_not_show_how_the_motions_were_made() -> None:
    """What was drawn is the solution."""
    assert "given" not in handed_in(5, RIGHT)
