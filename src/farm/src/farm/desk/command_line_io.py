"""Command line of ``./cell farm``: the desk, and the same questions as text.

Exit code: 0 all well; 1 a cell refused, did not answer or was not reached, or nobody is there; 2 a
wrong word.
"""

from __future__ import annotations

import getpass
import os
import socket
import time
from collections.abc import Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import Annotated, NoReturn

import msgspec
import typer
import zenoh
from scara_config import ConfigError
from scara_ros.page.page_words import people
from scara_ros.shell.command_line_io import CommandLine
from scara_ros.shell.program_io import FAILED, WRONG, runs_folder

from farm import keys
from farm.bus_io import BusError, open_client
from farm.config import FarmConfig, ReachedError, load_farm, reached
from farm.desk.fetching_io import FetchError
from farm.desk.questions import QuestionError, Wanted, causes, query, since, table
from farm.desk.reading_io import AskingError, ask
from farm.desk.roster import LOST, Row, clock_warning, differs, not_reached, status_title
from farm.security.access import Role
from farm.security.invitation_io import SecurityError, keys_folder

CONNECT_S = 1.0
"""Our choice: a desk on this machine answers within milliseconds."""
Folder = Annotated[Path | None, typer.Option(help="The desk's data. Default: runs/farm.")]
RouterPort = Annotated[
    int | None, typer.Option(help="Of the router. Default: farm.yaml.", min=1, max=65535)
]
Person = Annotated[
    str | None, typer.Option(help="Who asks, for the cells' audits. Default: who is logged in.")
]
CellWord = Annotated[str, typer.Argument(help="all, CELL, or MACHINE/CELL.")]

app = CommandLine(
    "farm",
    {
        **dict.fromkeys((QuestionError, ConfigError, SecurityError, ReachedError), WRONG),
        keys.CellNameError: WRONG,
        **dict.fromkeys((AskingError, BusError, FetchError, keys.ChoiceError), FAILED),
    },
    rich_markup_mode=None,
    help="Many cells in one view. Without a word: start the desk.",
)


def fail(text: str, code: int) -> NoReturn:
    """Say what is wrong, and end."""
    typer.echo(f"farm: {text}", err=True)
    raise typer.Exit(code)


@app.callback(invoke_without_command=True)
def desk(
    context: typer.Context,
    folder: Folder = None,
    port: Annotated[
        int | None, typer.Option(help="Of the page. Default: farm.yaml.", min=1, max=65535)
    ] = None,
    router_port: RouterPort = None,
    person: Person = None,
    page: Annotated[
        bool, typer.Option(help="Serve the page; --no-page: only router and history.")
    ] = True,
    listen: Annotated[
        str,
        typer.Option(help="HOST[:PORT] for invited machines; without it only this machine."),
    ] = "",
) -> None:
    """Start router and desk, and keep them until Ctrl-C; the page's address is the last line."""
    if context.invoked_subcommand is not None:
        return
    from farm.desk.running_io import DeskStartError, run

    config = configured(router_port, port)
    try:
        outside = reached(listen) if listen else None
    except ReachedError as error:
        fail(f"--listen {error}", WRONG)
    try:
        run(config, _folder(folder), (person_name(person), desk_name()), page, outside)
    except DeskStartError as error:
        fail(str(error), WRONG)


@app.command()
def cells(router_port: RouterPort = None) -> None:
    """List the cells, the worst first."""
    config = configured(router_port)
    with open_session(config) as session:
        rows = roster_rows(config, session)
    if rows is None:
        fail("the desk does not answer, though its router is there", FAILED)
    lines = [
        (
            r.name,
            _status(r),
            people(r.text),
            "" if r.clock_s is None else f"{r.clock_s:+.1f} s",
            r.last_event,
            r.missing or "",
            differs(r.configuration),
        )
        for r in rows
    ]
    names = ("cell", "status", "why", "clock", "events", "missing", "configuration")
    print_table(names, lines)
    for row in rows:
        if why := clock_warning(row.clock_s):
            typer.echo(f"{row.name}: {why}", err=True)
    typer.echo(f"{len(rows)} cells, {sum(row.status == LOST for row in rows)} lost")


@app.command()
def events(
    stops: Annotated[bool, typer.Option("--stops", help="Only what stopped a pair.")] = False,
    since_text: Annotated[
        str, typer.Option("--since", help="today, yesterday, 30m, 12h, 2d, or a date and time.")
    ] = "",
    cell: Annotated[str, typer.Option(help="Only of CELL or MACHINE/CELL.")] = "",
    kind: Annotated[
        str, typer.Option(help="Only decision, audit, alarm, cycle, start, gap, torn or exercise.")
    ] = "",
    by_cause: Annotated[
        bool, typer.Option("--by-cause", help="Count them by their cause, the most frequent first.")
    ] = False,
    limit: Annotated[int, typer.Option(help="So many at most.", min=1, max=1_000_000)] = 100,
    folder: Folder = None,
) -> None:
    """List events that the desk has kept; times in UTC. It needs no running desk."""
    begin = since(since_text, datetime.now()) if since_text else None
    asked = causes if by_cause else query
    _ask_history(_folder(folder), *asked(Wanted(begin, cell, kind, stops, limit)))


@app.command()
def sql(
    statement: Annotated[
        str, typer.Argument(help='One SELECT of "events"; views: caused, cycles.')
    ],
    folder: Folder = None,
) -> None:
    """Ask the history in SQL; nothing can be changed by it. It needs no running desk."""
    _ask_history(_folder(folder), statement, [])


@app.command()
def stop(cell: CellWord, router_port: RouterPort = None, person: Person = None) -> None:
    """Send STOP and show what each cell answers."""
    _order("STOP", cell, router_port, person)


@app.command()
def pause(cell: CellWord, router_port: RouterPort = None, person: Person = None) -> None:
    """Send PAUSE and show what each cell answers."""
    _order("PAUSE", cell, router_port, person)


def _order(command: str, word: str, router_port: int | None, person: str | None) -> None:
    from farm.desk.commands_io import cells_there, order

    config = configured(router_port)
    with open_session(config) as session:
        chosen = keys.choose(word, cells_there(session, config.site, CONNECT_S))
        bad, expiry = 0, config.desk.expiry_ms * 1e-3
        for answered in order(session, chosen, command, person_name(person), desk_name(), expiry):
            typer.echo(f"{command} {answered.text}")
            bad += answered.answer is None or not answered.answer.accepted
        # The desk may be slow or gone: it is asked last, and only who asks all has to know.
        rows = roster_rows(config, session) if word == "all" else []
    lost = not_reached(rows or (), chosen)
    for row in lost:
        typer.echo(f"{command} {row.name}: NOT REACHED: {_status(row)}")
    away = f", {len(lost)} not reached" if rows else ""
    typer.echo(f"{len(chosen)} cells asked, {bad} did not accept{away}")
    if rows is None:
        fail("the desk does not answer: who is lost is not known", FAILED)
    raise typer.Exit(FAILED if bad or lost else 0)


def _ask_history(folder: Path, statement: str, values: list[object]) -> None:
    found = ask(folder / "events", statement, values)
    print_table(found.names, found.rows)
    typer.echo(f"{len(found.rows)} rows")


def print_table(names: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    """Print an answer."""
    for line in table(names, rows):
        typer.echo(line)


def roster_rows(config: FarmConfig, session: zenoh.Session) -> list[Row] | None:
    """Return the desk's rows; None: it does not answer."""
    for reply in session.get(f"{config.site}/{keys.ROSTER}", timeout=CONNECT_S):
        if reply.ok is not None:
            return msgspec.json.decode(bytes(reply.ok.payload), type=list[Row])
    return None


def _status(row: Row) -> str:
    # The desk may be on another machine, and its clock ahead of this one's.
    seconds = max(0.0, time.time() - row.since)
    since_when = datetime.fromtimestamp(row.since).strftime("%Y-%m-%d %H:%M:%S")
    return f"{status_title(row.status)} for {seconds:.0f} s, since {since_when}"


def open_session(config: FarmConfig) -> zenoh.Session:
    """Connect to the desk, or end with a text."""
    from farm.security.membership_io import as_member, joined

    try:
        member = joined(keys_folder(os.environ))
        if member is not None and config == configured(None):  # no other router was asked for
            if member.role is not Role.DESK:
                fail(
                    f"this machine has joined as machine {member.name}: it shows its cells and "
                    "asks nobody. Ask at the desk, or come in by an invitation with --desk",
                    FAILED,
                )
            config = as_member(config, keys_folder(os.environ), datetime.now(timezone.utc))
    except SecurityError as error:
        # Elsewhere it is a wrong word; whoever only asks has named no certificate.
        fail(str(error), FAILED)
    return open_client(config.router, config.lease_ms, CONNECT_S)


def configured(router_port: int | None, port: int | None = None) -> FarmConfig:
    """Return farm.yaml with the options of the command line.

    Raises:
        ConfigError: It cannot be read.
    """
    config = load_farm()
    replace = msgspec.structs.replace
    if router_port is not None:
        config = replace(config, router=replace(config.router, port=router_port))
    if port is not None:
        config = replace(config, desk=replace(config.desk, port=port))
    return config


def _folder(folder: Path | None) -> Path:
    return (folder or runs_folder() / "farm").resolve()


def events_folder(folder: Path | None) -> Path:
    """Return the folder of the history."""
    return _folder(folder) / "events"


def person_name(given: str | None) -> str:
    """Return who asks, in the form that a cell takes."""
    try:
        name = keys.as_name(given if given is not None else getpass.getuser())
    except (KeyError, OSError):  # no such user in a container
        name = "somebody"
    return name or "somebody"


def desk_name() -> str:
    """Return this machine's name, in the form that a cell takes."""
    return keys.as_name(socket.gethostname()) or "desk"
