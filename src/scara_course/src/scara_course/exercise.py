"""An exercise: its task, its card, and how what a learner hands in is marked.

Each folder of ``exercises`` holds ``task.yaml`` (:class:`ExerciseTask`), ``card.md`` for the
learner, and ``check.py``, which is pure. What check.py has follows from the task's ``evidence``:

- ``answers``: ``draw(generator)`` gives the learner's numbers, ``solve(given, robot)`` the right
  answers, ``mistakes(given, robot)`` what comes of usual mistakes, by their names in words.
- ``steps``: ``draw(generator)`` and ``solve(given, robot)`` too; the answers are one row, gains:
  p, i, d, i_clamp. With them ``JOINT`` makes a step of ``SIZE`` [deg, mm] and one back, each
  recorded for ``SECONDS``; ``mark(answers, figures, robot)`` judges what was measured.
- ``bag``: ``mark(recorded, robot)`` judges a recording.

``material(given, robot)`` makes further files, name to text; where check.py has it, the file of
the answers does not show the numbers.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any, Literal

from msgspec import Meta
from scara_config import Robot
from scara_config.loader import Section
from scara_config.quantities import ShortText

from scara_course.marking import (
    AnswerError,
    ExerciseMark,
    Table,
    answers_text,
    mark_table,
    read_answers,
)

Evidence = Literal["answers", "steps", "bag"]


class ExerciseTask(Section, frozen=True):
    """task.yaml of an exercise.

    Attributes:
        number: Its place in the course.
        title: In a few words.
        evidence: What is marked: the file of answers, steps made with them, or the newest bag.
        minutes: What it takes a newcomer, roughly.
    """

    number: Annotated[int, Meta(ge=1, le=99)]
    title: ShortText
    evidence: Evidence
    minutes: Annotated[int, Meta(ge=1, le=240)]


@dataclass(frozen=True)
class Exercise:
    """One folder of exercises.

    Attributes:
        name: Of the folder.
        task: Its task.yaml.
        card: Its card.md.
        check: Its check.py as a module.
    """

    name: str
    task: ExerciseTask
    card: str
    check: Any

    @property
    def title(self) -> str:
        """Number and title."""
        return f"{self.task.number}. {self.task.title}"

    @property
    def command(self) -> str:
        """What marks it."""
        return f"./cell course check {self.task.number}"

    def shown(self, given: Table) -> Table:
        """Return the numbers that stand in the file of answers."""
        return {} if hasattr(self.check, "material") else given

    def answers_file(self, learner: str, given: Table, robot: Robot) -> str:
        """Return the file that the learner fills in."""
        # Only its rows and names come into the file.
        blank = self.check.solve(given, robot)
        return answers_text(self.title, learner, self.shown(given), blank, self.command)

    def answers(self, text: str, learner: str, given: Table, robot: Robot) -> Table:
        """Return what the learner filled in.

        Raises:
            AnswerError: It cannot be marked.
        """
        return read_answers(text, learner, self.shown(given), self.check.solve(given, robot))

    def mark_answers(self, text: str, learner: str, given: Table, robot: Robot) -> ExerciseMark:
        """Mark a file of answers; one that cannot be read has not passed."""
        try:
            answers = self.answers(text, learner, given, robot)
        except AnswerError as error:
            return ExerciseMark(False, str(error))
        return mark_table(
            answers, self.check.solve(given, robot), self.check.mistakes(given, robot)
        )
