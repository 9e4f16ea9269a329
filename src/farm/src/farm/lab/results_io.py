"""What the lab keeps in a folder: its plan, by what it is done, and what each job said.

What is in the folder already is not run again, so a lab that was interrupted goes on where it was.
"""

from __future__ import annotations

from pathlib import Path

import msgspec
from scara_config.files.whole_file import write_whole

from farm.lab.plan import Job, Plan

PLAN = "plan.json"
MADE_BY = "made_by.txt"
"""File that says by which version of the project, robot and plant the results are."""
RESULTS = "results.jsonl"
"""File with all results of a plan, in the order of its jobs."""


class LabError(RuntimeError):
    """The lab cannot go on; the text says why and what to do."""


class Result(msgspec.Struct, frozen=True):
    """What became of a job.

    Attributes:
        job: Its name.
        kind: See :class:`farm.lab.plan.Job`.
        words: Same.
        code: Exit code; negative: the signal that ended it.
        said: Its standard output.
        complained: The end of its error output.
    """

    job: str
    kind: str
    words: tuple[str, ...]
    code: int
    said: str
    complained: str


def begin(folder: Path, plan: Plan, made_by: str) -> None:
    """Keep the plan in the folder, and beside it what else its results depend on.

    Args:
        folder: Of the results.
        plan: What is asked for.
        made_by: See :func:`farm.lab.running_io.made_by`.

    Raises:
        LabError: The folder cannot be used, or holds another plan, or results of another version,
            robot or plant.
    """
    file, beside, now = folder / PLAN, folder / MADE_BY, made_by.encode()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if file.exists():
            if read_plan(folder) != plan:
                raise LabError(f"{file}: is another plan: name another folder")
            # A lab that was begun before this was kept goes on.
            if beside.exists() and (then := beside.read_bytes()) != now:
                raise LabError(
                    f"{beside}: results are of {then.decode(errors='replace')}, more would be of "
                    f"{made_by}: name another folder"
                )
            return
        # First: a plan without it would be one of before.
        write_whole(beside, now)
        write_whole(file, msgspec.json.encode(plan))
    except OSError as error:
        raise LabError(f"{folder}: {error.strerror}") from error


def read_plan(folder: Path) -> Plan:
    """Return the plan of a folder.

    Raises:
        LabError: There is none.
    """
    try:
        return msgspec.json.decode((folder / PLAN).read_bytes(), type=Plan)
    except (OSError, msgspec.DecodeError, UnicodeDecodeError) as error:
        raise LabError(f"{folder / PLAN}: is no plan of the lab: {error}") from error


def result_of(folder: Path, job: Job) -> Result | None:
    """Return what became of a job; None: it was not run to its end."""
    try:
        return msgspec.json.decode((folder / f"{job.name}.json").read_bytes(), type=Result)
    # What cannot be read counts as not run: the job is run again.
    except (FileNotFoundError, msgspec.DecodeError, UnicodeDecodeError):
        return None


def keep(folder: Path, result: Result) -> None:
    """Keep a result; :func:`result_of` finds it."""
    write_whole(folder / f"{result.job}.json", msgspec.json.encode(result))
