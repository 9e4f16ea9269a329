"""Run jobs by a scheduler of dask: the same jobs, the same results, on all workers that joined.

A worker of this machine gets a job's words, one of another machine also the job's file. The worker
runs the program in a process of its own, as :func:`farm.lab.running_io.run` does here. dask gives
out anew what a worker was doing when it died.
"""

from __future__ import annotations

import hashlib
import os
import platform
import uuid
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from pathlib import Path
from tempfile import TemporaryDirectory

from distributed import Client, Future, KilledWorker, as_completed, get_worker
from msgspec.structs import replace
from scara_config.loader import OVERRIDE
from scara_config.profile import CHOICE, PLANT_CHOICE
from scara_ros.shell.program_io import workspace

from farm.lab.plan import OF_BAGS, Job
from farm.lab.running_io import (
    JobProcesses,
    LabError,
    Result,
    keep,
    perform,
    program_of,
    result_of,
)

KILLED = -9
"""Exit code of a job whose workers were killed again and again, as of one that is killed here."""
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


def differs(version: str, who: str, theirs: str) -> str:
    """Return why nobody of another version does a job."""
    return (
        f"this machine has version {version}, {who} has {theirs}: results could differ. Give both "
        "the same commit and the same changes, ./cell setup and ./cell build"
    )


def do(job: Job) -> Answer:
    """Run a job on a worker of the asking machine.

    Raises:
        FileNotFoundError: There is no such program.
    """
    return perform(job, program_of(job, workspace() / "devel")), {}


def do_there(job: Job, content: bytes | None, version: str, settings: dict[str, str]) -> Answer:
    """Run a job on a worker of another machine, in a folder of its own.

    Args:
        job: As the asking machine has it.
        content: Of the file that is its first word; None: that is no file.
        version: Of the asking machine.
        settings: Of its environment, :data:`SETTINGS`.

    Raises:
        LabError: This machine has another version.
        FileNotFoundError: It has no such program.
    """
    here = version_of(workspace())
    if here != version:
        raise LabError(differs(version, f"worker {get_worker().address}", here))
    with TemporaryDirectory(prefix="lab_") as name:
        word = Path(job.words[0])
        # A folder of the same name: a program may name it.
        folder = Path(name).resolve() / (word.parent.name or "job")
        folder.mkdir()
        file, done = folder / word.name, job
        if content is not None:
            file.write_bytes(content)
            done = replace(job, words=(str(file), *job.words[1:]))

        def named_as_asked(text: str) -> str:
            if word.is_absolute():
                text = text.replace(folder.as_uri(), word.parent.as_uri())
            return text.replace(str(file), str(word)).replace(str(folder), str(word.parent))

        environment = {k: v for k, v in os.environ.items() if k not in SETTINGS} | settings
        command = program_of(done, workspace() / "devel")
        result = perform(done, command, JobProcesses(environment, folder), named_as_asked)
        endings = WRITTEN.get(job.kind, ())
        written = {f.name: f.read_bytes() for f in folder.iterdir() if f.suffix in endings}
        return replace(result, words=job.words), written


def run_far(
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
    known = {job.name: result_of(folder, job) for job in jobs}
    for result in known.values():
        if result is not None:
            told(result)
    waiting = deque(job for job in jobs if known[job.name] is None)
    settings = {name: os.environ[name] for name in SETTINGS if os.environ.get(name)}
    # Keys of its own: two labs at one scheduler have jobs of the same names.
    lot, coming = uuid.uuid4().hex, as_completed()
    given: dict[str, tuple[Job, int]] = {}
    held = 0
    try:
        while waiting or given:
            while waiting and held < MOST_BYTES:
                job = waiting.popleft()
                file, content = Path(job.words[0]), None
                if version and (job.kind in OF_BAGS or file.is_file()):
                    content = file.read_bytes()
                words = (do_there, job, content, version, settings) if version else (do, job)
                # A worker of another machine offers its version as a resource: dask gives jobs to
                # equal ones alone.
                key, needs = f"{lot}-{job.name}", {version: 1} if version else None
                coming.add(client.submit(*words, key=key, pure=False, resources=needs))
                given[key] = job, len(content or b"")
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
    return [result for result in known.values() if result is not None]


def _answer(job: Job, future: Future[Answer]) -> Answer:
    """Return what became of a job; raises what it raised on its worker."""
    error = future.exception()
    if isinstance(error, KilledWorker):
        why = "each worker that ran it was killed"
        return Result(job.name, job.kind, job.words, KILLED, "", why), {}
    if error is not None:
        raise error
    return future.result()
