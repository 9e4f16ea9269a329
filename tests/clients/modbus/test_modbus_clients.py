"""Unmodified Modbus clients against the robot's stand-in: their documentation's examples.

`./cell test` runs pymodbus of .venv, `./cell test --clients` others too, each in an environment of
its own.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from fanuc_emulator.config import load_emulator, load_programs
from fanuc_emulator.controller import Controller
from fanuc_emulator.io.modbus_server import RobotServer
from fanuc_emulator.io.servo_loop import ServoLoop
from fanuc_emulator.register_image import RegisterImage
from harness.processes import free_port
from harness.workspace import ROOT
from scara_config import load_robot
from scara_config.modbus_map import load_modbus_map

HERE, CONFIG = Path(__file__).parent, ROOT / "config"
ENVIRONMENTS = ROOT / ".venv" / "clients"
NODE = shutil.which("node") or "node"


class Client(NamedTuple):
    """What runs a client's scripts, and where it finds the client."""

    name: str
    program: str
    suffix: str
    modules: str = ""

    @property
    def env(self) -> dict[str, str]:
        """The environment: no path of ours leads it to ours."""
        kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        return kept | {"NODE_PATH": self.modules}


def _others() -> Iterator[Client]:
    """Yield the clients of setup/clients that talk Modbus."""
    yield Client("pymodbustcp", str(ENVIRONMENTS / "pymodbustcp" / "bin" / "python"), "py")
    for name in ("jsmodbus", "modbus_serial"):
        yield Client(name, NODE, "js", str(ENVIRONMENTS / name / "node_modules"))


OWN = Client("pymodbus", sys.executable, "py")
OTHERS = list(_others()) if os.environ.get("CELL_CLIENTS_PAGE") else []
CLIENTS = [pytest.param(client, id=client.name) for client in (OWN, *OTHERS)]
FIRST_STEPS = [pytest.param(client, id=client.name) for client in OTHERS]


@pytest.fixture(scope="module")
def port() -> Iterator[int]:
    """Run a robot."""
    robot, layout = load_robot(CONFIG), load_modbus_map(CONFIG)
    config = load_emulator(robot, CONFIG)
    controller = Controller(config, robot, load_programs(robot, CONFIG), 1.7e9)
    loop, chosen = ServoLoop(controller, config.dt, 0.0), free_port()
    with loop, RobotServer("127.0.0.1", chosen, layout, RegisterImage(layout, robot), loop):
        yield chosen


def run(client: Client, script: Path, port: int) -> list[str]:
    """Run a script to its end and return its lines."""
    command = (client.program, str(script), str(port))
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, env=client.env)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.splitlines()


@pytest.mark.parametrize("client", CLIENTS)
def test_examples_of_the_clients_documentation_work(
    port: int, client: Client, modbus_record: dict[Any, Any]
) -> None:
    """Registers, coils, units, exceptions, several at once, own registers; nothing is adapted."""
    script = HERE / f"{client.name}_examples.{client.suffix}"
    found = [json.loads(line) for line in run(client, script, port) if line.startswith("{")]
    wrong = {one["check"]: one["wrong"] for one in found[1:]}
    modbus_record[found[0]["client"], found[0]["version"]] = wrong
    assert len(wrong) >= 9
    assert {check: text for check, text in wrong.items() if text} == {}


@pytest.mark.skipif(not OTHERS, reason="./cell test --clients installs them")
@pytest.mark.parametrize("client", FIRST_STEPS)
def test_script_of_ten_lines_reads_the_joints(port: int, client: Client) -> None:
    """What docs/clients.md shows to begin with, as it stands."""
    script = ROOT / "examples" / f"{client.name}_first_steps.{client.suffix}"
    assert "-160" in run(client, script, port)[0]
