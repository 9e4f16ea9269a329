"""The link's node: a cell is shown, its journal is told, a STOP reaches the controller by name."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
import rospy
from farm.bus_io import open_router
from farm.config import FarmConfig, load_farm
from farm.desk.commands_io import Answered, cells_there, order
from farm.desk.desk_io import Desk
from farm.desk.history_io import History
from farm.desk.reading_io import ask
from farm.desk.roster import LOST, SILENT
from harness.processes import Process
from harness.ros import Ros
from harness.yaml_files import copy_configuration
from msgspec.structs import replace
from std_srvs.srv import SetBool

from scara_msgs.msg import TwinControllerState as State
from scara_msgs.srv import TwinCommand, TwinCommandResponse

DEADLINE_S = 20.0


class Cell:
    """A twin controller that is only a state and a service, a link's node, and a desk."""

    def __init__(self, ros: Ros, ends: ExitStack) -> None:
        self.ros, self.calls = ros, []  # type: ignore[var-annotated]
        folder = ros.folder / "config"
        folder.mkdir()
        copy_configuration(folder)
        file = folder / "farm" / "farm.yaml"
        file.write_text(file.read_text().replace("persons: {}", "persons: {ann: mover}"))
        self.port = ros.free_port()
        self.config: FarmConfig = load_farm(folder)
        self.config = replace(self.config, router=replace(self.config.router, port=self.port))
        self._ends = ends
        self._service = rospy.Service(ros.name("twin_controller/command"), TwinCommand, self._obey)
        ends.callback(self._service.shutdown)
        words = (f"_config_dir:={folder}", f"_directory:={ros.folder}")
        self.link = ros.run("farm", "link", *words, f"_router_port:={self.port}")
        self.remote = ros.service("farm/remote", SetBool)
        self.states = ros.publisher("twin_controller/state", State)

    def open_desk(self) -> Desk:
        """Start the desk."""
        session = self._ends.enter_context(open_router(self.config.router, self.config.lease_ms))
        history = self._ends.enter_context(History(self.ros.folder / "events", 64, 16.0))
        return self._ends.enter_context(Desk(session, self.config, history))

    def show(self, mode: str) -> None:
        """Publish a state."""
        message = State(mode=mode, leader="real", why="a test")
        message.header.stamp = rospy.get_rostime()
        self.states.publish(message)

    def _obey(self, request: Any) -> TwinCommandResponse:
        self.calls.append((request.command, request._connection_header["callerid"]))
        return TwinCommandResponse(True, f"{request.command} received", True)


@pytest.fixture
def cell(ros: Ros) -> Iterator[Cell]:
    """Give a test a cell whose link waits for a desk."""
    with ExitStack() as ends:
        yield Cell(ros, ends)


def test_link_shows_the_cell_tells_its_journal_and_takes_commands(cell: Cell) -> None:
    """From the first desk to the link's end; the first STOP without a roscore."""
    name = cell.ros.namespace.strip("/")
    journal = cell.ros.folder / "journal" / name
    journal.mkdir(parents=True)
    desk = cell.open_desk()

    def shown(mode: str) -> bool:
        cell.show(mode)
        return [row.status for row in desk.rows()] == [mode]

    cell.ros.wait_until(lambda: shown(State.IDLE), DEADLINE_S, "the state")
    state = desk.rows()[0].state
    assert state is not None and state.leader == "real" and not state.remote
    write(journal, range(1, 6))
    cell.ros.wait_until(
        lambda: (
            [r[0] for r in ask(cell.ros.folder / "events", "SELECT number FROM events").rows]
            == [1, 2, 3, 4, 5]
        ),
        DEADLINE_S,
        "the events",
    )

    def command(word: str, person: str) -> Answered:
        session = desk.session
        there = cells_there(session, cell.config.site, 1.0)
        (answer,) = order(session, there, word, person, "desk_1", 2.0)
        return answer

    with hanging(cell.ros.master.process):
        stop = command("STOP", "bob")
    assert stop.answer is not None and stop.answer.accepted
    assert cell.calls == [("STOP", "/farm/bob@desk_1")]
    assert "remote switch of this cell is off" in command("RESUME", "ann").text
    assert cell.remote(True).success
    cell.ros.wait_until(
        lambda: shown(State.IDLE) and desk.rows()[0].state.remote,  # type: ignore[union-attr]
        DEADLINE_S,
        "the switch",
    )
    assert "bob is watcher here" in command("RESUME", "bob").text
    assert "names no state" in command("RESUME", "ann").text
    assert len(cell.calls) == 1
    cell.ros.wait_until(lambda: desk.rows()[0].status == SILENT, DEADLINE_S, "the silence")
    cell.link.signal(signal.SIGKILL)
    cell.ros.wait_until(lambda: desk.rows()[0].status == LOST, DEADLINE_S, "the loss")


@contextmanager
def hanging(master: Process) -> Iterator[None]:
    """Let the master answer nobody meanwhile."""
    master.signal(signal.SIGSTOP)
    try:
        yield
    finally:
        master.signal(signal.SIGCONT)


def write(journal: Path, numbers: range) -> None:
    """Write a day's journal, the last line in two pieces."""
    lines = "".join(
        json.dumps({"number": n, "time": time.time(), "kind": "audit", "who": "x"}) + "\n"
        for n in numbers
    )
    file = journal / "2026-05-01.jsonl"
    file.write_text(lines[:-20])
    with file.open("a") as stream:
        stream.write(lines[-20:])
