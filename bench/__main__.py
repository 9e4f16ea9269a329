"""Command line of ``./cell bench``: the rows of the table, or the campaigns that take long.

A campaign is a function that takes :class:`Options` and returns rows; put it into ``SECTIONS`` to
make it an option. A row is a function of a module in ``bench/rows``.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

import typer  # noqa: E402
from harness.faults.rows import Row  # noqa: E402
from harness.workspace import enter_workspace  # noqa: E402
from rich.console import Console  # noqa: E402
from rich.table import Table  # noqa: E402

from bench.journal import JournalError, unfinished  # noqa: E402


@dataclass(frozen=True)
class Options:
    """What the user asked for; None is the campaign's own choice."""

    seeds: int | None
    minutes: float | None
    folder: Path
    console: Console
    first: int = 0
    scene: int | None = None
    rows: tuple[str, ...] = ()
    draws: int = 0
    scaras: int = 0


def _faults(options: Options) -> list[Row]:
    from bench.faults import run

    minutes = 60.0 if options.minutes is None else options.minutes
    return run(_seeds(options), minutes, options.folder, options.console)


def _storm(options: Options) -> list[Row]:
    from bench.storm import Seeds, run

    minutes = 6.0 if options.minutes is None else options.minutes
    seeds = Seeds(_seeds(options, 10), minutes, options.first, options.scene)
    return run(seeds, options.folder, options.console)


def _variations(options: Options) -> list[Row]:
    from bench.variations import run

    return run(options.folder, options.console)


def _demos(options: Options) -> list[Row]:
    from bench.demos import run

    return run(_seeds(options), options.first, options.rows, options.folder, options.console)


def _day(options: Options) -> list[Row]:
    from bench.recording_day import run

    minutes = 1440.0 if options.minutes is None else options.minutes
    return run(minutes / 60.0, options.folder, options.console)


def _plants(options: Options) -> list[Row]:
    if options.draws:
        from bench.draws import run as run_draws

        return run_draws(options.draws, options.first, options.console)
    if options.scaras:
        from bench.scaras import run as run_scaras

        return run_scaras(options.scaras, options.first, options.console)
    from bench.plants import run

    return run(options.folder, options.console)


def _what_if(options: Options) -> list[Row]:
    from bench.what_if import run

    return run(_seeds(options, 1000), options.rows, options.folder, options.console)


def _farm(options: Options) -> list[Row]:
    from bench.farm import run

    share = 1.0 if options.minutes is None else options.minutes
    return run(share, options.rows, options.folder, options.console)


def _health(options: Options) -> list[Row]:
    from bench.health import run

    return run(_seeds(options, 12), options.first, options.rows, options.console)


def _first_start(options: Options) -> list[Row]:
    from bench.first_start import run

    return run(options.folder, options.console)


def _seeds(options: Options, default: int = 20) -> int:
    return default if options.seeds is None else options.seeds


SECTIONS: dict[str, Callable[[Options], list[Row]]] = {
    "faults": _faults,
    "storm": _storm,
    "variations": _variations,
    "demos": _demos,
    "day": _day,
    "health": _health,
    "plants": _plants,
    "what_if": _what_if,
    "farm": _farm,
    "first_start": _first_start,
}


def main(
    rows: Annotated[
        list[str] | None, typer.Argument(help="Rows to measure, by name; default: all of them.")
    ] = None,
    faults: Annotated[
        bool, typer.Option("--faults", help="The long fault campaign instead.")
    ] = False,
    storm: Annotated[
        bool,
        typer.Option(
            "--storm", help="Random commands and faults at once, each seed for --minutes."
        ),
    ] = False,
    variations: Annotated[
        bool,
        typer.Option(
            "--variations", help="The experiments under other speeds, models, delays instead."
        ),
    ] = False,
    demos: Annotated[
        bool,
        typer.Option(
            "--demos",
            help="The demo on ideal and on drawn robots, --seeds times each, all or ROW ... "
            "(kit_ideal_50 kit_drawn_50); bench/tables.txt.",
        ),
    ] = False,
    day: Annotated[
        bool,
        typer.Option("--day", help="A day of recording in compressed time: the memory it takes."),
    ] = False,
    health: Annotated[
        bool,
        typer.Option(
            "--health",
            help="What wears, and whether it is found, all or PART ... (wear robots varied several "
            "baselines runs), on --seeds robots (12); docs/operating/health.md.",
        ),
    ] = False,
    plants: Annotated[
        bool,
        typer.Option("--plants", help="The experiments on robots that were made different."),
    ] = False,
    what_if: Annotated[
        bool,
        typer.Option(
            "--what-if",
            help="The second world, all or PART ... (programs clearance wire doors cycles "
            "chance_part chance_pallet chance_person speed beside), --seeds of each; "
            "bench/tables.txt.",
        ),
    ] = False,
    farm: Annotated[
        bool,
        typer.Option(
            "--farm",
            help="Many cells under one desk, all or PART ... (many crowd seen calm frozen restarts "
            "stop wrong month pages jobs machines); bench/tables.txt.",
        ),
    ] = False,
    first_start: Annotated[
        bool,
        typer.Option(
            "--first-start", help="A first start on a bare Debian 12: needs root and debootstrap."
        ),
    ] = False,
    seeds: Annotated[
        int | None,
        typer.Option(
            help="Faults: how often each is done, each time otherwise (20). Storm: so many (10). "
            "What-if: so many programs, poses, commands (1000).",
            min=0,
        ),
    ] = None,
    minutes: Annotated[
        float | None,
        typer.Option(
            help="Faults: of random faults, at most 10 of noise (60). Storm: of a seed (6). "
            "Day: of recording (1440). Farm: share of the whole, which it keeps no figures of (1).",
            min=0.0,
        ),
    ] = None,
    first: Annotated[int, typer.Option(help="Storm, draws, demos: the first seed.", min=0)] = 0,
    draws: Annotated[
        int, typer.Option(help="Plants: so many drawn by seeds instead, of each robot.", min=0)
    ] = 0,
    scaras: Annotated[
        int, typer.Option(help="Plants: so many SCARAs of random sizes instead.", min=0)
    ] = 0,
    scene: Annotated[
        int | None, typer.Option(help="Storm: only this scene of the first seed.", min=0)
    ] = None,
    continued: Annotated[
        bool,
        typer.Option(
            "--continue", help="Faults, storm: go on with the last campaign that was ended."
        ),
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the result as JSON, progress to standard error.")
    ] = False,
    show: Annotated[bool, typer.Option("--list", help="Only list the rows.")] = False,
    write: Annotated[
        bool, typer.Option("--page", help="Only write the pages from bench/results.json.")
    ] = False,
    stops: Annotated[
        bool,
        typer.Option(
            "--stops", help="How stops end, by the robot's set-up: docs/operating/stops.md."
        ),
    ] = False,
    virtual: Annotated[
        bool, typer.Option("--virtual", help="The experiments in virtual time: ROBOT ... as rows.")
    ] = False,
    renew: Annotated[
        bool, typer.Option("--renew", help="Virtual: store the figures as the tests' baseline.")
    ] = False,
) -> None:
    """Measure, and compare with the goals.

    Exit code 0: all hold; 1: one does not; 2: no such row, or files that differ from the commit.
    """
    if not (show or write or (virtual and not renew)):
        _refuse_changes()
    if virtual:
        from harness.virtual_cell.__main__ import main as measure_virtual

        measure_virtual(rows, renew, as_json)
    if stops:
        from harness.stops.__main__ import main as measure_stops

        measure_stops()
        raise typer.Exit(0)
    console = Console(stderr=as_json)
    sections = (
        ("faults", faults),
        ("storm", storm),
        ("variations", variations),
        ("demos", demos),
        ("day", day),
        ("health", health),
        ("plants", plants),
        ("what_if", what_if),
        ("farm", farm),
        ("first_start", first_start),
    )
    chosen = [name for name, wanted in sections if wanted]
    enter_workspace()
    if write:
        from bench import page

        page.write(page.so_far())
        raise typer.Exit(0)
    if continued and chosen not in (["faults"], ["storm"]):
        typer.echo("--continue: allowed with --faults or --storm alone", err=True)
        raise typer.Exit(2)
    if chosen == ["demos"]:
        from bench.demos import NAMES

        _check_rows(rows, NAMES)
    if chosen == ["what_if"]:
        from bench.what_if import PARTS

        _check_rows(rows, tuple(PARTS))
    if chosen == ["health"]:
        from bench.health import PARTS as HEALTH_PARTS

        _check_rows(rows, tuple(HEALTH_PARTS))
    if chosen == ["farm"]:
        from bench.farm import PARTS as FARM_PARTS

        _check_rows(rows, tuple(FARM_PARTS))
    if show or not chosen:
        from bench.rows import names
        from bench.run import measure

        _check_rows(rows, names())
        if show:
            typer.echo("rows: " + " ".join(names()))
            raise typer.Exit(0)
    if not chosen:
        raise typer.Exit(0 if measure(rows or [], _folder(False), console, as_json) else 1)
    try:
        folder = _folder(continued, "storm" if chosen == ["storm"] else "bench")
        options = Options(
            seeds, minutes, folder, console, first, scene, tuple(rows or ()), draws, scaras
        )
        measured = [row for name in chosen for row in SECTIONS[name](options)]
    except JournalError as error:
        typer.echo(str(error), err=True)
        raise typer.Exit(2) from None
    text = json.dumps([row.record() for row in measured], indent=1)
    (folder / "bench.json").write_text(text + "\n", encoding="utf-8")
    console.print(table(measured))
    if as_json:
        print(text)
    broken = sum(not row.holds for row in measured)
    console.print(f"{len(measured)} rows, {broken} beyond their limit; {folder / 'bench.json'}")
    raise typer.Exit(1 if broken else 0)


def _refuse_changes() -> None:
    """End with exit code 2 where files differ from the commit: nobody could measure it again."""
    from bench.page import begun_at, changed

    begun_at()
    if found := changed():
        more = f" and {len(found) - 3} more" if len(found) > 3 else ""
        typer.echo(
            f"{', '.join(found[:3])}{more} differ from the commit: a figure is that of a commit. "
            "Commit first.",
            err=True,
        )
        raise typer.Exit(2)


def _check_rows(rows: list[str] | None, known: Sequence[str]) -> None:
    """End with exit code 2 where a row is not known."""
    unknown = sorted(set(rows or ()) - set(known))
    if unknown:
        lines = [f"no row is called {name}" for name in unknown]
        typer.echo("\n".join([*lines, "rows: " + " ".join(known)]), err=True)
        raise typer.Exit(2)


def _folder(continued: bool, kind: str = "bench") -> Path:
    """Return where results go: a new folder, or that of the campaign that is continued.

    Storms have a place of their own, so that none goes on in the folder of another campaign.
    """
    runs = ROOT / "runs" / kind
    if continued:
        return unfinished(runs)
    folder = runs / time.strftime("%Y-%m-%d_%H-%M-%S")
    folder.mkdir(parents=True)
    return folder


def table(rows: list[Row]) -> Table:
    """Lay rows of a campaign out for a person."""
    shown = Table(show_lines=False)
    for heading in ("case", "metric", "limit", "measured", "holds"):
        shown.add_column(heading, justify="right" if heading in ("limit", "measured") else "left")
    for row in rows:
        sign = "≥" if row.at_least else "≤"
        verdict = "[green]yes[/]" if row.holds else "[bold red]NO[/]"
        shown.add_row(
            row.fault,
            row.metric.replace("[", r"\["),
            f"{sign} {row.limit:.4g}",
            f"{row.measured:.4g}",
            verdict,
        )
    return shown


if __name__ == "__main__":
    typer.run(main)
