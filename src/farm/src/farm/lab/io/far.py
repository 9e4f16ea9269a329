"""Run jobs by a scheduler of dask: the same jobs, the same results, on all workers that joined.

A job goes to a worker of this machine as its words, to one of another machine with its files; the
worker runs the program in a process of its own, as :func:`farm.lab.io.running.run` does here. What
a worker was doing when it died another one does again: dask gives it out anew.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError
from pathlib import Path
from typing import Protocol

import msgspec
from distributed import Client, KilledWorker, as_completed

from farm.lab.io.running import LabError, Result, keep, perform, program_of, result_of, root
from farm.lab.plan import Job

KILLED = -9
"""Exit code of a job whose workers were killed again and again, as of one that is killed here."""


class Way(Protocol):
    """How a job goes to a worker and its result comes back."""

    def begin(self, client: Client, jobs: Sequence[Job]) -> Callable[[bytes], bytes]:
        """Prepare jobs; return what a worker does with one of :meth:`sent`.

        Raises:
            LabError: They cannot be done there.
        """

    def sent(self, job: Job) -> bytes:
        """Return a job as it travels."""

    def came(self, job: Job, answer: bytes) -> Result:
        """Return a job's result.

        Raises:
            LabError: The worker refused it.
            OSError: A file of it cannot be written here.
        """


class Words:
    """To workers of this machine: files are where they are."""

    def begin(self, client: Client, jobs: Sequence[Job]) -> Callable[[bytes], bytes]:
        """Prepare nothing."""
        return do

    def sent(self, job: Job) -> bytes:
        """Return it as JSON."""
        return msgspec.json.encode(job)

    def came(self, job: Job, answer: bytes) -> Result:
        """Return it."""
        return msgspec.json.decode(answer, type=Result)


def do(job: bytes) -> bytes:
    """Run a job where a worker is, and return its result; both as JSON.

    Raises:
        FileNotFoundError: The worker's machine has no such program.
    """
    asked = msgspec.json.decode(job, type=Job)
    return msgspec.json.encode(perform(asked, program_of(asked, root() / "devel")))


def run_far(
    folder: Path,
    jobs: Sequence[Job],
    client: Client,
    way: Way,
    told: Callable[[Result], None] = lambda _: None,
) -> list[Result]:
    """Let a scheduler's workers run the jobs without a result, and return all results in order.

    Args:
        folder: Where results are kept, a file each; on this machine.
        jobs: What to run.
        client: A connection to the scheduler.
        way: How jobs travel.
        told: Is called with each result, as it comes.

    Raises:
        LabError: A worker has no such program or refuses a job, the folder cannot be written to,
            or the scheduler has gone; what came until then is kept.
    """
    known = {job.name: result_of(folder, job) for job in jobs}
    for result in known.values():
        if result is not None:
            told(result)
    waiting = [job for job in jobs if known[job.name] is None]
    # Keys of its own: two labs at one scheduler have jobs of the same names.
    lot = uuid.uuid4().hex
    names = [f"{lot}-{job.name}" for job in waiting]
    job_of = dict(zip(names, waiting))
    doing = way.begin(client, waiting)
    futures = client.map(doing, list(map(way.sent, waiting)), key=names, pure=False)
    try:
        for future in as_completed(futures):
            result = _result(job_of[future.key], future.exception(), future.result, way)
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
        client.cancel(futures)
    return [result for result in known.values() if result is not None]


def _result(job: Job, error: BaseException | None, answer: Callable[[], bytes], way: Way) -> Result:
    """Return what became of a job.

    Raises:
        LabError: The worker refused it.
        OSError: Its program is not there, or its files cannot be written here.
    """
    if isinstance(error, KilledWorker):
        why = "each worker that ran it was killed"
        return Result(job.name, job.kind, job.words, KILLED, "", why)
    if error is not None:
        raise error
    return way.came(job, answer())
