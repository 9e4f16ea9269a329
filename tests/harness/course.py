"""A learner in a test: fills in what an exercise gives, right or wrong."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scara_config import Robot, load_robot
from scara_course.exercise import Exercise
from scara_course.exercises_io import draw, load_exercises
from scara_course.marking import ExerciseMark, Table

from harness.imitated_run import JOINTS, BagMaker
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


def material(number: int, learner: str = LEARNER) -> dict[str, str]:
    """Return the other files that a learner gets."""
    each = exercise(number)
    files: dict[str, str] = each.check.material(draw(each, learner), robot())
    return files


class Scene(NamedTuple):
    """What happens in a short recording.

    Attributes:
        real: From when to when the real side moves [s].
        twin: The same of the twin.
        decisions: When [s], mode before, trigger, mode after.
        end: Length [s].
    """

    real: tuple[tuple[float, float], ...]
    twin: tuple[tuple[float, float], ...]
    decisions: tuple[tuple[float, str, str, str], ...]
    end: float


def write_scene(
    scene: Scene, path: Path, more: Callable[[BagMaker], None] = lambda maker: None
) -> Path:
    """Write a recording: joint_1 turns by 20 degrees a second while a side moves.

    ``more`` adds what else is in it.
    """
    maker, times = BagMaker(), np.arange(0.0, scene.end, 0.02)
    for topic, spans in (("real/ground_truth", scene.real), ("twin/joint_states", scene.twin)):
        speed = np.zeros((len(times), len(JOINTS)))
        for start, end in spans:
            speed[(times >= start) & (times < end), 0] = np.radians(20.0)
        maker.joint_states(topic, JOINTS, times, np.cumsum(speed * 0.02, axis=0), speed)
    for number, (at, before, event, mode) in enumerate(scene.decisions):
        fields = (number, before, event, mode, "", [], event, np.nan, np.nan, 0.0, "")
        maker.add(
            at,
            "twin_controller/decisions",
            "scara_msgs/msg/Decision",
            maker.header(at),
            *fields,
        )
    more(maker)
    return maker.write(path)
