"""A copy of the configuration with other ports, for a second cell on the same machine."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import msgspec
from ruamel.yaml import YAML
from scara_config import files_in_force

from scara_bringup.config import DOOR_FILES, Ports

NO_PORTS = Ports()


def copy_with_ports(source: Path, target: Path, ports: Ports = NO_PORTS) -> Path:
    """Copy the chosen robot's files from ``source`` to ``target`` and change the ports.

    Both ends of a line read the port, so it is changed for both.

    The copy is flat: one robot, no folder of robots. Comments are kept. Returns ``target``.
    """
    target.mkdir(parents=True, exist_ok=True)
    for name, file in files_in_force(source).items():
        (target / name).parent.mkdir(exist_ok=True)
        shutil.copy(file, target / name)
    for name, port in msgspec.structs.asdict(ports).items():
        if port is not None:
            _change(target / DOOR_FILES[name], ["port"], port)
    if ports.modbus is not None:
        _change(target / "twin_controller.yaml", ["real", "port"], ports.modbus)
    if ports.gateway is not None:
        _change(target / "twin_controller.yaml", ["twin", "url"], f"ws://127.0.0.1:{ports.gateway}")
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
