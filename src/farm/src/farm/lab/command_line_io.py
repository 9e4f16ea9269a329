"""Command line of ``./cell lab``: many jobs over bags, programs and points, all processors.

Exit code: 0 all jobs ended with 0, or an experiment repeated itself; 1 not; 2 a wrong word.
"""

from __future__ import annotations

from datetime import datetime
from glob import glob
from itertools import count
from pathlib import Path
from random import Random
from typing import Annotated, NoReturn

import msgspec
import typer
from rich.console import Console
from rich.progress import Progress
from scara_ros.shell.command_line_io import CommandLine
from scara_ros.shell.program_io import FAILED, INTERRUPTED, WRONG, workspace

from farm.lab.address import PORT, AddressError, listened, scheduler_address
from farm.lab.plan import OF_BAGS, PROGRAMS, LabPlanError, Plan, first_part, jobs_of, summary
from farm.lab.results_io import RESULTS, LabError, Result, begin, read_plan, result_of

Workers = Annotated[
    int | None, typer.Option(help="Jobs at a time. Default: one for each processor.", min=1)
]
Scheduler = Annotated[
    str,
    typer.Option(
        help="HOST:PORT of a scheduler that runs here, or tls://HOST:PORT of one of your lab. "
        "Default: one of its own.",
    ),
]

WORDS = {"judge": ("--resting", "--json"), "improve": ("--out", "-", "--workers", "1")}
"""Of each job of a kind: its answer is what it prints, and it leaves the processors to the lab."""

app = CommandLine(
    "lab",
    {AddressError: WRONG, LabPlanError: WRONG, LabError: FAILED},
    rich_markup_mode=None,
    no_args_is_help=True,
    help="Run many jobs over bags, programs and points, on all processors; the same again.",
)


def _fail(text: str, code: int) -> NoReturn:
    typer.echo(f"lab: {text}", err=True)
    raise typer.Exit(code)


def _add(kind: str) -> None:
    """Add the word of a kind of jobs."""
    what = "bags, or folders with bags" if kind in OF_BAGS else "programs, or points x,y,z in m"

    def start(
        targets: Annotated[list[str], typer.Argument(help="Of the jobs; * is allowed for bags.")],
        variations: Annotated[int, typer.Option(help="Of each point.", min=1)] = 1,
        spread_mm: Annotated[float, typer.Option(help="Of a point's coordinates.", min=0.0)] = 5.0,
        speed: Annotated[str, typer.Option(help="LOW-HIGH percent, of a point.")] = "",
        seed: Annotated[int, typer.Option(help="Of what is chosen at random.")] = 0,
        folder: Annotated[
            Path | None, typer.Option(help="Of the results. Default: runs/lab/<time>.")
        ] = None,
        workers: Workers = None,
        scheduler: Scheduler = "",
    ) -> None:
        """Run an experiment; one that was interrupted goes on with the same words and folder."""
        at = scheduler and scheduler_address(scheduler)
        asked = _bags(targets) if kind in OF_BAGS else targets
        words = WORDS.get(kind, ())
        plan = Plan(kind, tuple(asked), words, variations, spread_mm, _speeds(speed), seed)
        runs = workspace() / "runs" / "lab"
        place = folder or runs / datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
        results = _run(place, plan, workers, at)
        raise typer.Exit(FAILED if any(result.code for result in results) else 0)

    package, program = PROGRAMS[kind]
    app.command(kind, help=f"Run {program} of {package} over {what}.")(start)


for _kind in PROGRAMS:
    _add(_kind)


@app.command()
def again(
    folder: Annotated[Path, typer.Argument(help="Of an experiment that was run.")],
    workers: Workers = None,
    scheduler: Scheduler = "",
) -> None:
    """Run an experiment once more, and say which results are not the same, sign for sign."""
    at = scheduler and scheduler_address(scheduler)
    try:
        plan = read_plan(folder)
        old = {job.name: result_of(folder, job) for job in jobs_of(plan, Random)}
    except LabError as error:  # no folder of an experiment: a wrong word
        _fail(str(error), WRONG)
    place = next(p for k in count(1) if not (p := folder / f"again_{k}").exists())
    results = ((old[new.job], new) for new in _run(place, plan, workers, at))
    other = [new for was, new in results if not was or (was.code, was.said) != (new.code, new.said)]
    for result in other:
        typer.echo(f"{result.job} {' '.join(result.words)}: not the same")
    typer.echo(f"{len(old) - len(other)} of {len(old)} results are the same")
    raise typer.Exit(FAILED if other else 0)


@app.command("scheduler")
def keep_scheduler(
    port: Annotated[int, typer.Option(help="Where it listens.", min=1, max=65535)] = PORT,
    listen: Annotated[
        str,
        typer.Option(
            help="HOST at which invited machines reach it (./cell farm invite NAME --lab); without "
            "it only this machine.",
        ),
    ] = "",
) -> None:
    """Keep a scheduler of dask for several labs and workers, until Ctrl-C."""
    host = listened(listen) if listen else ""
    from farm.lab.cluster_io import serve

    serve(port, host)


@app.command()
def worker(
    address: Annotated[
        str, typer.Argument(help="Of the scheduler: HOST:PORT here, or tls://HOST:PORT.")
    ],
    workers: Workers = None,
) -> None:
    """Run jobs of labs for a scheduler on this machine's processors, until Ctrl-C."""
    asked = scheduler_address(address)
    from farm.lab.cluster_io import work

    work(asked, workers)


def _run(folder: Path, plan: Plan, workers: int | None, scheduler: str) -> list[Result]:
    """Run a plan's jobs that have no result yet, with a progress bar; keep and return all results.

    Raises:
        LabPlanError: The plan has no jobs.
        LabError: The lab cannot go on; what was done is kept.
    """
    jobs = jobs_of(plan, Random)
    # Imported late, here and below: dask takes half a second, and a wrong word needs none of it.
    from farm.lab.cluster_io import connected
    from farm.lab.running_io import made_by, run

    begin(folder, plan, made_by())
    try:
        with (
            Progress(console=Console(stderr=True), transient=True) as progress,
            connected(scheduler, workers) as (client, version),
        ):
            bar = progress.add_task(plan.kind, total=len(jobs))
            results = run(folder, jobs, client, version, lambda _: progress.advance(bar))
    except KeyboardInterrupt:
        _fail(f"interrupted: go on with the same words and --folder {folder}", INTERRUPTED)
    lines = b"".join(msgspec.json.encode(result) + b"\n" for result in results)
    (folder / RESULTS).write_bytes(lines)
    for result in results:
        if result.code:
            why = (result.complained.strip() or result.said.strip()).splitlines()[-1:]
            typer.echo(f"{result.job} {' '.join(result.words)}: {result.code}: {''.join(why)}")
    typer.echo(f"{summary([result.code for result in results])}; {folder / RESULTS}")
    return results


def _bags(targets: list[str]) -> list[str]:
    """Return the recordings that words mean; * stands for anything, also within quotes."""
    found: list[Path] = []
    for path in (Path(name) for each in targets for name in sorted(glob(each)) or [each]):
        found += sorted(path.rglob("*.bag")) if path.is_dir() else [path]
    # By their true names: runs/latest leads to a run that is named beside it.
    bags = dict.fromkeys(path.resolve() for path in found)
    # A later part is read with the first one: alone it would be another report in the same file.
    return [str(bag) for bag in bags if first_part(bag) == bag or first_part(bag) not in bags]


def _speeds(text: str) -> tuple[float, float] | None:
    """Return a range of speeds.

    Raises:
        LabPlanError: It is none.
    """
    if not text:
        return None
    low, _, high = text.partition("-")
    try:
        found = float(low), float(high or low)
    except ValueError:
        raise LabPlanError(f"--speed {text}: allowed is LOW-HIGH, for example 20-80") from None
    if not 0.0 < found[0] <= found[1] <= 100.0:
        raise LabPlanError(f"--speed {text}: allowed are 0 to 100 percent, the lower one first")
    return found


def main() -> None:
    """Run the command line."""
    app(prog_name="./cell lab")
