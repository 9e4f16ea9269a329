"""Run jobs side by side, each in a process of its own, and keep what each said.

A process that is killed is started once more: a job depends on nothing but its words. What is in
the folder already is not run again, so a lab that was interrupted goes on where it was. A job ends
with the process that has started it, however that ended.
"""

from __future__ import annotations

import contextlib
import errno
import os
import signal
import subprocess
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import msgspec
from scara_config.files.whole_file import write_whole

from farm.lab.plan import PROGRAMS, Job, Plan

PLAN = "plan.json"
TRIES = 2
"""Our choice: what is killed twice is killed by what it does."""
DEADLINE_S = 900.0
"""Our choice: a fit takes two minutes; what takes longer hangs."""
BOUND = ("setpriv", "--pdeathsig", "KILL", "--")
"""Replaces itself by the program behind it, which the kernel then ends with its parent."""
ALIKE = {
    # One thread of arithmetic each: the jobs share the processors among them already.
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    # So wide that no line is broken: a path is as long as the machine has it.
    "COLUMNS": "2000",
}
"""Of each job's environment, on every machine."""
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
    lock, processes = threading.Lock(), JobProcesses()

    def one(job: Job) -> Result:
        result = result_of(folder, job)
        if result is None:
            result = perform(job, command(job), processes)
            keep(folder, result)
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
            processes.end()
            pool.shutdown(cancel_futures=True)


def _kill(process: subprocess.Popen[bytes]) -> None:
    """Kill a process and what it has started: its session is its own."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)


class EndedError(RuntimeError):
    """The lab has ended meanwhile; what a job says now is no result."""


class JobProcesses:
    """The processes of jobs that run now; safe to use from several threads."""

    def __init__(
        self, environment: Mapping[str, str] | None = None, folder: Path | None = None
    ) -> None:
        """Run commands in an environment and a folder; None: in those of this process."""
        self._environment, self._folder = environment, folder
        self._lock = threading.Lock()
        self._running: set[subprocess.Popen[bytes]] = set()
        self._ended = False

    def run(self, command: Sequence[str]) -> tuple[int, bytes, bytes]:
        """Run a command to its end; return exit code and both outputs.

        It is out of reach of the terminal's Ctrl-C: what was interrupted is no result.

        Raises:
            EndedError: :meth:`end` was called.
            subprocess.TimeoutExpired: It took too long, and was killed.
        """
        given = os.environ if self._environment is None else self._environment
        environment = {**given, **ALIKE}
        pipe = subprocess.PIPE
        with self._lock:
            if self._ended:
                raise EndedError
            process = subprocess.Popen(
                # A job that outlived its lab would compute for nobody.
                [*BOUND, *command],
                stdin=subprocess.DEVNULL,
                stdout=pipe,
                stderr=pipe,
                env=environment,
                cwd=self._folder,
                start_new_session=True,
            )
            self._running.add(process)
        try:
            said, complained = process.communicate(timeout=DEADLINE_S)
        finally:
            with self._lock:
                self._running.discard(process)
                ended = self._ended
            if process.poll() is None:
                _kill(process)
                process.communicate()
        if ended:
            raise EndedError
        return process.returncode, said, complained

    def end(self) -> None:
        """Kill what runs, and let nothing begin."""
        with self._lock:
            self._ended = True
            for process in self._running:
                _kill(process)


def perform(
    job: Job,
    command: Sequence[str],
    processes: JobProcesses | None = None,
    read_as: Callable[[str], str] = str,
) -> Result:
    """Run one job in a process of its own; once more if it was killed.

    Args:
        job: Which.
        command: Its command line.
        processes: Who can end it; None: nobody but the end of this process.
        read_as: What becomes of its output.

    Raises:
        FileNotFoundError: There is no such program.
        EndedError: The lab has ended meanwhile.
    """
    if not Path(command[0]).is_file():
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), command[0])
    processes = processes or JobProcesses()
    code, said, complained = 0, b"", b""
    for _ in range(TRIES):
        try:
            code, said, complained = processes.run(command)
        except subprocess.TimeoutExpired:
            code, said, complained = 124, b"", f"not ended within {DEADLINE_S:g} s".encode()
        # Else it was killed from outside, as where memory is short: once more.
        if code >= 0:
            break
    told, trouble = (read_as(text.decode("utf-8", "replace")) for text in (said, complained))
    return Result(job.name, job.kind, job.words, code, told, trouble[-2000:])


def keep(folder: Path, result: Result) -> None:
    """Keep a result; :func:`result_of` finds it."""
    write_whole(folder / f"{result.job}.json", msgspec.json.encode(result))
