"""Run jobs by dask, each in a process of its own: the same results on all workers that joined.

A worker of this machine gets a job's words, one of another machine also the job's file. dask gives
out anew what a worker was doing when it died. A job that is killed is started once more, as it
depends on nothing but its words; it ends with its worker, however that ended.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import logging
import os
import platform
import signal
import subprocess
import uuid
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import CancelledError
from pathlib import Path
from tempfile import TemporaryDirectory

from distributed import (
    Client,
    Future,
    KilledWorker,
    Worker,
    WorkerPlugin,
    as_completed,
    get_worker,
)
from msgspec.structs import replace
from scara_config.loader import OVERRIDE
from scara_config.profile import CHOICE, PLANT_CHOICE
from scara_ros.shell.program_io import workspace

from farm.lab.plan import OF_BAGS, PROGRAMS, Job, first_part
from farm.lab.results_io import LabError, Result, keep, result_of

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
KILLED, HUNG = -signal.SIGKILL, 124
"""Exit codes of jobs that were killed again and again, or took too long."""
MOST_BYTES = 1_000_000_000
"""Of files with the scheduler at a time, which holds them in memory. Our choice."""
SETTINGS = (CHOICE, PLANT_CHOICE)
"""Of the environment, what decides what a job computes."""
WRITTEN = {"report": (".html", ".json", ".png")}
"""What a kind of jobs writes beside its recording."""
LEFT_OUT = ("__pycache__", ".pyc", ".egg-info")
"""Of a version: what Python makes of the files."""
Answer = tuple[Result, dict[str, bytes]]
"""A result, and the files that the job wrote beside its own."""


def version_of(folder: Path) -> str:
    """Return what results depend on beside a job: sources, settings and pins in a project, Python.

    Files count, not commits: so does a change that was not committed.

    Raises:
        LabError: A file cannot be read.
    """
    whole = hashlib.sha256()
    settings = Path(os.environ.get(OVERRIDE) or folder / "config")
    try:
        for name, top in (("src", folder / "src"), ("setup", folder / "setup"), ("", settings)):
            for file in sorted(top.rglob("*")):
                place = file.relative_to(top)
                if file.is_file() and not any(part.endswith(LEFT_OUT) for part in place.parts):
                    content = hashlib.sha256(file.read_bytes()).hexdigest()
                    whole.update(f"{content} {name}/{place.as_posix()}\n".encode())
    except OSError as error:
        raise LabError(f"{error.filename}: {error.strerror}") from error
    python = f"{platform.python_version()} {platform.machine()}"
    return f"{whole.hexdigest()[:12]}, Python {python}"


def settings_here() -> dict[str, str]:
    """Return those of :data:`SETTINGS` that are set."""
    return {name: os.environ[name] for name in SETTINGS if os.environ.get(name)}


def made_by() -> str:
    """Return in words by what jobs are done: version of the project, and robot and plant if chosen.

    Raises:
        LabError: A file of the project cannot be read.
    """
    chosen = (f"{name} {value}" for name, value in settings_here().items())
    return ", ".join((f"version {version_of(workspace())}", *chosen))


def differs(version: str, who: str, theirs: str) -> str:
    """Return why nobody of another version does a job."""
    return (
        f"this machine has version {version}, {who} has {theirs}: results could differ. Give both "
        "the same commit and the same changes, ./cell setup and ./cell build"
    )


class Jobs(WorkerPlugin):
    """The process of the job that a worker runs; it ends with the worker, and all it started."""

    name = "jobs"
    # A second lab at a scheduler must not end the jobs of the first one.
    idempotent = True

    def __init__(self) -> None:
        """Begin without a job."""
        self._process: subprocess.Popen[bytes] | None = None
        self._ended = False

    def setup(self, worker: Worker) -> None:
        """Leave the terminal's Ctrl-C to the lab, which ends its workers."""
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        # dask complains of each job that ends with its worker.
        logging.getLogger("distributed.worker.state_machine").setLevel(logging.ERROR)

    def teardown(self, worker: Worker) -> None:
        """Kill what runs, and let nothing begin: the worker ends."""
        self._ended = True
        self._kill()

    def run(
        self,
        job: Job,
        environment: Mapping[str, str],
        folder: Path | None = None,
        read_as: Callable[[str], str] = str,
    ) -> Result:
        """Run a job; once more if it was killed from outside.

        Args:
            job: Which.
            environment: Of its process.
            folder: Where it runs; None: where the worker does.
            read_as: What becomes of its output.

        Raises:
            FileNotFoundError: There is no such program.
        """
        # What rosrun would find, without its search.
        program = workspace().joinpath("devel", "lib", *PROGRAMS[job.kind])
        if not program.is_file():
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(program))
        code, outputs = KILLED, (b"", b"")
        for _ in range(TRIES):
            if self._ended:
                break
            self._process = subprocess.Popen(
                [*BOUND, str(program), *job.words],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                env={**environment, **ALIKE},
                cwd=folder,
                # Out of reach of the terminal's Ctrl-C: what was interrupted is no result.
                start_new_session=True,
            )
            try:
                outputs = self._process.communicate(timeout=DEADLINE_S)
                code = self._process.returncode
            except subprocess.TimeoutExpired:
                self._kill()
                self._process.communicate()
                code, outputs = HUNG, (b"", f"not ended within {DEADLINE_S:g} s".encode())
            # Else it was killed, as where memory is short: once more.
            if code >= 0:
                break
        said, trouble = (read_as(text.decode("utf-8", "replace")) for text in outputs)
        return Result(job.name, job.kind, job.words, code, said, trouble[-2000:])

    def _kill(self) -> None:
        """Kill the process and what it has started: its session is its own."""
        if self._process is not None and self._process.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, signal.SIGKILL)


def do(job: Job, files: dict[str, bytes], version: str | None, settings: dict[str, str]) -> Answer:
    """Run a job on a worker; on one of another machine in a folder of its own.

    Args:
        job: As the asking machine has it.
        files: By name, what it reads where its first word is; none: that is no file, or of this
            machine.
        version: Of the asking machine; None: it is this one.
        settings: Of its environment, :data:`SETTINGS`.

    Raises:
        LabError: This machine has another version.
        FileNotFoundError: It has no such program.
    """
    worker = get_worker()
    jobs = worker.plugins[Jobs.name]
    assert isinstance(jobs, Jobs)
    environment = {k: v for k, v in os.environ.items() if k not in SETTINGS} | settings
    if version is None:
        return jobs.run(job, environment), {}
    here = version_of(workspace())
    if here != version:
        raise LabError(differs(version, f"worker {worker.address}", here))
    with TemporaryDirectory(prefix="lab_") as name:
        word = Path(job.words[0])
        # A folder of the same name: a program may name it.
        folder = Path(name).resolve() / (word.parent.name or "job")
        folder.mkdir()
        file, done = folder / word.name, job
        for each, content in files.items():
            folder.joinpath(each).write_bytes(content)
        if files:
            done = replace(job, words=(str(file), *job.words[1:]))

        def named_as_asked(text: str) -> str:
            if word.is_absolute():
                text = text.replace(folder.as_uri(), word.parent.as_uri())
            return text.replace(str(file), str(word)).replace(str(folder), str(word.parent))

        result = jobs.run(done, environment, folder, named_as_asked)
        endings = WRITTEN.get(job.kind, ())
        written = {f.name: f.read_bytes() for f in folder.iterdir() if f.suffix in endings}
        return replace(result, words=job.words), written


def run(
    folder: Path,
    jobs: Sequence[Job],
    client: Client,
    version: str | None = None,
    told: Callable[[Result], None] = lambda _: None,
) -> list[Result]:
    """Let a scheduler's workers run the jobs without a result, and return all results in order.

    Args:
        folder: Where results are kept, a file each; on this machine.
        jobs: What to run.
        client: A connection to the scheduler.
        version: Of this machine, which workers of others must have; None: all workers are here.
        told: Is called with each result, as it comes.

    Raises:
        LabError: A worker has no such program or another version, a file cannot be read or written,
            or the scheduler has gone; what came until then is kept.
    """
    client.register_plugin(Jobs())
    known = {job.name: result_of(folder, job) for job in jobs}
    for result in filter(None, known.values()):
        told(result)
    # The last one first, since pop takes from the end.
    waiting = [job for job in reversed(jobs) if known[job.name] is None]
    settings = settings_here()
    # A worker of another machine offers its version as a resource: dask gives jobs to equal ones
    # alone.
    needs = {version: 1} if version else None
    # Keys of its own: two labs at one scheduler have jobs of the same names.
    lot, coming = uuid.uuid4().hex, as_completed()
    given: dict[str, tuple[Job, int]] = {}
    held = 0
    try:
        while waiting or given:
            while waiting and held < MOST_BYTES:
                job = waiting.pop()
                file, files = Path(job.words[0]), {}
                # A worker of this machine reads them by itself.
                if version and (job.kind in OF_BAGS or file.is_file()):
                    # Of a recording all parts: they are read as one, wherever they are.
                    bags = file.parent.glob("*.bag")
                    parts = [file, *(bag for bag in bags if first_part(bag) == file != bag)]
                    files = {each.name: each.read_bytes() for each in parts}
                words, key = (do, job, files, version, settings), f"{lot}-{job.name}"
                coming.add(client.submit(*words, key=key, pure=False, resources=needs))
                given[key] = job, sum(map(len, files.values()))
                held += given[key][1]
            future = next(coming)
            job, size = given.pop(str(future.key))
            held -= size
            result, written = _answer(job, future)
            for name, data in written.items():
                (Path(job.words[0]).parent / Path(name).name).write_bytes(data)
            keep(folder, result)
            known[result.job] = result
            told(result)
    except OSError as error:
        raise LabError(f"{error.filename or folder}: {error.strerror or error}") from error
    except CancelledError as error:
        there = sum(result is not None for result in known.values())
        raise LabError(
            f"the scheduler has gone; {there} of {len(jobs)} results are kept: go on with the same "
            f"words and --folder {folder}"
        ) from error
    finally:
        # Also after an error: nobody waits for them any more.
        client.cancel(list(coming.futures))
    return list(filter(None, known.values()))


def _answer(job: Job, future: Future[Answer]) -> Answer:
    """Return what became of a job; raises what it raised on its worker."""
    error = future.exception()
    if isinstance(error, KilledWorker):
        why = "each worker that ran it was killed"
        return Result(job.name, job.kind, job.words, KILLED, "", why), {}
    if error is not None:
        raise error
    return future.result()
