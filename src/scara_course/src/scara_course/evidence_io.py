"""What a learner hands in: a file of answers, steps made with them, or a recording."""

from __future__ import annotations

from pathlib import Path

import msgspec
from scara_config import Robot

from scara_course.exercise import Exercise
from scara_course.exercises_io import ANSWERS, digest_of, draw
from scara_course.marking import ExerciseMark


class Marked(msgspec.Struct, frozen=True):
    """A verdict, and what it is about.

    Attributes:
        verdict: The verdict.
        name: Of the file that was marked; empty: there was none.
        digest: SHA-256 of the file.
    """

    verdict: ExerciseMark
    name: str
    digest: str


def mark(
    exercise: Exercise, learner: str, robot: Robot, place: Path, runs: Path, bag: Path | None
) -> Marked:
    """ExerciseMark what a learner has handed in.

    Args:
        exercise: Which exercise.
        learner: Who.
        robot: Whose lengths and limits count.
        place: The learner's folder of this exercise.
        runs: Folder of the recordings.
        bag: The recording; None: the newest one in ``runs``.

    Raises:
        OSError: A file is there and cannot be read.
    """
    path = place / ANSWERS
    if not path.exists():
        reason = f"nothing was handed in: ./cell course start {exercise.task.number}"
        return Marked(ExerciseMark(False, reason), "", "")
    text = path.read_text(encoding="utf-8", errors="replace")
    verdict = exercise.mark_answers(text, learner, draw(exercise, learner), robot)
    return Marked(verdict, path.name, digest_of([path]))
