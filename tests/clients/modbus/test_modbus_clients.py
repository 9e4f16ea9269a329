"""Unmodified Modbus clients against the robot's stand-in: their documentation's examples.

`./cell test` runs pymodbus of .venv, `./cell test --clients` others too, each in an environment of
its own.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from harness.clients.environments import ALL, OWN, Environment, installed, results
from harness.emulated.served import running
from harness.workspace import ROOT

HERE = Path(__file__).parent
NAMES = ("jsmodbus", "modbus_serial", "pymodbustcp", "umodbus")
OTHERS = [environment for name in NAMES for environment in installed(name + "*")]
PYMODBUS = OWN._replace(name="pymodbus")
CLIENTS = [pytest.param(client, id=client.name) for client in (PYMODBUS, *OTHERS)]
FIRST_STEPS = [one for one in CLIENTS[1:] if one.id != "umodbus"]


@pytest.fixture
def port() -> Iterator[int]:
    """Run a robot."""
    with running() as stand_in:
        yield stand_in.port


def run(client: Environment, folder: Path, port: int) -> list[str]:
    """Run the script in ``folder`` that is written for a client, and return its lines."""
    kind = "js" if client.modules else "py"
    part = "examples" if folder == HERE else "first_steps"
    command = (client.program, str(folder / f"{client.name}_{part}.{kind}"), str(port))
    env = os.environ | client.variables
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, env=env)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.splitlines()


@pytest.mark.parametrize("client", CLIENTS)
def test_examples_of_the_clients_documentation_work(
    port: int, client: Environment, modbus_record: dict[Any, Any]
) -> None:
    """Registers, coils, units, exceptions, several at once, own registers; nothing is adapted."""
    found, wrong = results(run(client, HERE, port))
    modbus_record[found] = wrong
    assert len(wrong) >= 8
    assert {check: text for check, text in wrong.items() if text} == {}


@pytest.mark.skipif(not ALL, reason="./cell test --clients installs them")
@pytest.mark.parametrize("client", FIRST_STEPS)
def test_script_of_ten_lines_reads_the_joints(port: int, client: Environment) -> None:
    """What docs/clients.md shows to begin with, as it stands."""
    assert "-160" in run(client, ROOT / "examples", port)[0]
