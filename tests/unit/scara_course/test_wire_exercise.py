"""Exercise 8: the words decoded as the card tells find each fault; other answers are refused."""

from __future__ import annotations

import csv
import math
import re
import struct
from itertools import pairwise
from typing import Any

import pytest
from harness.course import LEARNER, exercise, handed_in, marked, material, robot
from scara_control.joint_motion import JointMotion
from twin_controller.plausible import Plausibility, Reading, Verdict, judge

Answers = dict[str, dict[str, Any]]
LEARNERS = [f"learner_{k}" for k in range(60)]


def by_card(learner: str = LEARNER) -> Answers:
    """Follow the card."""
    files = material(8, learner)
    rows = list(csv.DictReader(files["wire.csv"].splitlines()))
    wanted = re.search(r"\d+", files["decode.txt"])
    assert wanted is not None
    (row,) = (row for row in rows if row["time_ms"] == wanted[0])
    answers: Answers = {"decoded": {"clock": int(row["clock_high"] + row["clock_low"], 16)}}
    answers["decoded"]["joint_1_deg"] = round(joint_1(row), 3)
    kind, at = seen(rows)
    return {**answers, "fault": {"kind": kind, "since_ms": at}}


def joint_1(row: dict[str, str]) -> float:
    """Decode the position."""
    found: float = struct.unpack(">f", bytes.fromhex(row["joint_1_high"] + row["joint_1_low"]))[0]
    return found


def seen(rows: list[dict[str, str]]) -> tuple[str, int]:
    """Look down the columns, as the card's table tells."""
    for before, row in pairwise(rows):
        at, position = int(row["time_ms"]), joint_1(row)
        if at - int(before["time_ms"]) > 100:
            return "silent", at
        if row["position_valid"] == "0":
            return "invalid", at
        if row["heartbeat_echo"] == before["heartbeat_echo"]:
            return "heartbeat", at
        if row["clock_low"] == before["clock_low"]:
            return "standing", at
        if not abs(position) < 1e3 or 0.0 < abs(position) < 1e-3:
            return "swapped", at
        if abs(position - joint_1(before)) > 440.0 * 0.02:
            return "impossible", at
    raise AssertionError("no fault")


@pytest.mark.parametrize("learner", LEARNERS)
def test_the_cards_way_finds_the_fault(learner: str) -> None:
    """The table alone is enough."""
    mark = marked(8, handed_in(8, by_card(learner), learner), learner)
    assert mark.passed, mark.reason


def test_learners_get_each_of_the_faults() -> None:
    """All six, among sixty learners, and the card names them."""
    kinds = {by_card(learner)["fault"]["kind"] for learner in LEARNERS}
    assert kinds == set(exercise(8).check.KINDS)
    assert kinds == set(re.findall(r"^\| (\w+) \|", exercise(8).card, re.M)) - {"kind"}


def test_what_the_card_says_of_one_impossible_reading_is_so() -> None:
    """A real pair refuses it alone and goes on."""
    learner = next(each for each in LEARNERS if by_card(each)["fault"]["kind"] == "impossible")
    state, verdicts = Plausibility(), []
    for row in csv.DictReader(material(8, learner)["wire.csv"].splitlines()):
        clock = 1e-3 * int(row["clock_high"] + row["clock_low"], 16)
        motion = JointMotion((math.radians(joint_1(row)),), (), (), clock)
        reading = Reading(motion, 1e-3 * int(row["time_ms"]))
        state, verdict = judge(state, reading, [robot().joint("joint_1")])
        verdicts.append(verdict)
    assert verdicts.count(Verdict.REFUSED) == 1 and Verdict.JUMPED not in verdicts
    assert "one `impossible` reading is refused and stops nothing" in exercise(8).card


RIGHT = by_card()
ROWS = list(csv.DictReader(material(8)["wire.csv"].splitlines()))
CLOCK, JOINT = RIGHT["decoded"]["clock"], RIGHT["decoded"]["joint_1_deg"]
SINCE, KIND = RIGHT["fault"]["since_ms"], RIGHT["fault"]["kind"]
NUMBER = next(k for k, row in enumerate(ROWS) if int(row["time_ms"]) == SINCE)
OTHER = next(kind for kind in exercise(8).check.KINDS if kind != KIND)
HALF, FLOAT = struct.pack(">I", CLOCK), struct.pack(">f", JOINT)
TURNED = struct.unpack(">f", FLOAT[2:] + FLOAT[:2])[0]


@pytest.mark.parametrize(
    ("part", "changed", "reason"),
    [
        pytest.param(
            "decoded",
            {"clock": int.from_bytes(HALF[2:] + HALF[:2], "big")},
            "low word comes first",
            id="words swapped",
        ),
        pytest.param("decoded", {"clock": CLOCK % 65536}, "high times 65536", id="one word"),
        pytest.param(
            "decoded",
            {"joint_1_deg": int.from_bytes(struct.pack(">f", -JOINT), "big") + 1e12},
            "decoded: joint_1_deg",
            id="no float",
        ),
        pytest.param("decoded", {"joint_1_deg": JOINT + 1.0}, "joint_1_deg", id="another row"),
        pytest.param("decoded", {"joint_1_deg": "nan"}, "is no number|joint_1_deg", id="nan"),
        pytest.param("fault", {"since_ms": SINCE - 20}, "the next row is the first", id="early"),
        pytest.param("fault", {"since_ms": SINCE + 20}, "an earlier row", id="late"),
        pytest.param("fault", {"since_ms": NUMBER}, "not the number of its row", id="row"),
        pytest.param("fault", {"kind": OTHER}, "it is not so that", id="another fault"),
        pytest.param("fault", {"kind": "broken"}, "fault: kind = broken", id="no such word"),
        pytest.param("fault", {"since_ms": 0}, "fault: since_ms = 0", id="from the start"),
    ],
)
def test_other_answers_are_refused(part: str, changed: dict[str, Any], reason: str) -> None:
    """Each for its own reason."""
    answers = {**RIGHT, part: {**RIGHT[part], **changed}}
    mark = marked(8, handed_in(8, answers))
    assert not mark.passed and re.search(reason, mark.reason), mark.reason


def test_the_examples_on_the_card_are_right() -> None:
    """Whoever types them gets what stands there."""
    assert int("0001e240", 16) == 123456
    assert struct.unpack(">f", bytes.fromhex("41c80000"))[0] == 25.0
    assert "int('0001e240', 16)" in exercise(8).card and "fromhex('41c80000')" in exercise(8).card
