"""Command ``course``: exercises with robot and twin that mark themselves.

``./cell course list | start N | check [N] | all | export``. No cell needs to run to mark: what is
marked are files. Exit code: 0 passed, 1 not passed, 2 wrong words or files.
"""

from __future__ import annotations

import getpass
import os
import re
import time
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from cell_recorder.journal.course_results_io import STARTED
from cell_recorder.journal.entries import CourseResult, CourseStarted
from rich.box import SIMPLE
from rich.console import Console
from rich.markdown import Markdown
from rich.table import Table as Rows
from scara_config import ConfigError, Robot, load_robot
from scara_config.files.whole_file import write_whole
from scara_ros.page.token_file_io import TokenError
from scara_ros.shell.command_line_io import CommandLine, choose_robot
from scara_ros.shell.program_io import FAILED, WRONG, runs_folder

from scara_course.evidence_io import Marked, mark
from scara_course.exercise import Exercise
from scara_course.exercises_io import CARD, load_exercises, start
from scara_course.results import is_genuine
from scara_course.results_io import ResultsError, add_result, course_key, export, read_results

ROBOT = "fanuc_sr6ia"
"""The article's robot: the cards name its lengths."""
LEARNER = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,39}")
LEARNER_VARIABLE = "SCARA_LEARNER"


class CourseError(ValueError):
    """There is no such exercise or learner; the text says what there is."""


app = CommandLine(
    "course",
    dict.fromkeys((CourseError, ConfigError, ResultsError, TokenError, OSError), WRONG),
    help="Exercises with robot and twin that mark themselves.",
    no_args_is_help=True,
    rich_markup_mode=None,
)
console = Console(highlight=False, soft_wrap=True)

Number = Annotated[int, typer.Argument(help="Of the exercise.")]
Learner = Annotated[
    str | None, typer.Option(help="Name. Default: SCARA_LEARNER, else the user of this computer.")
]
Runs = Annotated[Path | None, typer.Option(help="Folder of the runs.")]


class LearnerDesk:
    """One learner's place: exercises, folder, results."""

    def __init__(self, learner: str | None, runs: Path | None) -> None:
        """Read exercises, robot and results.

        Raises:
            CourseError: The learner's name is none.
        """
        self.learner = learner or os.environ.get(LEARNER_VARIABLE) or getpass.getuser()
        if not LEARNER.fullmatch(self.learner):
            raise CourseError(
                f"learner {self.learner!r}: give 1 to 40 letters, digits, dots, dashes or "
                "underlines, by --learner"
            )
        choose_robot(ROBOT)
        self.robot: Robot = load_robot()
        self.runs = runs_folder(runs)
        self.folder = self.runs / "course"
        self.exercises = load_exercises()
        self.results = [r for r in read_results(self.folder) if r.learner == self.learner]

    def exercise(self, number: int | None) -> Exercise:
        """Return an exercise; None: the one that was started last.

        Raises:
            CourseError: There is none.
        """
        if number is None:
            try:
                text = (self.folder / self.learner / STARTED).read_bytes()
                last = msgspec.json.decode(text, type=CourseStarted).exercise
                return next(each for each in self.exercises if each.name == last)
            # Damaged, or the exercise that was started has another name by now (StopIteration).
            except (FileNotFoundError, ValueError, StopIteration):
                raise CourseError("no exercise was started: ./cell course start 1") from None
        if not 1 <= number <= len(self.exercises):
            raise CourseError(f"exercise {number}: there are 1 to {len(self.exercises)}")
        return self.exercises[number - 1]

    @property
    def passed(self) -> set[str]:
        """Names of the exercises that have passed at least once."""
        return {each.name for each in self.exercises if any(r.passed for r in self.of(each))}

    def progress(self) -> str:
        """Return how many exercises were passed, and how to go on."""
        passed = self.passed
        words = f"{len(passed)} of {len(self.exercises)} passed"
        left = [each.task.number for each in self.exercises if each.name not in passed]
        return f"{words}. Next: ./cell course start {left[0]}" if left else words

    def begin(self, exercise: Exercise) -> None:
        """Keep that it was started last, for :meth:`exercise` and for the operator's page."""
        started = CourseStarted(exercise.name, exercise.title, len(self.exercises))
        write_whole(self.folder / self.learner / STARTED, msgspec.json.encode(started))

    def place(self, exercise: Exercise) -> Path:
        """Return the learner's folder of an exercise."""
        return self.folder / self.learner / exercise.name

    def of(self, exercise: Exercise) -> list[CourseResult]:
        """Return the results of an exercise, the oldest first."""
        return [each for each in self.results if each.exercise == exercise.name]

    def keep(self, exercise: Exercise, marked: Marked, key: str) -> CourseResult:
        """Add what was marked to the results, and print it."""
        verdict = marked.verdict
        result = CourseResult(
            number=0,
            time=time.time(),
            learner=self.learner,
            exercise=exercise.name,
            title=exercise.title,
            passed=verdict.passed,
            reason=verdict.reason,
            evidence=marked.name,
            digest=marked.digest,
        )
        kept = add_result(self.folder, result, key)
        self.results.append(kept)
        word = "[green]PASSED[/]" if verdict.passed else "[yellow]not yet[/]"
        console.print(f"{exercise.title}: {word}: ", end="")
        # A reason may hold what the learner wrote: rich would take its brackets for colours.
        console.print(verdict.reason, markup=False)
        return kept


@app.command("list")
def list_exercises(learner: Learner = None, runs: Runs = None) -> None:
    """Show all exercises, and how far you are."""
    desk = LearnerDesk(learner, runs)
    table = Rows(title=f"Course of {desk.learner}", box=SIMPLE, padding=(0, 1, 0, 0))
    for heading in ("", "exercise", "minutes", "marked", "state"):
        table.add_column(heading)
    for each in desk.exercises:
        held = desk.of(each)
        state = "passed" if each.name in desk.passed else (held[-1].reason if held else "")
        row = (str(each.task.number), each.task.title, str(each.task.minutes), str(len(held)))
        table.add_row(*row, state)
    Console(highlight=False, markup=False).print(table)
    console.print(desk.progress())


@app.command("start")
def start_exercise(
    number: Number,
    learner: Learner = None,
    anew: Annotated[bool, typer.Option("--anew", help="Begin with empty answers.")] = False,
    runs: Runs = None,
) -> None:
    """Show the card of an exercise, and lay out its files."""
    desk = LearnerDesk(learner, runs)
    exercise = desk.exercise(number)
    written = start(exercise, desk.learner, desk.robot, desk.place(exercise), anew)
    desk.begin(exercise)
    Console(highlight=False).print(Markdown(exercise.card))
    console.print("\nYour files, for any text editor:")
    for path in written:
        console.print(f"  {path}", markup=False)
    console.print(f"To have it marked: {exercise.command}", markup=False)


@app.command()
def check(
    number: Annotated[int | None, typer.Argument(help="Default: the one started last.")] = None,
    bag: Annotated[Path | None, typer.Option(help="This recording, not the newest.")] = None,
    learner: Learner = None,
    runs: Runs = None,
) -> None:
    """Mark an exercise, and keep the verdict."""
    desk = LearnerDesk(learner, runs)
    exercise = desk.exercise(number)
    marked = mark(exercise, desk.learner, desk.robot, desk.place(exercise), desk.runs, bag)
    result = desk.keep(exercise, marked, course_key())
    if result.passed:
        console.print(desk.progress())
    raise typer.Exit(0 if result.passed else FAILED)


@app.command("all")
def check_all(learner: Learner = None, runs: Runs = None) -> None:
    """Mark all exercises that were started; where no recording has passed yet: the newest one."""
    desk = LearnerDesk(learner, runs)
    started = [each for each in desk.exercises if (desk.place(each) / CARD).exists()]
    if not started:
        raise CourseError("no exercise was started: ./cell course start 1")
    key = course_key()
    for each in started:
        # The newest recording may be of another exercise.
        if each.task.evidence == "bag" and each.name in desk.passed:
            console.print(f"{each.title}: passed before")
            continue
        marked = mark(each, desk.learner, desk.robot, desk.place(each), desk.runs, None)
        desk.keep(each, marked, key)
    console.print(desk.progress())
    raise typer.Exit(0 if len(desk.passed) == len(desk.exercises) else FAILED)


@app.command("export")
def export_results(runs: Runs = None) -> None:
    """Write all learners' results as CSV and as xAPI statements; name what is not genuine."""
    folder, key = runs_folder(runs) / "course", course_key()
    results = read_results(folder)
    genuine = [each for each in results if is_genuine(each, key)]
    for each in results:
        if each not in genuine:
            console.print(f"left out: result {each.number}: its signature does not fit")
    for path in export(folder, genuine):
        console.print(f"wrote {path}", markup=False)
    raise typer.Exit(0 if len(genuine) == len(results) else FAILED)


main = app.run
