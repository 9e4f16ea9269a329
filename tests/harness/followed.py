"""A delivered robot with Modbus switched on and nothing else: what a twin that follows gets."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from fanuc_kit.sheets import map_file
from scara_config import load
from scara_config.modbus_map import ModbusMap
from scara_config.set_up.kit_map import kit_map
from scara_config.writer import DROPPED, write_values

from harness.workspace import ROOT

ROBOT = "fanuc_sr6ia"
_OWN = load(ROOT / "config" / "robots" / ROBOT / "modbus_map.yaml", ModbusMap)
FOLLOW_MAP = kit_map(_OWN, leads=False)
_TABLE = "table_joint"


def four_axes(folder: Path) -> Path:
    """Return a folder of configuration whose robot is as delivered: no table, only followed.

    The rotary table is taken out of each of the robot's files, as its owner would.
    """
    config = folder / "config"
    shutil.copytree(ROOT / "config", config, ignore=shutil.ignore_patterns("src", "__pycache__"))
    robot = config / "robots" / ROBOT
    (robot / "modbus_map.yaml").write_text(map_file(FOLLOW_MAP))
    (robot / "palletise.yaml").unlink()
    write_values(robot / "pid_gains.yaml", {(_TABLE,): DROPPED})
    write_values(robot / "emulator.yaml", {("start_position", f"{_TABLE}_deg"): DROPPED})
    for plant in (robot / "plants").glob("*.yaml"):
        write_values(plant, {("axes", _TABLE): DROPPED})
    for program in (robot / "programs").glob("*.LS"):
        program.write_text(re.sub(r",\n\tE1= .*", "", program.read_text()))
    urdf = folder / "four_axes.urdf"
    whole = (ROOT / "src/scara_description/urdf/scara_cell.urdf").read_text()
    urdf.write_text(
        whole.replace(f'name="{_TABLE}" type="revolute"', f'name="{_TABLE}" type="fixed"')
    )
    file = robot / "robot.yaml"
    write_values(file, {("home", _TABLE): DROPPED, ("lead",): False, ("urdf",): str(urdf)})
    text = file.read_text()
    file.write_text(text[: text.index(f"  - name: {_TABLE}")])
    return config
