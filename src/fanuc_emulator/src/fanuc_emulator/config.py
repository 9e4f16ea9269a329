"""Read emulator.yaml and config/programs/*.yaml, checked against robot.yaml."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from scara_config import ConfigError, Robot, load, locate
from scara_config.programs.files import joint_positions, read_program
from scara_config.quantities import Port

from fanuc_emulator.plant.config import Plant, load_plant
from fanuc_emulator.program import Program
from fanuc_emulator.settings import ControllerSettings, load_settings


class EmulatorFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The file emulator.yaml: where the stand-in is, and its own patience."""

    host: str
    port: Port
    start_position: dict[str, float]
    cold_start_override_percent: Annotated[int, Meta(ge=1, le=100)]
    safety_speed_percent: Annotated[int, Meta(ge=1, le=100)]
    heartbeat_timeout_ms: Annotated[int, Meta(ge=10, le=10000)]
    gripper_timeout_ms: Annotated[int, Meta(ge=10, le=10000)]
    start_wait_ms: Annotated[int, Meta(ge=0, le=10000)]
    stream_program: Annotated[str, Meta(pattern=r"^[A-Z][A-Z0-9_]{0,15}\Z")]
    desk_heartbeat_timeout_ms: Annotated[int, Meta(ge=10, le=10000)] | None = None


class PendantPageFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The file pendant_page.yaml: where the pendant's page is served."""

    host: str
    port: Port


class EmulatorConfig(EmulatorFile, frozen=True, kw_only=True):
    """The file emulator.yaml, the plant: how the robot moves, and how its controller was set up."""

    plant: Plant
    settings: ControllerSettings

    @property
    def dt(self) -> float:
        """Servo period: the stand-in's step [s]."""
        return self.plant.dt


def load_emulator(
    robot: Robot,
    directory: Path | str | None = None,
    plant: str | None = None,
    settings: str | Mapping[str, object] | None = None,
) -> EmulatorConfig:
    """Read emulator.yaml and a plant of ``directory`` (default: the package scara_config).

    Args:
        robot: robot.yaml.
        directory: Folder with all YAML files.
        plant: Its name; default: what ``SCARA_PLANT`` says, else ``ideal``.
        settings: See :func:`~fanuc_emulator.settings.load_settings`.

    Raises:
        ConfigError: A file or a setting is missing or wrong, or the start position is out of range.
    """
    path = locate("emulator.yaml", directory)
    file = load(path, EmulatorFile)
    joint_positions(file.start_position, robot, lambda _: f"{path}: start_position")
    fields = msgspec.structs.asdict(file)
    return EmulatorConfig(
        plant=load_plant(robot, directory, plant),
        settings=load_settings(directory, settings),
        **fields,
    )


def on_a_desk(config: EmulatorConfig) -> EmulatorConfig:
    """Return the configuration for a stand-in whose client runs on the same machine."""
    patience = max(config.heartbeat_timeout_ms, config.desk_heartbeat_timeout_ms or 0)
    return msgspec.structs.replace(config, heartbeat_timeout_ms=patience)


def load_programs(robot: Robot, directory: Path | str | None = None) -> dict[int, Program]:
    """Read all files of programs/ in ``directory`` and return them by RSR number.

    Raises:
        ConfigError: A file is wrong, a position is out of range or unknown, a name or RSR number
            occurs twice.
    """
    programs: dict[int, Program] = {}
    paths: dict[int, Path] = {}
    for path in sorted(locate("programs", directory).glob("*.yaml")):
        file = read_program(path, robot)
        program = Program(file.name, file.rsr, file.steps)
        for other in programs.values():
            if other.rsr == program.rsr or other.name == program.name:
                raise ConfigError(
                    f"{path}: name {program.name}, rsr {program.rsr}: {paths[other.rsr].name} has "
                    f"name {other.name}, rsr {other.rsr}; change one of the two files"
                )
        programs[program.rsr], paths[program.rsr] = program, path
    return programs


def load_pendant_page(directory: Path | str | None = None) -> PendantPageFile:
    """Read pendant_page.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or a value does not fit.
    """
    return load(locate("pendant_page.yaml", directory), PendantPageFile)
