"""What a learner hands in: a file of answers, steps made with them, or a recording."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TypeVar

import msgspec
from cell_recorder.reading.bag_reader_io import Bag, BagError, open_bag
from cell_recorder.recording.recording import BAG_NAME
from cell_recorder.recording.runs_folder_io import parts_of
from scara_config import ConfigError, Robot
from scara_control.pid import PidGains
from twin_analysis.step.response import measure
from twin_analysis.step.trial import plan_trial
from twin_experiments.metrics.series import MetricsError
from twin_experiments.parts_reader_io import read_work
from twin_experiments.report.record import RecordError
from twin_experiments.report.run_reader_io import DECISIONS, STATE, read_run

from scara_course.exercise import Exercise
from scara_course.exercises_io import ANSWERS, digest_of, draw
from scara_course.marking import AnswerError, ExerciseMark, Table
from scara_course.recorded import CourseRecording, ModeDecision

T = TypeVar("T")


class Marked(msgspec.Struct, frozen=True):
    """A verdict, and what it is about.

    Attributes:
        verdict: The verdict.
        name: Of the file that was marked; empty: there was none.
        digest: SHA-256 of the file, of a recording over all its parts.
    """

    verdict: ExerciseMark
    name: str
    digest: str


def mark(
    exercise: Exercise, learner: str, robot: Robot, place: Path, runs: Path, bag: Path | None
) -> Marked:
    """Mark what a learner has handed in.

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
    if exercise.task.evidence == "bag":
        path = bag or newest_bag(runs)
        if path is None or not path.exists():
            return Marked(ExerciseMark(False, f"there is no recording in {runs}"), "", "")
        name = str(path.relative_to(runs) if path.is_relative_to(runs) else path.name)
        return Marked(mark_bag(exercise, path, robot), name, digest_of(parts_of(path)))
    path = place / ANSWERS
    if not path.exists():
        reason = f"nothing was handed in: ./cell course start {exercise.task.number}"
        return Marked(ExerciseMark(False, reason), "", "")
    text = path.read_text(encoding="utf-8", errors="replace")
    given = draw(exercise, learner)
    if exercise.task.evidence == "steps":
        verdict = mark_steps(exercise, text, learner, given, robot)
    else:
        verdict = exercise.mark_answers(text, learner, given, robot)
    return Marked(verdict, path.name, digest_of([path]))


def mark_steps(
    exercise: Exercise, text: str, learner: str, given: Table, robot: Robot
) -> ExerciseMark:
    """Mark gains by the steps that the simulator makes with them, in process."""
    # Physics is slow to load, and only this exercise needs it.
    from twin_analysis.step.offline_io import OfflineBench

    check = exercise.check
    try:
        answers = exercise.answers(text, learner, given, robot)
        gains = msgspec.convert(answers["gains"], PidGains)
    except AnswerError as error:
        return ExerciseMark(False, str(error))
    except msgspec.ValidationError as error:
        return ExerciseMark(False, f"gains: a gain is a number from 0 to 1e9: {error}")
    joint = robot.joint(check.JOINT)
    bench = OfflineBench(robot, None, plain=True, gains={joint.name: gains})
    trial = plan_trial(joint, "position", bench.position(joint.name), check.SIZE, check.SECONDS)
    figures = [measure(step, joint.effort) for step in bench.run(trial)]
    marked: ExerciseMark = check.mark(answers, figures, robot)
    return marked


def mark_bag(exercise: Exercise, path: Path, robot: Robot) -> ExerciseMark:
    """Mark a recording; one that does not hold what is needed has not passed."""
    try:
        with open_bag(path) as bag:
            recorded = read_recorded(bag, robot)
        # What a check asks for may be missing too: a motion that is recorded of one side only.
        marked: ExerciseMark = exercise.check.mark(recorded, robot)
    except (BagError, RecordError, ConfigError, MetricsError) as error:
        return ExerciseMark(False, f"the recording cannot be marked: {error}")
    return marked


def read_recorded(bag: Bag, robot: Robot) -> CourseRecording:
    """Read what exercises ask for.

    Raises:
        BagError: A needed topic has no messages, or a message cannot be read.
        RecordError: A joint or a velocity is missing.
        ConfigError: The recorded palletise.yaml is wrong.
    """
    run = read_run(bag, [joint.name for joint in robot.twin_joints])
    decisions = tuple(
        ModeDecision(at - run.origin, m.mode_before, m.event, m.mode_after)
        for at, m in bag.messages(DECISIONS)
    )
    # The controller tells name, line and state as one text.
    data = ((at, m.program.split(" ")[0] * m.running) for at, m in bag.messages("real/robot_data"))
    payloads = ((at, (m.told.mass, m.mounted.mass)) for at, m in bag.messages("twin/payload"))
    overrides = ((at, m.real_override_percent) for at, m in bag.messages(STATE))
    return CourseRecording(
        run,
        decisions,
        changes_of(data, run.origin),
        read_work(run.configuration, None),
        changes_of(payloads, run.origin),
        changes_of(overrides, run.origin),
    )


def changes_of(values: Iterable[tuple[float, T]], origin: float) -> tuple[tuple[float, T], ...]:
    """Return only the values that differ from the one before, times [s] from the start."""
    found: list[tuple[float, T]] = []
    for at, value in values:
        if not found or found[-1][1] != value:
            found.append((at - origin, value))
    return tuple(found)


def newest_bag(runs: Path) -> Path | None:
    """Return the recording that was written to last; None: there is none."""
    # runs/latest is a link to a run that stands there by its own name too.
    found = [path for path in runs.glob(f"*/{BAG_NAME}") if not path.parent.is_symlink()]
    return max(found, key=lambda path: path.stat().st_mtime, default=None)
