"""Typed content of bringup.yaml, and the addresses that the nodes will open."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from scara_config import load, locate
from scara_config.quantities import GraceSeconds, ServerAddress, WaitSeconds

DOOR_FILES = {
    "modbus": "emulator.yaml",
    "gateway": "gateway.yaml",
    "panel": "operator_panel.yaml",
    "pendant": "pendant_page.yaml",
}


class Ports(msgspec.Struct, frozen=True):
    """Ports that stand in place of the files'; None: as the file says."""

    modbus: int | None = None
    gateway: int | None = None
    panel: int | None = None
    pendant: int | None = None

    def __bool__(self) -> bool:
        """Whether any is given."""
        return self != Ports()

    def over(self, doors: Doors) -> Doors:
        """Return the addresses with these ports."""
        given = {name: port for name, port in msgspec.structs.asdict(self).items() if port}
        changed = {
            name: msgspec.structs.replace(getattr(doors, name), port=port)
            for name, port in given.items()
        }
        return msgspec.structs.replace(doors, **changed)


class Bringup(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Deadlines of starting and ending a cell [s], and how large its logs grow."""

    master_timeout: WaitSeconds
    ready_timeout: WaitSeconds
    check_period: Annotated[float, Meta(ge=0.01, le=10.0)]
    interrupt_grace: GraceSeconds
    terminate_grace: GraceSeconds
    kill_grace: GraceSeconds
    log_lines: Annotated[int, Meta(ge=1, le=1000)]
    log_limit_mb: Annotated[float, Meta(ge=0.1, le=10_000.0)]


class Doors(msgspec.Struct, frozen=True):
    """Where the cell listens, and ``modbus`` where its robot does."""

    modbus: ServerAddress
    gateway: ServerAddress
    panel: ServerAddress
    pendant: ServerAddress


class Coupled(msgspec.Struct, frozen=True):
    """What the twin controller couples the twin with; the rest of the file is its business."""

    real: ServerAddress


def load_coupled(directory: Path | str | None = None) -> Coupled:
    """Read where the real robot is from twin_controller.yaml of ``directory``.

    Raises:
        ConfigError: The file is missing, or host or port does not fit.
    """
    return load(locate("twin_controller.yaml", directory), Coupled)


def load_bringup(directory: Path | str | None = None) -> Bringup:
    """Read bringup.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or a value does not fit.
    """
    return load(locate("bringup.yaml", directory), Bringup)


def load_doors(directory: Path | str | None = None, stand_in: bool = True) -> Doors:
    """Read the addresses from the files of ``DOOR_FILES`` in ``directory``.

    Args:
        directory: Default: the package scara_config.
        stand_in: Whether the cell has one; else ``modbus`` is that of the robot it is coupled with.

    Raises:
        ConfigError: A file is missing, or its host or port does not fit.
    """
    doors = Doors(
        **{name: load(locate(file, directory), ServerAddress) for name, file in DOOR_FILES.items()}
    )
    if stand_in:
        return doors
    return msgspec.structs.replace(doors, modbus=load_coupled(directory).real)
