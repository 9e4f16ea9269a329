"""A copy of the configuration with other ports, for a second cell on the same machine."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from ruamel.yaml import YAML
from scara_config import files_in_force


def copy_with_ports(
    source: Path,
    target: Path,
    modbus_port: int | None,
    gateway_port: int | None,
    panel_port: int | None = None,
) -> Path:
    """Copy the chosen robot's files from ``source`` to ``target`` and change the ports.

    Both ends of a line read the port, so it is changed for both.

    The copy is flat: one robot, no folder of robots. Comments are kept. Returns ``target``.
    """
    target.mkdir(parents=True, exist_ok=True)
    for name, file in files_in_force(source).items():
        (target / name).parent.mkdir(exist_ok=True)
        shutil.copy(file, target / name)
    if modbus_port is not None:
        _change(target / "emulator.yaml", ["port"], modbus_port)
        _change(target / "twin_controller.yaml", ["real", "port"], modbus_port)
    if gateway_port is not None:
        _change(target / "gateway.yaml", ["port"], gateway_port)
        _change(target / "twin_controller.yaml", ["twin", "url"], f"ws://127.0.0.1:{gateway_port}")
    if panel_port is not None:
        _change(target / "operator_panel.yaml", ["port"], panel_port)
    return target


def _change(file: Path, keys: list[str], value: Any) -> None:
    """Set one value of a YAML file."""
    yaml = YAML()
    yaml.preserve_quotes = True
    yaml.width = 4096
    tree = yaml.load(file)
    branch = tree
    for key in keys[:-1]:
        branch = branch[key]
    branch[keys[-1]] = value
    yaml.dump(tree, file)
