"""How near an answer must be, how it is asked for, and what a wrong one is told."""

from __future__ import annotations

import pytest
from scara_course.marking import (
    AnswerError,
    ExerciseMark,
    Table,
    answers_text,
    mark_table,
    read_answers,
)

GIVEN: Table = {"a": {"q1_deg": -12.5, "arm": "righty"}}
WANTED: Table = {"a": {"x_mm": 1.0, "side": "left"}, "b": {"stops": 3.0}}


@pytest.mark.parametrize(
    ("name", "most"),
    [
        ("q1_deg", 0.05),
        ("x_mm", 0.1),
        ("v_mm_s", 1.0),
        ("dx_dq1_m", 0.001),
        ("area_m2", 0.001),
        ("length_s", 0.02),
        ("late_ms", 1.0),
        ("stops", 0.0),
    ],
)
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_number_is_right_up_to_what_the_cards_allow(name: str, most: float, sign: float) -> None:
    """To both sides, by its unit; just as much is enough, and what is counted has to be exact."""
    for share, passed in ((0.0, True), (1.0, True), (1.01, most == 0.0)):
        answers: Table = {"a": {name: 7.0 + sign * share * most}}
        assert mark_table(answers, {"a": {name: 7.0}}, {}).passed is passed
    assert not mark_table(
        {"a": {name: 7.0 + sign * (1.01 * most + 1e-6)}}, {"a": {name: 7.0}}, {}
    ).passed
    words = f"not within {most:g} of the right value" if most else "not right"
    assert words in mark_table({"a": {name: 9.5}}, {"a": {name: 7.0}}, {}).reason


def test_an_angle_may_be_told_a_whole_turn_further() -> None:
    """A length may not."""
    assert mark_table({"a": {"q_deg": 370.0}}, {"a": {"q_deg": 10.0}}, {}).passed
    assert mark_table({"a": {"q_deg": -180.0}}, {"a": {"q_deg": 180.0}}, {}).passed
    assert not mark_table({"a": {"x_mm": 370.0}}, {"a": {"x_mm": 10.0}}, {}).passed


@pytest.mark.parametrize(
    ("given", "right", "passed"),
    [
        (" Left ", "left", True),
        ("right", "left", False),
        ("3", 3.0, False),
        (float("nan"), 3.0, False),
        (None, 3.0, False),
    ],
)
def test_words_are_compared_without_case_and_nothing_is_no_number(
    given: float | str | None, right: float | str, passed: bool
) -> None:
    """An answer that is missing is wrong, and no fault of the marking."""
    answers: Table = {} if given is None else {"a": {"stops": given}}
    mark = mark_table(answers, {"a": {"stops": right}}, {})
    assert mark.passed is passed
    assert passed or mark.reason.startswith(f"a: stops = {given} is not right")
    behind = mark_table({"a": {"stops": "left", "x": 1.0}}, {"a": {"stops": right, "x": 2.0}}, {})
    assert not behind.passed, "what stands behind a word counts too"


def test_the_mistake_that_is_named_explains_the_first_wrong_row() -> None:
    """Of those that do, the one that explains most; how many are wrong is told."""
    wanted: Table = {"a": {"x": 1.0, "y": 2.0}, "b": {"x": 3.0}, "c": {"z": 4.0}}
    answers: Table = {"a": {"x": 1.0, "y": 2.0}, "b": {"x": -3.0}, "c": {"z": -4.0}}
    mistakes: dict[str, Table] = {
        "row c alone": {"b": {"x": 9.0}, "c": {"z": -4.0}},
        "row b alone": {"b": {"x": -3.0}, "c": {"z": 4.0}},
        "the sign": {"b": {"x": -3.0}, "c": {"z": -4.0}},
        "the sign too": {"b": {"x": -3.0}, "c": {"z": -4.0}},
    }
    reason = "b: x = -3 is not right: the sign (2 wrong in all)"
    assert mark_table(answers, wanted, mistakes) == ExerciseMark(False, reason)
    reason = "b: x = -3 is not right (2 wrong in all)"
    only = {"row c alone": mistakes["row c alone"]}
    assert mark_table(answers, wanted, only) == ExerciseMark(False, reason)
    assert mark_table(wanted, wanted, mistakes) == ExerciseMark(True, "all 4 answers are right")


def test_the_file_of_answers_is_read_back_as_it_is_filled_in() -> None:
    """It shows what is given and leaves out what is asked for."""
    text = answers_text("1. Forwards", "ada", GIVEN, WANTED, "./cell course check 1")
    assert text == (
        "# 1. Forwards\n"
        "# Write each answer after its colon and a space, as in NAME: -12.34\n"
        "# Save this file; then, in the folder of your clone: ./cell course check 1\n"
        'learner: "ada"\n'
        'given:\n  a:\n    q1_deg: -12.5\n    arm: "righty"\n'
        "answers:\n  a:\n    x_mm:\n    side:\n  b:\n    stops:\n"
    )
    assert "given" not in answers_text("1. Forwards", "ada", {}, WANTED, "check")
    with pytest.raises(AnswerError, match="a: x_mm is empty"):
        read_answers(text, "ada", GIVEN, WANTED)
    full = text.replace("x_mm:", "x_mm: 2").replace("side:", "side: 5").replace("ops:", "ops: 3")
    assert read_answers(full, "ada", GIVEN, WANTED) == {
        "a": {"x_mm": 2.0, "side": "5"},
        "b": {"stops": 3.0},
    }


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("x_mm: 2", "x_mm:2", "a space stands behind each colon"),
        ("answers:", "result:", "the file has no section `answers`"),
        ('"ada"', '"bob"', "the file is of 'bob', not of 'ada'"),
        ("-12.5", "-12.6", "the numbers under `given` are not yours"),
        ("x_mm: 2", "x_mm: true", "a: x_mm = True is no number"),
        ("x_mm: 2", "x_mm: two", "a: x_mm = 'two' is no number"),
        ("x_mm: 2", "x_mm: .inf", "a: x_mm = inf is no number"),
        ("side: 5", 'side: ""', "a: side is empty"),
        ("  b:\n    stops: 3", "  b: 3", "b: stops is empty"),
        ("  b:\n    stops: 3\n", "", "b: stops is empty"),
    ],
)
def test_a_file_that_cannot_be_marked_is_told_why(old: str, new: str, said: str) -> None:
    """And what to write where."""
    text = answers_text("1. Forwards", "ada", GIVEN, WANTED, "check")
    full = text.replace("x_mm:", "x_mm: 2").replace("side:", "side: 5").replace("ops:", "ops: 3")
    with pytest.raises(AnswerError, match=said):
        read_answers(full.replace(old, new), "ada", GIVEN, WANTED)


def test_a_file_that_shows_no_numbers_may_hold_any() -> None:
    """Where the numbers of the task stand in other files."""
    text = 'learner: "ada"\ngiven: {}\nanswers: {a: {x_mm: 1, side: left}, b: {stops: 2}}\n'
    assert read_answers(text, "ada", {}, WANTED)["b"] == {"stops": 2.0}
