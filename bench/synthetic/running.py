"""Let invented cells join a desk, each with a session, a token and a journal of its own."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import datetime, timezone
from typing import Annotated

import msgspec
import typer
from farm.bus_io import BusError, wait_for_desk
from farm.config import FarmConfig, load_farm
from farm.link.cell_link_io import CellLink
from farm.link.shown import ShownState, show
from farm.security.invitation_io import SecurityError, keys_folder
from farm.security.membership_io import as_member
from farm.wire import Answer, Command
from scara_config import ConfigError

from bench.synthetic.invented import Invented, InventedJournal
from farm import keys
from scara_msgs.msg import TwinControllerState

MODES = {"STOP": TwinControllerState.STOPPED, "PAUSE": TwinControllerState.PAUSED}
PRACTICE = "practice"
REST_S = 20.0
"""Our choice: so long an invented cell stays stopped."""


@dataclass
class Running:
    """One invented cell that runs."""

    cell: Invented
    shown: ShownState
    clock: Callable[[], float]
    link: CellLink | None = None
    stopped: str = ""
    until: float = 0.0
    watched: bool = False

    def obey(self, command: Command) -> Answer:
        """Do what a twin controller would do."""
        self.stopped, self.until = MODES.get(command.command, ""), self.clock() + REST_S
        return Answer(True, f"{command.command} received")

    def look(self, somebody: bool) -> None:
        """Take in whether somebody looks at the joints."""
        self.watched = somebody

    def show(self) -> None:
        """Show the cell, and its joints if somebody looks."""
        now = self.clock()
        if now > self.until:
            self.stopped = ""
        self.shown, state = show(self.shown, self.cell.pair(now, self.stopped), remote=False)
        if self.link is not None:
            self.link.show(state)
            if self.watched:
                self.link.show_joints(self.cell.joints(now))


class Practice:
    """Several invented cells in this process; a context manager."""

    def __init__(
        self,
        config: FarmConfig,
        machine: str,
        cells: Sequence[Invented],
        events_until: int = 0,
        ahead_s: float = 0.0,
    ) -> None:
        """Make the cells, with a clock that is ahead; :meth:`join` brings them to the desk."""
        self._config, self._machine, self._until = config, machine, events_until
        self._clock: Callable[[], float] = lambda: time.time() + ahead_s
        self._cells = [Running(cell, ShownState(int(self._clock())), self._clock) for cell in cells]
        self.ended = threading.Event()
        self._ends = ExitStack()

    def __enter__(self) -> Practice:
        return self

    def __exit__(self, *_: object) -> None:
        self.ended.set()
        self._ends.close()

    def join(self) -> bool:
        """Wait for the desk, and join it with all cells; return whether all are there."""
        for each in self._cells:
            session = wait_for_desk(self._config.router, self._config.lease_ms, self.ended)
            if session is None:
                return False
            name = keys.checked(self._config.site, self._machine, each.cell.name)
            journal = InventedJournal(each.cell, self._clock, self._until)
            self._ends.enter_context(session)
            each.link = self._ends.enter_context(
                CellLink(
                    session,
                    name,
                    self._config.link,
                    journal,
                    each.obey,
                    each.look,
                    clock=self._clock,
                )
            )
        return True

    def run(self, rate_hz: float, seconds: float) -> int:
        """Show all cells at a rate; return how many states were put."""
        count, begun = 0, time.monotonic()
        due = begun
        while not self.ended.is_set() and (not seconds or due - begun < seconds):
            for number, each in enumerate(self._cells):
                # Cells of a farm do not send at the same instant.
                offset = number / (len(self._cells) * rate_hz)
                if (left := due + offset - time.monotonic()) > 1e-3:
                    time.sleep(left)
                each.show()
                count += 1
            due += 1.0 / rate_hz
        return count


app = typer.Typer(add_completion=False, rich_markup_mode=None)


@app.command()
def practise(
    cells: Annotated[
        int, typer.Option("--cells", "--synthetic", help="How many.", min=1, max=10_000)
    ] = 20,
    rate: Annotated[float, typer.Option(help="States a second of each.", min=0.1, max=100)] = 5.0,
    events_rate: Annotated[
        float, typer.Option(help="Events a second of each.", min=0.001, max=1000)
    ] = 0.2,
    events_until: Annotated[
        int, typer.Option(help="Each journal ends at this number; 0: never.", min=0)
    ] = 0,
    begin: Annotated[
        float | None,
        typer.Option(help="When the journals began [s since 1970]. Default: a minute ago."),
    ] = None,
    first: Annotated[int, typer.Option(help="Number of the first cell.", min=0)] = 0,
    drifting: Annotated[
        int, typer.Option(help="Number of a cell whose lag grows; -1: none.", min=-1)
    ] = -1,
    ahead: Annotated[
        float, typer.Option("--clock-ahead", help="Their clock is ahead by so much [s].")
    ] = 0.0,
    seconds: Annotated[float, typer.Option(help="How long; 0: until Ctrl-C.", min=0.0)] = 0.0,
    machine: Annotated[
        str | None,
        typer.Option(help="Their machine's name. Default: as it has joined, or practice."),
    ] = None,
    router_port: Annotated[
        int | None,
        typer.Option(
            help="Of a desk here. Default: the farm that was joined, or farm.yaml.",
            min=1,
            max=65535,
        ),
    ] = None,
) -> None:
    """Let invented cells join a desk: to practise, to test, to measure."""
    began = time.time() - 60.0 if begin is None else begin
    try:
        config = load_farm()
        if router_port is not None:
            replace = msgspec.structs.replace
            config = replace(config, router=replace(config.router, port=router_port))
        else:
            config = as_member(config, keys_folder(os.environ), datetime.now(timezone.utc))
        made = [
            Invented(first + k, began, events_rate, first + k == drifting) for k in range(cells)
        ]
        named = machine or config.machine or PRACTICE
        with Practice(config, named, made, events_until, ahead) as practice:
            for number in (signal.SIGINT, signal.SIGTERM):
                signal.signal(number, lambda *_: practice.ended.set())
            typer.echo(f"practice: {cells} invented cells look for {config.router.endpoint}")
            if practice.join():
                typer.echo("practice: all have joined")
                typer.echo(f"practice: {practice.run(rate, seconds)} states put")
    except (BusError, ConfigError, SecurityError, keys.CellNameError) as error:
        typer.echo(f"practice: {error}", err=True)
        raise typer.Exit(2) from None


def main() -> None:
    """Run the command line."""
    app(prog_name="python -m bench.synthetic")
