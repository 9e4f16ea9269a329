"""An example that finds no cell says so in one line, and ends."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest
from harness.processes import free_port
from harness.workspace import ROOT

PATIENCE_S = 30.0
"""Longer than any of them waits; how long each does is no claim of a test."""
EXAMPLES = {
    "move_and_watch.py": "no ROS master answers",
    "read_robot_over_modbus.py": "no robot answers",
    "pymodbustcp_first_steps.py": "no robot answers",
    "roslibpy_first_steps.py": "no gateway answers",
    "join_the_farm.py": "no desk answers",
    "walking_person.py": "no ROS master answers",
}


def test_each_example_in_python_is_tried() -> None:
    """A new one has to be thought about."""
    assert {path.name for path in (ROOT / "examples").glob("*.py")} == set(EXAMPLES)


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_without_a_cell_says_so_and_what_to_do(name: str) -> None:
    """One line on the error channel, and no trace."""
    env = {**os.environ, "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}"}
    done = subprocess.run(
        [sys.executable, str(ROOT / "examples" / name), str(free_port())],
        env=env,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
    )
    assert done.returncode == 1 and "Traceback" not in done.stderr
    last = done.stderr.strip().splitlines()[-1]
    assert last.startswith(EXAMPLES[name]) and "first (./cell " in last
