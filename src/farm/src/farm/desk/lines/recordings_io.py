"""``./cell farm recordings | fetch``: the recordings of cells, from the cells themselves."""

from __future__ import annotations

from datetime import datetime
from pathlib import Path
from typing import Annotated

import typer
import zenoh
from rich.progress import Progress
from scara_ros.shell.program_io import FAILED

from farm import keys
from farm.config import FarmConfig
from farm.desk.command_line_io import (
    CONNECT_S,
    Folder,
    RouterPort,
    app,
    configured,
    events_folder,
    fail,
    open_session,
    print_table,
)
from farm.desk.commands_io import cells_there
from farm.desk.fetching_io import FetchError, fetch, recordings_of
from farm.keys import CellName

CellWord = Annotated[str, typer.Argument(help="CELL, or MACHINE/CELL.")]


@app.command()
def recordings(
    cell: Annotated[str, typer.Argument(help="all, CELL, or MACHINE/CELL.")] = "all",
    limit: Annotated[int, typer.Option(help="The newest so many of each cell.", min=1)] = 20,
    router_port: RouterPort = None,
) -> None:
    """List the recordings that cells have."""
    config = configured(router_port)
    rows: list[tuple[object, ...]] = []
    with open_session(config) as session:
        for name in _chosen(config, session, cell):
            try:
                listed = recordings_of(session, name)
            except FetchError as error:
                typer.echo(f"farm: {error}", err=True)
                continue
            for each in listed[:limit]:
                when = datetime.fromtimestamp(each.modified / 1e9).strftime("%Y-%m-%d %H:%M:%S")
                rows.append((name, each.name, f"{each.size / 1e6:.1f} MB", when))
    print_table(("cell", "recording", "size", "changed"), rows)
    typer.echo(f"{len(rows)} recordings")


@app.command("fetch")
def fetch_recording(
    cell: CellWord,
    name: Annotated[str, typer.Argument(help="Of the recording, as listed.")],
    folder: Folder = None,
    router_port: RouterPort = None,
) -> None:
    """Fetch a recording into the desk's data; one that was interrupted goes on where it was."""
    config = configured(router_port)
    if cell == "all":
        fail("all: name one cell", FAILED)
    with open_session(config) as session:
        (owner,) = _chosen(config, session, cell)
        target = events_folder(folder).parent / "recordings" / owner.machine / owner.cell / name
        listed = {each.name: each for each in recordings_of(session, owner)}
        if name not in listed:
            fail(f"{owner}: {name}: no such recording: ./cell farm recordings {owner}", FAILED)
        # The name is the cell's own word: it must not lead out of the desk's data.
        if ".." in Path(name).parts or Path(name).is_absolute():
            fail(f"{owner}: {name}: is no name of a recording", FAILED)
        with Progress(transient=True) as progress:
            bar = progress.add_task(name, total=listed[name].size)
            fetch(
                session,
                owner,
                listed[name],
                target,
                lambda there: progress.update(bar, completed=there),
            )
    typer.echo(f"{target}: {listed[name].size} bytes")


def _chosen(config: FarmConfig, session: zenoh.Session, word: str) -> list[CellName]:
    return keys.choose(word, cells_there(session, config.site, CONNECT_S))
