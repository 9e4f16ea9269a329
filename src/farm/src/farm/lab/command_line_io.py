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

import typer
from scara_ros.shell.command_line_io import CommandLine
from scara_ros.shell.program_io import FAILED, INTERRUPTED, WRONG, workspace

from farm.lab.address import PORT, AddressError, listened, scheduler_address
from farm.lab.places_io import RESULTS, Place, Where, run_plan, where
from farm.lab.plan import OF_BAGS, PROGRAMS, LabPlanError, Plan, jobs_of, summary
from farm.lab.running_io import LabError, Result, processors, read_plan, result_of

Workers = Annotated[
    int | None, typer.Option(help="Jobs at a time. Default: one for each processor.", min=1)
]
On = Annotated[
    Place,
    typer.Option(
        "--on", help="farm: by dask, so that workers of other shells and machines join in."
    ),
]
Far = Annotated[
    str,
    typer.Option(
        "--scheduler",
        help="HOST:PORT of a scheduler that runs here, or tls://HOST:PORT of one of your lab; "
        "implies --on farm.",
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
        on: On = Place.HERE,
        scheduler: Far = "",
    ) -> None:
        at = where(on, workers, scheduler)
        _start(kind, targets, (variations, spread_mm, speed, seed), folder, at)

    package, program = PROGRAMS[kind]
    app.command(kind, help=f"Run {program} of {package} over {what}.")(start)


for _kind in PROGRAMS:
    _add(_kind)


def _start(
    kind: str,
    targets: list[str],
    varied: tuple[int, float, str, int],
    folder: Path | None,
    at: Where,
) -> NoReturn:
    """Run an experiment; one that was interrupted goes on with the same words and folder."""
    if kind in OF_BAGS:
        targets = [bag for target in targets for bag in _bags(target)]
    words = WORDS.get(kind, ())
    variations, spread_mm, speed, seed = varied
    plan = Plan(kind, tuple(targets), words, variations, spread_mm, _speeds(speed), seed)
    jobs_of(plan, Random)
    place = folder or workspace() / "runs" / "lab" / datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
    results = _run(place, plan, at)
    raise typer.Exit(FAILED if any(result.code for result in results) else 0)


@app.command()
def again(
    folder: Annotated[Path, typer.Argument(help="Of an experiment that was run.")],
    workers: Workers = None,
    on: On = Place.HERE,
    scheduler: Far = "",
) -> None:
    """Run an experiment once more, and say which results are not the same, sign for sign."""
    at = where(on, workers, scheduler)
    try:
        plan = read_plan(folder)
        old = {job.name: result_of(folder, job) for job in jobs_of(plan, Random)}
    except LabError as error:  # no folder of an experiment: a wrong word
        _fail(str(error), WRONG)
    place = next(p for k in count(1) if not (p := folder / f"again_{k}").exists())
    results = ((old[new.job], new) for new in _run(place, plan, at))
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
    # Imported late, here and below: dask takes half a second.
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

    work(asked, workers or processors())


def _run(folder: Path, plan: Plan, at: Where) -> list[Result]:
    try:
        results = run_plan(folder, plan, at)
    except KeyboardInterrupt:
        _fail(f"interrupted: go on with the same words and --folder {folder}", INTERRUPTED)
    for result in results:
        if result.code:
            why = (result.complained.strip() or result.said.strip()).splitlines()[-1:]
            typer.echo(f"{result.job} {' '.join(result.words)}: {result.code}: {''.join(why)}")
    typer.echo(f"{summary([result.code for result in results])}; {folder / RESULTS}")
    return results


def _bags(target: str) -> list[str]:
    """Return the recordings that a word means; * stands for anything, also within quotes."""
    found: list[str] = []
    for path in map(Path, sorted(glob(target)) or [target]):
        found += map(str, sorted(path.rglob("*.bag")) if path.is_dir() else [path])
    return [str(Path(path).resolve()) for path in dict.fromkeys(found)]


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
