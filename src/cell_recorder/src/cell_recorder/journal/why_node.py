"""``rosrun cell_recorder why``: tell what stopped a cell and why, from its journal.

No cell needs to run and no ROS master: the files are all it reads. Exit code: 0, also if nothing
happened; 2 there is no such journal, or an option is wrong.
"""

from __future__ import annotations

import os
import sys
from datetime import datetime
from itertools import chain
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from scara_ros.names import cell_of
from scara_ros.shell.command_line_io import CommandLine
from scara_ros.shell.program_io import WRONG, runs_folder

from cell_recorder.journal.entries import KINDS, AnyEntry, encode
from cell_recorder.journal.reader_io import JOURNAL, journals, read, read_between
from cell_recorder.journal.since import ALLOWED, Since, SinceError, parse_since
from cell_recorder.journal.story import StoryLine, duration, is_stop, is_told, local_time, tell

NOW = 4e9  # later than any entry [s], Unix time
STYLES = {"error": "red", "warning": "yellow", "gap": "yellow", "torn": "yellow"}


class NoJournalError(ValueError):
    """There is no such journal; the text names those that are there."""


class KindError(ValueError):
    """There are no entries of such a kind."""


app = CommandLine(
    "why",
    {SinceError: WRONG, NoJournalError: WRONG, KindError: WRONG},
    rich_markup_mode=None,
)


@app.command(help=__doc__.split("\n\n")[0])
def why(
    since: Annotated[str, typer.Option(help=f"From when on: {ALLOWED}.")] = "24h",
    stops: Annotated[
        bool, typer.Option("--stops", help="Show what stopped the cell only.")
    ] = False,
    kind: Annotated[
        list[str] | None, typer.Option(help=f"Show this kind only, one of {', '.join(KINDS)}.")
    ] = None,
    everything: Annotated[
        bool, typer.Option("--all", help="Show the audit too: who asked for what, and was obeyed.")
    ] = False,
    as_json: Annotated[
        bool, typer.Option("--json", help="Print the entries as they are, one a line.")
    ] = False,
    name: Annotated[
        str | None,
        typer.Option(help="Of the cell. Default: ROS_NAMESPACE, else the only one, else cell."),
    ] = None,
    runs: Annotated[
        Path | None, typer.Option(help="Folder of the runs. Default: runs of the workspace.")
    ] = None,
) -> None:
    """Print the story of a cell."""
    # The kinds that are asked for
    words = kind or []
    if unknown := sorted(set(words) - set(KINDS)):
        raise KindError(f"--kind {unknown[0]}: is none of {', '.join(KINDS)}")
    kinds = frozenset(words)
    begin = parse_since(since, datetime.now())
    cell, folder = choose_journal(runs_folder(runs), name)
    entries = list(chain(wanted(folder, begin)))
    if as_json:
        for entry in entries:
            if (not kinds or entry.kind in kinds) and (not stops or is_stop(entry)):
                sys.stdout.write(encode(entry).decode())
        return
    console = Console(highlight=False, soft_wrap=True)
    told = entries if everything or "audit" in kinds else [e for e in entries if is_told(e)]
    shown = [line for line in tell(of_kinds(told, kinds), stops)]
    for line in shown:
        print_line(console, line)
    count = sum(line.times for line in shown if line.is_stop)
    stopped = f"{count} stop{'s' if count != 1 else ''}" if count else "no stop"
    console.print(f"{cell}: {stopped} in {len(entries)} entries since {since}", style="bold")


def of_kinds(entries: list[AnyEntry], kinds: frozenset[str]) -> list[AnyEntry]:
    """Leave out what is of another kind; no kind: all."""
    return [entry for entry in entries if not kinds or entry.kind in kinds]


def choose_journal(runs: Path, name: str | None) -> tuple[str, Path]:
    """Return name and folder of the journal that is meant.

    Raises:
        NoJournalError: There is none, or several and none is named.
    """
    found = journals(runs)
    named = name or os.environ.get("ROS_NAMESPACE", "").strip("/")
    wanted = cell_of(named) if named else (next(iter(found)) if len(found) == 1 else "cell")
    if wanted in found:
        return wanted, found[wanted]
    there = f"there are journals of {', '.join(found)}: say --name" if found else "there is none"
    raise NoJournalError(
        f"no journal of {wanted} in {runs / JOURNAL}: {there}; ./cell up writes one, --runs names "
        "another folder"
    )


def wanted(folder: Path, since: Since) -> list[AnyEntry]:
    """Return the entries from a time or a number on; what cannot be read is told."""

    def bad(text: str) -> None:
        print(f"why: {text}", file=sys.stderr)

    try:
        if since.number:
            return list(read(folder, since.number - 1, bad))
        return list(read_between(folder, since.time, NOW, bad))
    except OSError as error:
        raise NoJournalError(f"{error.filename}: {error.strerror}") from error


def print_line(console: Console, line: StoryLine) -> None:
    """Print one thing that happened."""
    times = f"{line.times} x " if line.times > 1 else ""
    numbers = f"#{line.first}" if line.times == 1 else f"#{line.first} to #{line.last}"
    style = "bold red" if line.is_stop else STYLES.get(line.what, "bold")
    text = f"{local_time(line.begun, None)}  {numbers:6}  [{style}]{times}{escape(line.what)}[/]"
    text += f"  {escape(line.words)}"
    if line.who:
        text += escape(f"  (asked by {line.who})")
    if line.times > 1:
        text += f"  the last {duration(max(0.0, line.ended - line.begun))} later"
    if line.outcome:
        text += f"  -> {escape(line.outcome)}"
    console.print(text)


main = app.run
