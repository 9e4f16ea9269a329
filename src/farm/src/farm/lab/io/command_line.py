"""Command line of ``./cell lab``: many jobs over bags, programs and points, all processors.

Exit code: 0 all jobs ended with 0, or an experiment repeated itself; 1 not; 2 a wrong word.
"""

from __future__ import annotations

import os
from datetime import datetime
from glob import glob
from itertools import count
from pathlib import Path
from random import Random
from typing import Annotated, NoReturn

import msgspec
import typer
from rich.progress import Progress

from farm.lab.io.running import (
    LabError,
    Result,
    begin,
    processors,
    program_of,
    read_plan,
    result_of,
    run,
)
from farm.lab.plan import OF_BAGS, PROGRAMS, Plan, PlanError, jobs_of, summary

FAILED, WRONG = 1, 2
Workers = Annotated[
    int | None, typer.Option(help="Jobs at a time. Default: one for each processor.", min=1)
]

app = typer.Typer(
    add_completion=False,
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
    ) -> None:
        _start(kind, targets, (variations, spread_mm, speed, seed), folder, workers)

    package, program = PROGRAMS[kind]
    app.command(kind, help=f"Run {program} of {package} over {what}.")(start)


for _kind in PROGRAMS:
    _add(_kind)


def _start(
    kind: str,
    targets: list[str],
    varied: tuple[int, float, str, int],
    folder: Path | None,
    workers: int | None,
) -> NoReturn:
    """Run an experiment; one that was interrupted goes on with the same words and folder."""
    if kind in OF_BAGS:
        targets = [bag for target in targets for bag in _bags(target)]
    words = ("--resting", "--json") if kind == "judge" else ()
    variations, spread_mm, speed, seed = varied
    try:
        plan = Plan(kind, tuple(targets), words, variations, spread_mm, _speeds(speed), seed)
        jobs_of(plan, Random)
    except (PlanError, ValueError) as error:
        _fail(str(error), WRONG)
    place = folder or _root() / "runs" / "lab" / datetime.now().strftime("%Y-%m-%d_%H-%M-%S")
    results = _run(place, plan, workers)
    raise typer.Exit(FAILED if any(result.code for result in results) else 0)


@app.command()
def again(
    folder: Annotated[Path, typer.Argument(help="Of an experiment that was run.")],
    workers: Workers = None,
) -> None:
    """Run an experiment once more, and say which results are not the same, sign for sign."""
    try:
        plan = read_plan(folder)
        old = {job.name: result_of(folder, job) for job in jobs_of(plan, Random)}
    except (LabError, PlanError) as error:
        _fail(str(error), WRONG)
    place = next(p for k in count(1) if not (p := folder / f"again_{k}").exists())
    other = [new for new in _run(place, plan, workers) if not _same(old[new.job], new)]
    for result in other:
        typer.echo(f"{result.job} {' '.join(result.words)}: not the same")
    typer.echo(f"{len(old) - len(other)} of {len(old)} results are the same")
    raise typer.Exit(FAILED if other else 0)


def _same(old: Result | None, new: Result) -> bool:
    return old is not None and (old.code, old.said) == (new.code, new.said)


def _run(folder: Path, plan: Plan, workers: int | None) -> list[Result]:
    jobs, devel = jobs_of(plan, Random), _root() / "devel"
    try:
        begin(folder, plan)
        with Progress(transient=True) as progress:
            bar = progress.add_task(plan.kind, total=len(jobs))
            results = run(
                folder,
                jobs,
                lambda job: program_of(job, devel),
                workers or processors(),
                lambda _: progress.advance(bar),
            )
        lines = b"".join(msgspec.json.encode(result) + b"\n" for result in results)
        (folder / "results.jsonl").write_bytes(lines)
    except LabError as error:
        _fail(str(error), FAILED)
    for result in results:
        if result.code:
            why = (result.complained.strip() or result.said.strip()).splitlines()[-1:]
            typer.echo(f"{result.job} {' '.join(result.words)}: {result.code}: {''.join(why)}")
    typer.echo(f"{summary([result.code for result in results])}; {folder / 'results.jsonl'}")
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
        ValueError: It is none.
    """
    if not text:
        return None
    low, _, high = text.partition("-")
    try:
        found = float(low), float(high or low)
    except ValueError:
        raise ValueError(f"--speed {text}: allowed is LOW-HIGH, for example 20-80") from None
    if not 0.0 < found[0] <= found[1] <= 100.0:
        raise ValueError(f"--speed {text}: allowed are 0 to 100 percent, the lower one first")
    return found


def _root() -> Path:
    return Path(os.environ.get("CELL_ROOT") or Path.cwd())


def main() -> None:
    """Run the command line."""
    app(prog_name="./cell lab")
