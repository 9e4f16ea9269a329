"""A desk and a link in this process, on a free port."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

import pytest
import zenoh
from farm.bus_io import open_client, open_router
from farm.config import FarmConfig, load_farm
from farm.desk.desk_io import Desk
from farm.desk.history_io import History
from farm.link.cell_link_io import CellLink
from farm.link.changes_io import CellChanges
from farm.link.recordings_io import RecordingFiles
from farm.wire import Answer, Command, Event, Events
from harness.processes import free_port
from harness.workspace import ROOT
from msgspec.structs import replace
from scara_ros.journal_files_io import JournalBounds

from farm import keys

CELL = keys.CellName("site", "m", "a")


@dataclass
class Journal:
    """A journal in memory."""

    events: list[Event] = field(default_factory=list)

    def add(self, count: int) -> None:
        """Let something happen."""
        last = len(self.events)
        new = range(last + 1, last + count + 1)
        self.events += [Event(n, float(n), "audit", False, f"event {n}", {"n": n}) for n in new]

    def bounds(self) -> JournalBounds:
        """Return oldest and newest number."""
        return JournalBounds(min(1, len(self.events)), len(self.events))

    def read(self, since: int, limit: int) -> Events:
        """Return the events after a number."""
        return Events(*self.bounds(), tuple(self.events[since : since + limit]))


@dataclass
class Farm:
    """What a test needs of a farm; everything is closed at its end."""

    folder: Path
    config: FarmConfig
    ends: ExitStack
    obeyed: list[Command] = field(default_factory=list)
    watched: list[bool] = field(default_factory=list)

    def router(self) -> zenoh.Session:
        """Open the router."""
        return self.ends.enter_context(open_router(self.config.router, self.config.lease_ms))

    def client(self) -> zenoh.Session:
        """Connect to it."""
        return self.ends.enter_context(open_client(self.config.router, self.config.lease_ms, 5.0))

    def desk(self, session: zenoh.Session) -> Desk:
        """Begin a desk with its history."""
        history = self.ends.enter_context(History(self.folder, 4, 16.0))
        return self.ends.enter_context(Desk(session, self.config, history))

    def link(
        self,
        session: zenoh.Session,
        journal: Journal,
        forward: Callable[[Command], Answer] | None = None,
        cell: keys.CellName = CELL,
        runs: Path | None = None,
        changes: CellChanges | None = None,
    ) -> CellLink:
        """Begin the link of a cell."""
        obey = forward or self.obey
        recordings = RecordingFiles(runs) if runs is not None else None
        return self.ends.enter_context(
            CellLink(
                session,
                cell,
                self.config.link,
                journal,
                obey,
                self.watched.append,
                recordings,
                changes,
            )
        )

    def obey(self, command: Command) -> Answer:
        """Take a command as a cell would."""
        self.obeyed.append(command)
        return Answer(True, f"{command.command} received")


@pytest.fixture
def farm(tmp_path: Path) -> Iterator[Farm]:
    """Give a test a farm of its own."""
    shipped = load_farm(ROOT / "config")
    config = replace(
        shipped,
        router=replace(shipped.router, port=free_port()),
        # Both ends are this process: where it stands still for a second nobody is lost.
        lease_ms=5000.0,
        link=replace(shipped.link, health_rate_hz=5.0),
        desk=replace(shipped.desk, flush_ms=50.0),
    )
    with ExitStack() as ends:
        yield Farm(tmp_path / "events", config, ends)
