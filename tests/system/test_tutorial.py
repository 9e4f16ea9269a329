"""The tutorial and the example scripts do what they say, in a cell as its reader starts one."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest
from fanuc_emulator.config import load_programs
from harness.live_cell import LiveCell
from harness.workspace import ROOT
from harness.yaml_files import add_program, copy_configuration
from scara_config import load_robot

pytestmark = pytest.mark.system

TUTORIAL = (ROOT / "docs" / "learn" / "tutorial.md").read_text(encoding="utf-8")
EXAMPLES = sorted(file.name for file in (ROOT / "examples").glob("*.py"))


def own_program(config: Path) -> None:
    """Write the tutorial's program where it says, and give it its number as it says."""
    (text,) = re.findall(r"<!-- program: .*?-->\n```\n(.*?)```", TUTORIAL, re.DOTALL)
    assert "programs/MINE.LS`" in TUTORIAL
    assert "rsr_programs: [RSR0101, ARTICLE, TWO_POINT, PALLETISE, VEHICLE, MINE]" in TUTORIAL
    add_program(config, text)


def test_the_tutorials_program_loads(tmp_path: Path) -> None:
    """Its name and its number are free."""
    config = copy_configuration(tmp_path / "config")
    own_program(config)
    assert "MINE" in {one.name for one in load_programs(load_robot(config), config).values()}


@pytest.mark.thorough
def test_the_tutorials_program_runs(tmp_path: Path) -> None:
    """By the two lines of the tutorial, in a cell that knows it; that it loads is held by day."""
    config = copy_configuration(tmp_path / "config")
    own_program(config)

    def scene() -> None:
        for line in ("override 100", "run MINE"):
            assert f"rosrun fanuc_emulator pendant {line}\n" in TUTORIAL
            cell.tool("rosrun", "fanuc_emulator", "pendant", *line.split())
        assert "MINE" in cell.tool("rosrun", "fanuc_emulator", "pendant", "status")
        cell.make_ready()

    with LiveCell(tmp_path).ready(config=config) as cell:
        cell.beside_lost_links(scene)


def test_the_tutorial_names_every_example() -> None:
    """One that nobody finds helps nobody."""
    assert [name for name in EXAMPLES if name not in TUTORIAL] == []


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("move_and_watch.py", r"TWIN_LEADS: [^\n]*\n(?:.*\n)*?at \(0\.51, -0\.16, 0\.16\): "),
        ("read_robot_over_modbus.py", r"J1 +-?\d+\.\d{3}\n(?:J\d .*\n){4}"),
        ("roslibpy_first_steps.py", r"joint_1"),
    ],
)
def test_an_example_runs_as_it_is(live_cell: LiveCell, name: str, said: str) -> None:
    """With the port of this cell where it takes one."""
    ports = {
        "read_robot_over_modbus.py": [str(live_cell.modbus_port)],
        "roslibpy_first_steps.py": [str(live_cell.gateway_port)],
    }
    output: list[str] = []

    def scene() -> None:
        words = (sys.executable, str(ROOT / "examples" / name), *ports.get(name, []))
        output[:] = [live_cell.tool(*words)]

    live_cell.beside_lost_links(scene)
    assert re.search(said, output[0]), output[0]
