"""`./cell up --name`: a cell of several finds what it needs by itself, and is found by its name."""

from __future__ import annotations

import json
import signal
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest
from cell_recorder.journal.entries import Cycle, Decision, Start
from cell_recorder.journal.reader_io import read
from harness.processes import ROSRUN, Process, Stage, wait_until
from harness.workspace import workspace_environment
from scara_bringup.config import load_doors

from scara_msgs.msg import TwinControllerState

# Each of its rules is held by tests/unit/scara_bringup/named and tests/unit/cell_recorder/journal.
pytestmark = [pytest.mark.system, pytest.mark.thorough]

# What has no part in this; each takes a second of processor time to start.
LEFT_OUT = (
    "camera",
    "operator_panel",
    "pendant_page",
    "robot_state_publisher",
    "trajectory_server",
    "joint_vel_controller",
)


@pytest.fixture
def stage(tmp_path: Path) -> Iterator[Stage]:
    """Give processes whose runs folder is the test's."""
    env = {**workspace_environment(), "CELL_ROOT": str(tmp_path)}
    stage = Stage(tmp_path / "processes", env)
    yield stage
    stage.close(grace=20.0)


def test_cell_with_a_name_finds_ports_and_its_journal_tells_its_stops(
    stage: Stage, tmp_path: Path
) -> None:
    """Beside a taken port; status and why find it, and after its end why still does."""

    def ask(*words: str) -> str:
        """Return what a command prints, whether it ends well or not."""
        return said_by(stage.start(*words))

    def said_by(process: Process) -> str:
        """Return what a command has printed at its end."""
        process.wait(30.0)
        return process.output

    words = [word for node in LEFT_OUT for word in ("--without", node)]
    gateway = load_doors().gateway.port
    with socket.socket() as taken:
        taken.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        taken.bind(("127.0.0.1", gateway))
        taken.listen()
        cell = stage.start(
            *(ROSRUN, "scara_bringup", "cell", "up", "--name", "milk_2", "--anyway"),
            *("--no-browser", *words),
            name="cell",
        )
        wait_until(lambda: "cell: ready after" in cell.output or cell.poll(), 90.0, cell.output)
    assert cell.poll() is None, cell.output
    (link,) = (tmp_path / "runs" / ".running").glob("*.json")
    told = json.loads(link.read_text())
    assert told["namespace"] == "/milk_2"
    assert not told["addresses"]["Twin's web socket"].endswith(f":{gateway}")
    name = ("--name", "milk_2")
    again = stage.start(ROSRUN, "scara_bringup", "cell", "up", *name, "--anyway")
    status = stage.start(ROSRUN, "scara_bringup", "cell", "status", *name)
    assert "milk_2 runs already" in said_by(again)
    assert "milk_2: fanuc_sr6ia" in said_by(status)

    own = {"ROS_MASTER_URI": told["master_uri"], "ROS_NAMESPACE": "/milk_2"}
    command = "/milk_2/twin_controller/command"
    folder = tmp_path / "runs" / "journal" / "milk_2"
    estop = stage.start("rosservice", "call", command, "{command: ESTOP}", env=own)
    assert estop.wait(20.0) == 0, estop.output

    def stopped() -> bool:
        modes = [entry.mode_after for entry in read(folder) if isinstance(entry, Decision)]
        return TwinControllerState.ESTOP in modes

    wait_until(stopped, 10.0, "the emergency stop in the journal")
    why = ("why", "--since", "1h", "--stops")
    said = ask(ROSRUN, "scara_bringup", "cell", *why)
    assert "ESTOP by the operator" in said and "milk_2: 1 stop" in said, said

    cell.popen.send_signal(signal.SIGINT)
    assert cell.wait(30.0) == 128 + signal.SIGINT, cell.output
    entries = list(read(folder, 0, pytest.fail))
    assert [entry.number for entry in entries] == list(range(1, len(entries) + 1))
    assert [type(entry) for entry in entries].count(Start) == 1
    assert not [entry for entry in entries if isinstance(entry, Cycle)]
    said = ask(ROSRUN, "scara_bringup", "cell", *why, *name)
    assert "ESTOP by the operator" in said and "-> ESTOP since then" in said, said
