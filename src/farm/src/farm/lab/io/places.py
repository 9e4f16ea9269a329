"""Where the lab's jobs run: in processes here, or on the workers of a scheduler of dask."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import Enum
from functools import partial
from pathlib import Path
from random import Random
from typing import Protocol

import msgspec
import typer
from rich.console import Console
from rich.progress import Progress

from farm.lab.address import is_secure, scheduler_address
from farm.lab.io.running import Result, begin, processors, program_of, root, run
from farm.lab.plan import Job, Plan, jobs_of

RESULTS = "results.jsonl"
"""File with all results of a plan, in the order of its jobs."""


class Place(str, Enum):
    """In processes of this program, or by dask."""

    HERE = "here"
    FARM = "farm"


@dataclass(frozen=True)
class Where:
    """Where jobs run.

    Attributes:
        place: See there.
        workers: Jobs at a time on this machine; None: one for each processor.
        scheduler: Address of a scheduler that runs; empty: one is started, with workers.
    """

    place: Place = Place.HERE
    workers: int | None = None
    scheduler: str = ""


class Runner(Protocol):
    """Runs jobs, as :func:`farm.lab.io.running.run`."""

    def __call__(
        self, folder: Path, jobs: list[Job], told: Callable[[Result], None]
    ) -> list[Result]:
        """Return the results of all, in their order."""


def where(place: Place, workers: int | None, scheduler: str) -> Where:
    """Return where jobs run; a scheduler that is named implies dask.

    Raises:
        AddressError: The scheduler's address is none, or of another machine without TLS.
    """
    if not scheduler:
        return Where(place, workers)
    return Where(Place.FARM, workers, scheduler_address(scheduler))


def run_plan(folder: Path, plan: Plan, at: Where) -> list[Result]:
    """Run a plan's jobs that have no result yet, with a progress bar; keep and return all results.

    Raises:
        LabError: The lab cannot go on; what was done is kept.
    """
    jobs = jobs_of(plan, Random)
    begin(folder, plan)
    with _runner(at) as runner, Progress(console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task(plan.kind, total=len(jobs))
        results = runner(folder, jobs, told=lambda _: progress.advance(bar))
    lines = b"".join(msgspec.json.encode(result) + b"\n" for result in results)
    (folder / RESULTS).write_bytes(lines)
    return results


@contextmanager
def _runner(at: Where) -> Iterator[Runner]:
    """Give what runs jobs; what was started for them ends with the block.

    Raises:
        LabError: There is no such scheduler, or it has no workers.
    """
    workers = at.workers or processors()
    if at.place is Place.HERE:
        devel = root() / "devel"
        yield partial(run, command=lambda job: program_of(job, devel), workers=workers)
        return
    # Imported late: dask takes half a second, and only this needs it.
    from farm.lab.io.carried.parcels import Parcels
    from farm.lab.io.carried.version import version_of
    from farm.lab.io.cluster import joined_cluster, own_cluster
    from farm.lab.io.far import Way, Words, run_far

    with joined_cluster(at.scheduler) if at.scheduler else own_cluster(workers) as client:
        if not at.scheduler:
            address = client.scheduler_info()["address"]
            typer.echo(f"lab: more workers: ./cell lab worker {address}", err=True)
        way: Way = Words()
        if is_secure(at.scheduler):
            way = Parcels(version_of(root()), lambda text: typer.echo(f"lab: {text}", err=True))
        yield partial(run_far, client=client, way=way)
