"""Where the lab's jobs run: in processes here, or on the workers of a scheduler of dask."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from random import Random

import msgspec
from rich.console import Console
from rich.progress import Progress
from scara_ros.shell.program_io import workspace

from farm.lab.address import scheduler_address
from farm.lab.plan import Plan, jobs_of
from farm.lab.running_io import Result, begin, processors, program_of, run

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
        workers: Jobs at a time on this machine.
        scheduler: Address of a scheduler that runs; empty: one is started, with workers.
    """

    place: Place
    workers: int
    scheduler: str


def where(place: Place, workers: int | None, scheduler: str) -> Where:
    """Return where jobs run; a scheduler that is named implies dask.

    Raises:
        AddressError: The scheduler's address is none, or of another machine without TLS.
    """
    address = scheduler_address(scheduler) if scheduler else ""
    return Where(Place.FARM if address else place, workers or processors(), address)


def run_plan(folder: Path, plan: Plan, at: Where) -> list[Result]:
    """Run a plan's jobs that have no result yet, with a progress bar; keep and return all results.

    Raises:
        LabError: The lab cannot go on; what was done is kept.
    """
    jobs = jobs_of(plan, Random)
    begin(folder, plan)
    with Progress(console=Console(stderr=True), transient=True) as progress:
        bar = progress.add_task(plan.kind, total=len(jobs))

        def told(_: Result) -> None:
            progress.advance(bar)

        if at.place is Place.HERE:
            devel = workspace() / "devel"
            results = run(folder, jobs, lambda job: program_of(job, devel), at.workers, told)
        else:
            # Imported late: dask takes half a second, and only this needs it.
            from farm.lab.cluster_io import connected
            from farm.lab.far_io import run_far

            with connected(at.scheduler, at.workers) as (client, version):
                results = run_far(folder, jobs, client, version, told)
    lines = b"".join(msgspec.json.encode(result) + b"\n" for result in results)
    (folder / RESULTS).write_bytes(lines)
    return results
