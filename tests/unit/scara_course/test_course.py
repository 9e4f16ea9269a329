"""The course from start to export: what is laid out, marked, kept and signed."""

from __future__ import annotations

import csv
import hashlib
import inspect
import json
import re
import time
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest
from harness.course import LEARNER, exercise, filled, handed_in, marked, robot
from operator_panel.page.work.course_io import read_course
from scara_config.profile import CHOICE
from scara_course.course_node import app
from scara_course.exercises_io import draw, load_exercises
from scara_course.marking import ExerciseMark, mark_table
from scara_course.results import is_genuine
from scara_course.results_io import add_result, course_key, read_results
from typer.testing import CliRunner, Result

from scara_course import course_node, evidence_io, results_io
from scara_course import exercise as exercise_module

RIGHT = {n: exercise(n).check.solve(draw(exercise(n), LEARNER), robot()) for n in (1, 2, 3)}


@pytest.fixture(autouse=True)
def own_place(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    """Give the test a key and a robot's name of its own."""
    monkeypatch.setenv(CHOICE, "fanuc_sr6ia")
    monkeypatch.setenv("ROS_HOME", str(tmp_path / "ros"))
    yield


def course(tmp_path: Path, *words: str, learner: str = LEARNER) -> Result:
    """Run ./cell course."""
    own = [] if words[0] == "export" else ["--learner", learner]
    return CliRunner().invoke(app, [*words, *own, "--runs", str(tmp_path)])


def hand_in(tmp_path: Path, number: int, answers: dict[str, dict[str, object]]) -> Path:
    """Start an exercise and fill in its answers."""
    assert course(tmp_path, "start", str(number)).exit_code == 0
    path = tmp_path / "course" / LEARNER / exercise(number).name / "answers.yaml"
    path.write_text(filled(path.read_text(), answers))  # type: ignore[arg-type]
    return path


def test_a_learner_goes_from_card_to_passed(tmp_path: Path) -> None:
    """Start shows the card, check without a number takes the last one, list knows it afterwards."""
    shown = course(tmp_path, "start", "1")
    assert "Forward kinematics" in shown.output and "./cell course check 1" in shown.output
    empty = course(tmp_path, "check")
    assert empty.exit_code == 1 and "x_mm is empty" in empty.output
    hand_in(tmp_path, 1, RIGHT[1])
    passed = course(tmp_path, "check")
    assert passed.exit_code == 0 and "all 9 answers are right" in passed.output
    assert passed.output.endswith("1 of 12 passed. Next: ./cell course start 2\n")
    listed = course(tmp_path, "list").output
    assert f"1 of {len(load_exercises())} passed" in listed
    assert "0 of" in course(tmp_path, "list", learner="bob").output


def test_page_shows_what_was_started_last(tmp_path: Path) -> None:
    """By the course's own files; none while nobody touches it, and none of files that are torn."""
    now = time.time()
    assert read_course(tmp_path, now) is None
    hand_in(tmp_path, 1, RIGHT[1])
    shown = read_course(tmp_path, now)
    assert shown is not None and shown.line.endswith("not marked yet, 0 of 12 passed")
    assert shown.facts == ("ada: 0 of 12 passed", "9 of 9 answers are written")
    course(tmp_path, "check")
    course(tmp_path, "start", "2")
    shown = read_course(tmp_path, now)
    assert shown is not None and "2. Inverse" in shown.line and "1 of 12 passed" in shown.line
    assert len(shown.hints) == 1 and "## What counts" in shown.task
    assert read_course(tmp_path, now + 13 * 3600.0) is None
    (tmp_path / "course" / "results.jsonl").write_text("half a li")
    assert read_course(tmp_path, now) is None


def test_answers_outlive_another_start(tmp_path: Path) -> None:
    """Who looks at the card again loses nothing; --anew begins again."""
    path = hand_in(tmp_path, 1, RIGHT[1])
    before = path.read_text()
    course(tmp_path, "start", "1")
    assert path.read_text() == before
    course(tmp_path, "start", "1", "--anew")
    assert path.read_text() != before


def test_all_marks_what_was_started(tmp_path: Path) -> None:
    """One line for each, and how many have passed."""
    assert course(tmp_path, "all").exit_code == 2
    hand_in(tmp_path, 1, RIGHT[1])
    hand_in(tmp_path, 2, RIGHT[2])
    course(tmp_path, "start", "3")
    done = course(tmp_path, "all")
    assert done.exit_code == 1
    assert done.output.count("PASSED") == 2 and "3. The Jacobian" in done.output
    assert f"2 of {len(load_exercises())} passed" in done.output


def test_all_leaves_what_has_passed_by_a_recording_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The newest recording is that of another exercise."""
    both = [exercise(6), exercise(9)]
    monkeypatch.setattr(course_node, "load_exercises", lambda: both)
    monkeypatch.setattr(
        evidence_io, "mark_bag", lambda each, bag, _: ExerciseMark(bag.parent.name == each.name, "")
    )
    for number, each in enumerate(both, 1):
        bag = tmp_path / each.name / "run.bag"
        bag.parent.mkdir()
        bag.touch()
        course(tmp_path, "start", str(number))
        assert course(tmp_path, "check", str(number), "--bag", str(bag)).exit_code == 0
    done = course(tmp_path, "all")
    assert done.exit_code == 0 and "2 of 2 passed" in done.output, done.output
    assert [each.passed for each in read_results(tmp_path / "course")] == [True, True]


@pytest.mark.parametrize(
    ("words", "learner", "text"),
    [
        (("start", "99"), "ada", "exercise 99: there are 1 to"),
        (("check",), "ada", "no exercise was started"),
        (("start", "1"), "../ada", "letters, digits"),
        (("start", "1"), "-", "letters, digits"),
    ],
)
def test_wrong_words_are_named(
    tmp_path: Path, words: tuple[str, ...], learner: str, text: str
) -> None:
    """Exit code 2, and what is allowed."""
    done = course(tmp_path, *words, learner=learner)
    assert done.exit_code == 2 and text in done.output


def test_damaged_note_of_what_was_started_is_as_none(tmp_path: Path) -> None:
    """The way on is the same."""
    course(tmp_path, "start", "1")
    (started,) = (tmp_path / "course").glob(f"*/{course_node.STARTED}")
    started.write_bytes(b'"\xff"')
    done = course(tmp_path, "check")
    assert done.exit_code == 2 and "no exercise was started" in done.output


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('learner: "ada"', "learner: bob", "of 'bob', not of 'ada'"),
        ("joint_1_deg: ", "joint_1_deg: 1", "not yours"),
        ("answers:", "nothing:", "no section `answers`"),
        ("answers:", "answers: [", "cannot be read"),
        ("x_mm: ", "y_mm: ", "cannot be read"),
        ("  a: {x_mm: ", "  a: {xx_mm: ", "a: x_mm is empty"),
        ("z_mm: ", "z_mm: .inf, u: ", "z_mm = inf is no number"),
        ("z_mm: ", "z_mm: .nan, u: ", "z_mm = nan is no number"),
        ("z_mm: ", "z_mm: true, u: ", "z_mm = True is no number"),
        ("z_mm: ", "z_mm: [], u: ", "is no number"),
        ("z_mm: ", "z_mm: '12', u: ", "z_mm = '12' is no number"),
    ],
)
def test_a_file_that_cannot_be_marked_says_what_to_write(old: str, new: str, reason: str) -> None:
    """Whatever a person does to the file, the verdict is a sentence."""
    text = handed_in(1, RIGHT[1])
    assert marked(1, text).passed
    verdict = marked(1, text.replace(old, new, 1))
    assert not verdict.passed and reason in verdict.reason, verdict.reason


def test_two_learners_get_different_numbers_and_each_the_same_again() -> None:
    """What a neighbour wrote does not help; another machine draws the same."""
    for number in (1, 2, 3):
        drawn = [json.dumps(draw(exercise(number), f"learner_{k}")) for k in range(40)]
        assert len(set(drawn)) == 40
    assert draw(exercise(1), "ada")["a"] == {
        "joint_1_deg": 106,
        "joint_2_deg": 113,
        "joint_3_mm": -98,
    }


def test_results_carry_the_hash_and_a_signature(tmp_path: Path) -> None:
    """A line that was changed afterwards shows, and is not exported."""
    path = hand_in(tmp_path, 1, RIGHT[1])
    course(tmp_path, "check", "1")
    hand_in(tmp_path, 2, {**RIGHT[2], "a_lefty": RIGHT[2]["a_righty"]})
    course(tmp_path, "check", "2")
    first, second = read_results(tmp_path / "course")
    assert (first.number, first.passed, second.number, second.passed) == (1, True, 2, False)
    assert first.digest == hashlib.sha256(path.read_bytes()).hexdigest()
    key = course_key()
    assert is_genuine(first, key) and not is_genuine(first, "another key of some length")
    file = tmp_path / "course" / results_io.FILE
    file.write_text(file.read_text().replace('"passed":false', '"passed":true'))
    done = course(tmp_path, "export")
    assert done.exit_code == 1 and "result 2: its signature does not fit" in done.output
    torn = msgspec.structs.replace(second, signature="\N{MICRO SIGN}" + second.signature[1:])
    assert not is_genuine(torn, key), "a text that is no ASCII"
    rows = list(csv.DictReader((tmp_path / "course" / "results.csv").open()))
    assert [(row["learner"], row["exercise"]) for row in rows] == [(LEARNER, exercise(1).name)]


def test_statements_are_those_of_xapi(tmp_path: Path) -> None:
    """Actor, verb, object, result as ADL's 1.0.3 has them; the same again is the same statement."""
    hand_in(tmp_path, 1, RIGHT[1])
    course(tmp_path, "check", "1")
    assert course(tmp_path, "export").exit_code == 0
    file = tmp_path / "course" / "results_xapi.json"
    (made,) = json.loads(file.read_text())
    assert made["verb"]["id"] == "http://adlnet.gov/expapi/verbs/passed"
    assert made["result"]["success"] is True and made["result"]["completion"] is True
    assert made["actor"]["account"]["name"] == LEARNER
    assert set(made["actor"]) == {"objectType", "name", "account"}  # exactly one identifier
    assert made["object"]["id"].endswith("/course/e01_forward_kinematics")
    assert re.fullmatch(r"[0-9a-f]{8}-[0-9a-f]{4}-5[0-9a-f]{3}-[89ab][0-9a-f]{3}-.{12}", made["id"])
    assert re.match(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d+)?\+00:00", made["timestamp"])
    for extension in made["result"]["extensions"]:
        assert extension.startswith("https://")
    before = file.read_bytes()
    course(tmp_path, "export")
    assert file.read_bytes() == before


def test_a_result_is_added_whole_or_not_at_all(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """When the disk is full, the file is as it was."""
    hand_in(tmp_path, 1, RIGHT[1])
    course(tmp_path, "check", "1")
    (held,) = read_results(tmp_path / "course")

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr("os.fsync", full)
        with pytest.raises(OSError, match="No space left"):
            add_result(tmp_path / "course", held, course_key())
    assert read_results(tmp_path / "course") == [held]
    assert add_result(tmp_path / "course", held, course_key()).number == 2
    (tmp_path / "course" / results_io.FILE).write_text("{}\n")
    with pytest.raises(results_io.ResultsError, match=r"line 1: is no result"):
        read_results(tmp_path / "course")


def test_each_folder_is_a_whole_exercise() -> None:
    """Card, task and check; the card has its title, and says what counts."""
    for each in load_exercises():
        assert each.card.startswith(f"# {each.title}\n"), each.name
        assert "\n## Task\n" in each.card and "\n## What counts\n" in each.card, each.name
        assert "\n## Hints\n" in each.card, each.name
        assert each.name.startswith(f"e{each.task.number:02d}_")


def test_each_check_has_what_the_module_says() -> None:
    """Whoever writes an exercise by that text has it called with what it takes."""
    text = str(exercise_module.__doc__)
    for each in load_exercises():
        _, _, behind = text.partition(f"- ``{each.task.evidence}``:")
        told = re.findall(r"``(\w+)(?:\((.*?)\))?``", re.split(r"\n- |\n\n", behind)[0])
        assert told, each.name
        for name, words in told:
            held = getattr(each.check, name)
            assert not words or ", ".join(inspect.signature(held).parameters) == words, each.name


def test_mistake_that_is_named_explains_the_first_wrong_row() -> None:
    """Of those that do, the one that fits the whole file best; a number may be off by its unit."""
    wanted = {"a": {"x_mm": 1.0, "n": 2.0}, "b": {"x_mm": 3.0, "n": 4.0}}
    near = {"a": {"x_mm": 1.1, "n": 2.0}, "b": {"x_mm": 2.9, "n": 4.0}}
    assert mark_table(near, wanted, {}).passed
    off = {"a": {"x_mm": 1.0, "n": 2.0}, "b": {"x_mm": 3.2, "n": 4.0}}
    assert mark_table(off, wanted, {}).reason.startswith("b: x_mm = 3.2 is not within 0.1 of")
    given = {"a": {"x_mm": -1.0, "n": 2.0}, "b": {"x_mm": -3.0, "n": 4.0}}
    mistakes = {"another row": {**given, "a": near["a"]}, "one row": {**given, "b": off["b"]}}
    mistakes["the sign"] = given
    assert ": the sign (2 wrong in all)" in mark_table(given, wanted, mistakes).reason
    mistakes.pop("the sign")
    assert ": one row (2 wrong in all)" in mark_table(given, wanted, mistakes).reason
