"""A learner in a test: fills in what an exercise gives, right or wrong."""

from __future__ import annotations

from functools import cache

from scara_config import Robot, load_robot
from scara_course.exercise import Exercise
from scara_course.exercises_io import draw, load_exercises
from scara_course.marking import ExerciseMark, Table

from harness.workspace import ROOT

LEARNER = "ada"


@cache
def robot() -> Robot:
    """Return the robot of the course."""
    return load_robot(ROOT / "config" / "robots" / "fanuc_sr6ia")


@cache
def exercise(number: int) -> Exercise:
    """Return an exercise."""
    return load_exercises(ROOT / "src" / "scara_course" / "exercises")[number - 1]


def filled(text: str, answers: Table) -> str:
    """Return a file of answers with each answer behind its colon."""
    head, _, _ = text.partition("answers:\n")
    lines = [
        f"  {row}: {{{', '.join(f'{k}: {v}' for k, v in values.items())}}}"
        for row, values in answers.items()
    ]
    return head + "answers:\n" + "\n".join(lines) + "\n"


def handed_in(number: int, answers: Table, learner: str = LEARNER) -> str:
    """Return what a learner hands in."""
    each = exercise(number)
    return filled(each.answers_file(learner, draw(each, learner), robot()), answers)


def marked(number: int, text: str, learner: str = LEARNER) -> ExerciseMark:
    """ExerciseMark what a learner handed in."""
    each = exercise(number)
    return each.mark_answers(text, learner, draw(each, learner), robot())
