"""Run jobs side by side, each in a process of its own, and keep what each said.

A process that is killed is started once more: a job depends on nothing but its words. What is in
the folder already is not run again, so a lab that was interrupted goes on where it was.
"""

from __future__ import annotations

import os
import subprocess
import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import msgspec

from farm.lab.plan import PROGRAMS, Job, Plan

PLAN = "plan.json"
TRIES = 2
"""Our choice: what is killed twice is killed by what it does."""
DEADLINE_S = 900.0
"""Our choice: a fit takes two minutes; what takes longer hangs."""
Command = Callable[[Job], Sequence[str]]


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


def processors() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0))


def program_of(job: Job, devel: Path) -> list[str]:
    """Return the command line of a job: what rosrun would find, without its search."""
    package, program = PROGRAMS[job.kind]
    return [str(devel / "lib" / package / program), *job.words]


def begin(folder: Path, plan: Plan) -> None:
    """Keep the plan in the folder.

    Raises:
        LabError: The folder cannot be used, or holds another plan.
    """
    file = folder / PLAN
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if file.exists():
            if read_plan(folder) != plan:
                raise LabError(f"{file}: is another plan: name another folder")
            return
        _write(file, plan)
    except OSError as error:
        raise LabError(f"{folder}: {error.strerror}") from error


def read_plan(folder: Path) -> Plan:
    """Return the plan of a folder.

    Raises:
        LabError: There is none.
    """
    try:
        return msgspec.json.decode((folder / PLAN).read_bytes(), type=Plan)
    except (OSError, msgspec.DecodeError) as error:
        raise LabError(f"{folder / PLAN}: is no plan of the lab: {error}") from error


def result_of(folder: Path, job: Job) -> Result | None:
    """Return what became of a job; None: it was not run to its end."""
    try:
        return msgspec.json.decode((folder / f"{job.name}.json").read_bytes(), type=Result)
    except (FileNotFoundError, msgspec.DecodeError):
        return None


def run(
    folder: Path,
    jobs: Iterable[Job],
    command: Command,
    workers: int,
    told: Callable[[Result], None] = lambda _: None,
) -> list[Result]:
    """Run the jobs that have no result yet, and return the results of all, in their order.

    Args:
        folder: Where results are kept, a file each.
        jobs: What to run.
        command: Returns the command line of a job.
        workers: So many at a time.
        told: Is called with each result, as it comes.

    Raises:
        LabError: A program is not there, or the folder cannot be written to.
    """
    lock = threading.Lock()

    def one(job: Job) -> Result:
        result = result_of(folder, job)
        if result is None:
            result = _run(job, command(job))
            _write(folder / f"{job.name}.json", result)
        with lock:
            told(result)
        return result

    with ThreadPoolExecutor(workers) as pool:
        futures = [pool.submit(one, job) for job in jobs]
        try:
            return [future.result() for future in futures]
        except OSError as error:
            raise LabError(f"{error.filename or folder}: {error.strerror}") from error
        finally:
            pool.shutdown(cancel_futures=True)


def _run(job: Job, command: Sequence[str]) -> Result:
    """Run one job; once more if it was killed."""
    code, said, complained = 0, "", ""
    # One thread of arithmetic each: the jobs share the processors among them already.
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    for _ in range(TRIES):
        try:
            done = subprocess.run(
                command,
                stdin=subprocess.DEVNULL,
                capture_output=True,
                env=environment,
                timeout=DEADLINE_S,
            )
        except subprocess.TimeoutExpired:
            code, complained = 124, f"not ended within {DEADLINE_S:g} s"
            break
        code = done.returncode
        said = done.stdout.decode("utf-8", "replace")
        complained = done.stderr.decode("utf-8", "replace")[-2000:]
        if code >= 0:
            break
    return Result(job.name, job.kind, job.words, code, said, complained)


def _write(file: Path, content: msgspec.Struct) -> None:
    """Write a file that is whole or not there."""
    half = file.with_suffix(".part")
    half.write_bytes(msgspec.json.encode(content))
    half.replace(file)
