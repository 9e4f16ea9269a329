"""``./cell farm rollout``: give cells a change of their configuration, one first, then the rest."""

from __future__ import annotations

import time
import uuid
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated

import msgspec
import typer
import zenoh
from ruamel.yaml import YAML
from ruamel.yaml.error import YAMLError
from scara_config.rollout.change import Change, ChangeError, change_of
from scara_ros.shell.program_io import FAILED, WRONG

from farm import keys
from farm.config import FarmConfig
from farm.desk.command_line_io import (
    Person,
    RouterPort,
    app,
    configured,
    desk_name,
    fail,
    open_session,
    person_name,
    roster_rows,
)
from farm.desk.commands_io import ask
from farm.desk.rollout import Do, next_step
from farm.desk.roster import Row
from farm.keys import CellName
from farm.wire import Command, Configuration

ANSWER_S = 30.0
"""Our choice: a cell's doctor takes some seconds, and comes after everything else there."""
LOOK_S = 1.0
"""Our choice: so often the cells are looked at."""


@app.command()
def rollout(
    change: Annotated[Path, typer.Argument(help="YAML: name, and values by file and key.")],
    cells: Annotated[
        list[str] | None,
        typer.Option("--cells", help="CELL or MACHINE/CELL, again for each; default: all."),
    ] = None,
    first: Annotated[str, typer.Option(help="The one that gets it first.")] = "",
    wait: Annotated[
        float, typer.Option(help="The first has to be well for so long [s].", min=0.0)
    ] = 600.0,
    check: Annotated[
        bool, typer.Option("--check", help="Let each cell look at it, and change nothing.")
    ] = False,
    take_back: Annotated[
        bool, typer.Option("--take-back", help="Cells that have it go back to what held before.")
    ] = False,
    router_port: RouterPort = None,
    person: Person = None,
) -> None:
    """Give cells a change of their configuration; it holds from each cell's next start on.

    All cells look at it first. One gets it, then this waits until that one was started anew and
    was well for a while, then the rest get it. Ctrl-C leaves it as it is; the same words go on.
    """
    config = configured(router_port)
    asking = Asking(person_name(person), desk_name(), config.desk.expiry_ms * 1e-3)
    wanted = read_change(change)
    with open_session(config) as session:
        chosen = _chosen(config, session, cells or ["all"], first)
        if take_back:
            ended = asking.put(session, chosen, _rows(config, session), "TAKE_BACK", wanted)
            raise typer.Exit(0 if ended else FAILED)
        if not asking.put(session, chosen, _rows(config, session), "EXAMINE", wanted):
            fail("a cell does not take it: nothing was changed", FAILED)
        if check:
            return

        def offer(names: Sequence[str], rows: dict[str, Row]) -> bool:
            to = [cell for cell in chosen if str(cell) in names]
            return asking.put(session, to, rows, "CONFIGURE", wanted)

        well = _roll(config, session, chosen, wanted, wait, offer)
    raise typer.Exit(0 if well else FAILED)


def read_change(file: Path) -> Change:
    """Return the change in a file, or end with a text."""
    try:
        return change_of(YAML(typ="safe").load(file.read_text(encoding="utf-8")))
    except OSError as error:
        fail(f"{file}: cannot be read: {error.strerror}", WRONG)
    except YAMLError as error:
        fail(f"{file}: is no valid YAML: {' '.join(str(error).split())}", WRONG)
    except ChangeError as error:
        fail("\n      ".join(f"{file}: {line}" for line in str(error).splitlines()), WRONG)


class Asking(msgspec.Struct, frozen=True):
    """Who asks, from where, and how long the question is good [s]."""

    person: str
    desk: str
    expiry_s: float

    def put(
        self,
        session: zenoh.Session,
        cells: Sequence[CellName],
        rows: dict[str, Row],
        word: str,
        change: Change,
    ) -> bool:
        """Ask cells, print what each answers, and return whether all have accepted."""
        now = time.time()
        asked = {}
        for cell in cells:
            row = rows.get(str(cell))
            shown = (row.configuration if row is not None else None) or Configuration()
            asked[cell] = Command(
                uuid.uuid4().hex,
                word,
                self.person,
                self.desk,
                now + self.expiry_s,
                revision=shown.number,
                change=change,
                asked=now,
            )
        good = True
        for answered in ask(session, asked, ANSWER_S, zenoh.Priority.DATA):
            typer.echo(f"{word} {answered.text}")
            good &= answered.answer is not None and answered.answer.accepted
        return good


def _roll(
    config: FarmConfig,
    session: zenoh.Session,
    chosen: Sequence[CellName],
    change: Change,
    wait_s: float,
    offer: Callable[[Sequence[str], dict[str, Row]], bool],
) -> bool:
    """Go on step by step until all cells run with the change; return whether they do."""
    names, said = [str(cell) for cell in chosen], ""
    since: float | None = None
    # Of who was asked or has it: a later one without it is that of somebody who took it back.
    asked: dict[str, Configuration] = {}
    while True:
        rows = _rows(config, session)
        now = time.monotonic()
        step, since = next_step(change.text, names, rows, since, wait_s, now, asked)
        # What a cell shows of it comes with its next health message: it is asked once.
        fresh = [name for name in step.cells if name not in asked]
        if step.text != said and (fresh or not step.cells):
            said = step.text
            typer.echo(f"{change.name}: {said}")
        if step.do is Do.DONE:
            return True
        if step.do is Do.END or (fresh and not offer(fresh, rows)):
            typer.echo("It ends here. To go back: ./cell farm rollout FILE --take-back")
            return False
        for name in names:
            shown = rows[name].configuration or Configuration()
            if name in fresh or shown.wanted == change.text:
                asked[name] = shown
        time.sleep(LOOK_S)


def _rows(config: FarmConfig, session: zenoh.Session) -> dict[str, Row]:
    rows = roster_rows(config, session)
    if rows is None:
        fail("the desk does not answer, though its router is there", FAILED)
    return {row.name: row for row in rows}


def _chosen(
    config: FarmConfig, session: zenoh.Session, words: Sequence[str], first: str
) -> list[CellName]:
    """Return the cells that are meant, the first one first."""
    there = [CellName(config.site, *name.split("/", 1)) for name in _rows(config, session)]
    chosen = dict.fromkeys(cell for word in words for cell in keys.choose(word, there))
    ahead = dict.fromkeys(keys.choose(first, list(chosen))) if first else {}
    return [*ahead, *(cell for cell in chosen if cell not in ahead)]
