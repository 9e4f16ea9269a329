"""What the page says of the exercise that is under way."""

from __future__ import annotations

import pytest
from cell_recorder.journal.entries import CourseResult, CourseStarted
from operator_panel.view.course import CourseCard, course_card, written

STARTED = CourseStarted("e02_x", "2. Both elbows", 12)
TEXT = """# 2. Both elbows
A point.

## Task
1. Write.

## Hints
- One hint,
  in two lines.
- Another - with a dash.
"""
HALF = "given: {a: {x_mm: 1}}\nanswers:\n  a:\n    q1_deg: 1.5\n    q2_deg:\n"


def result(exercise: str, passed: bool, learner: str = "ada") -> CourseResult:
    """Return a verdict."""
    told = {"number": 1, "time": 1.0, "title": "t", "evidence": "answers.yaml", "digest": "d"}
    return CourseResult(
        learner=learner, exercise=exercise, passed=passed, reason=f"so {passed}", **told
    )


def card(*results: CourseResult, answers: str = HALF) -> CourseCard:
    """Return what ada sees."""
    return course_card("ada", STARTED, TEXT, answers, results)


def test_text_is_parted_into_task_and_hints() -> None:
    """The title stands in the line already; a hint is whole, however many lines it has."""
    shown = card()
    assert shown.task == "A point.\n\n## Task\n1. Write."
    assert shown.hints == ("One hint,\n  in two lines.", "Another - with a dash.")
    assert course_card("ada", STARTED, "# 2\nA task.", "", ()).hints == ()


@pytest.mark.parametrize(
    ("results", "line", "tone", "last"),
    [
        ([], "not marked yet, 0 of 12 passed", "", "1 of 2 answers are written"),
        ([("e02_x", True, "bob")], "not marked yet, 0 of 12", "", "1 of 2 answers are written"),
        ([("e01_x", True), ("e02_x", False)], "not yet, 1 of 12", "warn", "Not yet: so False"),
        ([("e02_x", False)] * 2, "not yet, 0", "warn", "Not yet after 2 checks: so False"),
        ([("e02_x", True), ("e02_x", True)], "passed, 1", "good", "Passed after 2 checks: so True"),
        ([("e02_x", True), ("e02_x", False)], "passed, 1", "good", "Not yet after 2 checks"),
    ],
)
def test_verdict_and_progress_are_the_learners_own(
    results: list[tuple[str, bool]], line: str, tone: str, last: str
) -> None:
    """What was passed once stays passed, as in ./cell course list; the last reason is told."""
    shown = card(*(result(*each) for each in results))
    assert shown.line.startswith(f"Exercise 2. Both elbows: {line}") and shown.tone == tone
    assert shown.facts[0].startswith("ada: ") and shown.facts[-1].startswith(last)


@pytest.mark.parametrize(
    ("answers", "told"),
    [
        ("", []),
        ("answers: 5", []),
        ("answers: [1, 2]", []),
        ("answers: {a: 1, b: {x: 0, y: , z: ''}}", ["1 of 3 answers are written"]),
        ("answers: {a: [", ["answers.yaml cannot be read: "]),
    ],
)
def test_answers_are_counted_whatever_a_person_writes(answers: str, told: list[str]) -> None:
    """A zero is an answer; a file that is just being changed says what is wrong."""
    found = written(answers)
    assert len(found) == len(told)
    assert all(line.startswith(start) for line, start in zip(found, told))
