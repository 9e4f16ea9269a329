"""Results of the course come into the journal: each, at least once, and told in words."""

from __future__ import annotations

from pathlib import Path

import pytest
from cell_recorder.journal.course_results_io import RESULTS, CourseResults
from cell_recorder.journal.entries import CourseResult, ExerciseMarked, decode, encode
from cell_recorder.journal.story import tell
from scara_course.results_io import add_result


def add(runs: Path, learner: str, passed: bool = True) -> CourseResult:
    """Let the course write a result."""
    result = CourseResult(
        number=0,
        time=1.5,
        learner=learner,
        exercise="e01_forward_kinematics",
        title="1. Forward kinematics by hand",
        passed=passed,
        reason="all 9 answers are right" if passed else "a: x_mm is empty",
        evidence="answers.yaml",
        digest="d",
    )
    return add_result((runs / RESULTS).parent, result, "a key of sixteen signs")


def test_each_new_result_is_given_once(tmp_path: Path) -> None:
    """Before the first one there is no file; what was given does not come again."""
    course = CourseResults(tmp_path, "cell")
    assert course.look(True) == []
    first = add(tmp_path, "ada")
    (entry,) = course.look(True)
    assert (entry.learner, entry.passed, entry.signature) == ("ada", True, first.signature)
    assert course.look(True) == []
    add(tmp_path, "bob")
    add(tmp_path, "cy")
    assert [each.learner for each in course.look(True)] == ["bob", "cy"]


@pytest.mark.parametrize(("written", "again"), [(True, []), (False, ["ada"])])
def test_a_cell_that_was_killed_loses_none(written: bool, again: list[str], tmp_path: Path) -> None:
    """Only what is on the disk is not told again."""
    add(tmp_path, "ada")
    course = CourseResults(tmp_path, "milk/2")
    assert len(course.look(False)) == 1
    course.look(written)
    assert [each.learner for each in CourseResults(tmp_path, "milk/2").look(True)] == again
    assert [each.learner for each in CourseResults(tmp_path, "other").look(True)] == ["ada"]


def test_a_file_that_was_begun_anew_is_told_from_its_start(tmp_path: Path) -> None:
    """As after runs/course was cleared for the next class."""
    course = CourseResults(tmp_path, "cell")
    add(tmp_path, "ada")
    add(tmp_path, "ada")
    assert len(course.look(True)) == 2
    (tmp_path / RESULTS).unlink()
    add(tmp_path, "bob")
    assert [each.learner for each in course.look(True)] == ["bob"]


def test_a_file_that_cannot_be_read_stops_no_journal(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """It is said once, and again only after the file has changed."""
    add(tmp_path, "ada")
    (tmp_path / RESULTS).write_text("half a li")
    course = CourseResults(tmp_path, "cell")
    assert course.look(True) == course.look(True) == []
    assert caplog.text.count("results are not told") == 1


def test_a_result_is_told_in_words(tmp_path: Path) -> None:
    """By ./cell why, and it is no refusal."""
    add(tmp_path, "ada", passed=False)
    (entry,) = CourseResults(tmp_path, "cell").look(True)
    assert decode(encode(entry)) == entry and isinstance(entry, ExerciseMarked)
    (told,) = tell([entry])
    assert (told.what, told.words) == ("not yet", "ada: 1. Forward kinematics by hand")
    assert told.outcome == "a: x_mm is empty"
