"""A class: which exercises each learner has passed, out of the history's files."""

from __future__ import annotations

from pathlib import Path

import msgspec

from farm.desk.reading_io import ask_for

CLASS = (
    "SELECT place AS cell, learner, exercise, arg_max(title, marked) AS title, "
    "bool_or(passed) AS passed, count(*) AS tries, max(marked) AS last FROM ("
    "SELECT DISTINCT ON (place, learner, exercise, signature) machine || '/' || cell AS place, "
    "body->>'learner' AS learner, body->>'exercise' AS exercise, body->>'title' AS title, "
    "TRY_CAST(body->>'passed' AS BOOLEAN) AS passed, TRY_CAST(body->>'marked' AS DOUBLE) "
    "AS marked, body->>'signature' AS signature FROM events WHERE kind = 'exercise' "
    "AND time >= make_timestamp(CAST(? AS BIGINT))) "
    "WHERE COLUMNS(*) IS NOT NULL GROUP BY place, learner, exercise "
    "ORDER BY learner, place, exercise"
)
"""What learners have done; each whole result counts once, however often a cell told it."""
SINCE_S = 30 * 86400.0
"""Our choice: so far back the page looks; a class lasts weeks."""


class MarkedExercise(msgspec.Struct, frozen=True):
    """How far a learner is with an exercise.

    Attributes:
        cell: MACHINE/CELL that told it.
        learner: Name.
        exercise: Name of its folder, which begins with e and its number.
        title: Its number and title.
        passed: Whether a result of it counts.
        tries: How often it was marked.
        last: When it was marked last [s since 1970].
    """

    cell: str
    learner: str
    exercise: str
    title: str
    passed: bool
    tries: int
    last: float


def class_of(folder: Path, begin: float) -> list[MarkedExercise]:
    """Return what was marked since ``begin`` [s since 1970], by learner, cell and exercise.

    Raises:
        AskingError: The history cannot be read.
    """
    return ask_for(folder, MarkedExercise, CLASS, [int(begin * 1e6)])
