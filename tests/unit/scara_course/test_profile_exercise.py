"""Exercise 7: card, sheet and display find each planted error; other answers are refused."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest
from harness.course import LEARNER, exercise, handed_in, marked, material, robot
from ruamel.yaml import YAML
from scara_course.exercises_io import draw

Answers = dict[str, dict[str, Any]]
LEARNERS = [f"learner_{k}" for k in range(60)]


def flat(tree: dict[str, Any], way: str = "") -> dict[str, float]:
    """Return the values of a profile by their keys."""
    found: dict[str, float] = {}
    for name, value in tree.items():
        key = f"{way}.{name}" if way else name
        found |= flat(value, key) if isinstance(value, dict) else {key: float(value)}
    return found


def sheet() -> dict[str, float]:
    """Read the card's data sheet and positions."""
    card, found = exercise(7).card, {}
    rows = {
        row.split("|")[1].strip(): [
            [float(n) for n in re.findall(r"-?[\d.]+", cell.replace("degrees/s", ""))]
            for cell in row.split("|")[2:5]
        ]
        for row in card.splitlines()
        if row.startswith("| ")
    }
    for k, unit in enumerate(("deg", "deg", "mm")):
        key = f"joints.joint_{k + 1}"
        low, high = rows["range"][k]
        found |= {f"{key}.lower_{unit}": low, f"{key}.upper_{unit}": high}
        found[f"{key}.axis_number"] = rows["axis number"][k][0]
        found[f"{key}.velocity_{unit}_s"] = rows["largest speed"][k][0]
        found[f"{key}.effort"] = rows["largest effort"][k][0]
    for name, numbers in re.findall(r"(P\d) \(([^)]*)\)", card):
        values = map(float, numbers.split(","))
        found |= {f"positions_m.{name}.{axis}": value for axis, value in zip("xyz", values)}
    return found


def by_card(learner: str = LEARNER) -> Answers:
    """Follow the card."""
    files = material(7, learner)
    profile, known = flat(YAML(typ="safe").load(files["profile.yaml"])), sheet()
    # The lengths: least squares over both poses of the display.
    rows = [[float(n) for n in line.split(",")[1:]] for line in files["display.csv"].split()[1:]]
    A, b = [], []
    for q1, q2, _, x, y, _ in rows:
        first, both = np.radians(q1), np.radians(q1 + q2)
        A += [[np.cos(first), np.cos(both)], [np.sin(first), np.sin(both)]]
        b += [x, y]
    l1, l2 = np.linalg.lstsq(np.array(A), np.array(b), rcond=None)[0]
    known |= {"geometry.l1_mm": float(round(l1)), "geometry.l2_mm": float(round(l2))}
    known["geometry.h_mm"] = float(round(rows[0][5] - rows[0][2]))
    (key,) = (key for key, value in profile.items() if value != known[key])
    return {"error": {"key": key, "wrong": profile[key], "right": known[key]}}


@pytest.mark.parametrize("learner", LEARNERS)
def test_the_cards_way_finds_the_error(learner: str) -> None:
    """The sheet is the shipped robot's, and one value alone differs from it."""
    mark = marked(7, handed_in(7, by_card(learner), learner), learner)
    assert mark.passed, mark.reason


def test_learners_get_each_of_the_errors() -> None:
    """Twelve kinds, among sixty learners."""
    keys = {by_card(learner)["error"]["key"] for learner in LEARNERS}
    assert keys == set(exercise(7).check.PLANTED)
    right = exercise(7).check.values(robot())
    assert all(right[key] != wrong for key, wrong in exercise(7).check.PLANTED.items())


RIGHT = by_card()["error"]
OTHER = next(key for key in sheet() if key.split(".")[0] != RIGHT["key"].split(".")[0])


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        pytest.param(
            {"wrong": RIGHT["right"], "right": RIGHT["wrong"]}, "right what should", id="swapped"
        ),
        pytest.param({"key": RIGHT["key"].split(".")[-1]}, "its sections with dots", id="short"),
        pytest.param(
            {"right": abs(RIGHT["right"] - RIGHT["wrong"])}, "not how far", id="difference"
        ),
        pytest.param({"right": RIGHT["right"] / 1e3}, "unit that the key names", id="unit"),
        pytest.param({"right": -RIGHT["right"]}, "its sign", id="sign"),
        pytest.param({"right": RIGHT["wrong"]}, "it is wrong", id="kept"),
        pytest.param(
            {"key": OTHER, "wrong": sheet()[OTHER], "right": sheet()[OTHER]},
            f"{OTHER} agrees with",
            id="another value",
        ),
        pytest.param({"right": RIGHT["right"] + 1.0}, "error: right = .* is not right", id="near"),
        pytest.param({"wrong": RIGHT["wrong"] * 10.0}, "error: wrong = ", id="misread"),
        pytest.param({"key": "line 3"}, "error: key = line 3 is not right", id="a line"),
        pytest.param({"key": RIGHT["key"] + "s"}, "error: key = ", id="no such key"),
        pytest.param({"right": "'all of it'"}, "right = 'all of it' is no number", id="a word"),
    ],
)
def test_other_answers_are_refused(changed: dict[str, Any], reason: str) -> None:
    """Each for its own reason."""
    mark = marked(7, handed_in(7, {"error": {**RIGHT, **changed}}))
    assert not mark.passed and re.search(reason, mark.reason), mark.reason


def test_the_solution_is_not_in_the_files() -> None:
    """What was drawn stays out of them."""
    assert draw(exercise(7), LEARNER)["error"]["key"] not in handed_in(7, {"error": {}})
