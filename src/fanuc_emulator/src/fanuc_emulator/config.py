"""Read emulator.yaml and the programs, programs/NAME.LS, checked against robot.yaml."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated

import msgspec
from msgspec import Meta
from scara_config import ConfigError, Robot, load, locate
from scara_config.frames import NO_FRAMES, FrameTable, find_frames
from scara_config.programs.files import (
    joint_positions,
    program_files,
    read_listing,
    read_taught,
)
from scara_config.programs.tp.execution import background
from scara_config.programs.tp.listing import Program as Listing
from scara_config.quantities import Port, ServerAddress

from fanuc_emulator.plant.config import Plant, load_plant
from fanuc_emulator.settings import ControllerSettings, load_settings
from fanuc_emulator.tp.executor import Program

# By `\Z`, for `$` would let a newline at the end pass.
ProgramName = Annotated[str, Meta(pattern=r"^[A-Z][A-Z0-9_]{0,15}\Z")]


class EmulatorFile(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The file emulator.yaml: where the stand-in is, and its own patience.

    Attributes:
        rsr_programs: What RSR1, RSR2 .. start; the first one follows the client's set points.
        background_programs: What SETUP > BG Logic lists beside BGTWIN.
    """

    host: str
    port: Port
    start_position: dict[str, float]
    cold_start_override_percent: Annotated[int, Meta(ge=1, le=100)]
    safety_speed_percent: Annotated[int, Meta(ge=1, le=100)]
    heartbeat_timeout_ms: Annotated[int, Meta(ge=10, le=10000)]
    gripper_timeout_ms: Annotated[int, Meta(ge=10, le=10000)]
    start_wait_ms: Annotated[int, Meta(ge=0, le=10000)]
    rsr_programs: Annotated[list[ProgramName], Meta(min_length=1, max_length=8)]
    desk_heartbeat_timeout_ms: Annotated[int, Meta(ge=10, le=10000)] | None = None
    background_programs: Annotated[list[ProgramName], Meta(max_length=7)] = []


class PendantPageFile(ServerAddress, frozen=True, forbid_unknown_fields=True):
    """The file pendant_page.yaml: where the pendant's page is served."""


class EmulatorConfig(EmulatorFile, frozen=True, kw_only=True):
    """The file emulator.yaml, the plant: how the robot moves, and how its controller was set up."""

    plant: Plant
    settings: ControllerSettings
    frames: FrameTable = NO_FRAMES
    background: tuple[Listing, ...] = ()

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
        frames=find_frames(directory),
        background=tuple(_background(path, file, directory)),
        **fields,
    )


def _background(path: Path, file: EmulatorFile, directory: Path | str | None) -> Iterator[Listing]:
    """Yield the programs of background logic."""
    files = program_files(directory) if file.background_programs else {}
    for index, name in enumerate(file.background_programs):
        place = f"{path}: background_programs[{index}] = {name!r}"
        if name in (*file.rsr_programs, *file.background_programs[:index]):
            raise ConfigError(f"{place}: is there twice, or has a number in rsr_programs")
        if name not in files:
            raise ConfigError(f"{place}: unknown, allowed are {', '.join(files)}")
        program = read_listing(files[name])
        try:
            background(program)
        except ConfigError as error:
            raise ConfigError(f"{place}: {error}") from error
        yield program


def on_a_desk(config: EmulatorConfig) -> EmulatorConfig:
    """Return the configuration for a stand-in whose client runs on the same machine."""
    patience = max(config.heartbeat_timeout_ms, config.desk_heartbeat_timeout_ms or 0)
    return msgspec.structs.replace(config, heartbeat_timeout_ms=patience)


def load_programs(robot: Robot, directory: Path | str | None = None) -> dict[int, Program]:
    """Return the first part of :func:`load_library`; it raises the same."""
    return load_library(robot, directory)[0]


def load_library(
    robot: Robot, directory: Path | str | None = None
) -> tuple[dict[int, Program], dict[str, Program]]:
    """Read all files of programs/ in ``directory``.

    Returns:
        Those that emulator.yaml gives a number by this number, but for the stream program; and by
        their names all that can be called: neither the stream program nor background logic.

    Raises:
        ConfigError: A file is wrong, a position is out of range or unknown, emulator.yaml names a
            program that is not there, or one twice.
    """
    read = {name: read_taught(path, robot) for name, path in program_files(directory).items()}
    path = locate("emulator.yaml", directory)
    file = load(path, EmulatorFile)
    numbered = file.rsr_programs
    for index, name in enumerate(numbered):
        if name in numbered[:index]:
            raise ConfigError(f"{path}: rsr_programs[{index}] = {name!r}: is there twice")
        # The first one is the stream program: the kit makes it, no file holds it.
        if index and name not in read:
            raise ConfigError(
                f"{path}: rsr_programs[{index}] = {name!r}: unknown, allowed are {', '.join(read)}"
            )
    of_number = {number: read[name] for number, name in enumerate(numbered, start=1) if number > 1}
    apart = numbered[0], *file.background_programs
    return of_number, {name: each for name, each in read.items() if name not in apart}


def load_pendant_page(directory: Path | str | None = None) -> PendantPageFile:
    """Read pendant_page.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or a value does not fit.
    """
    return load(locate("pendant_page.yaml", directory), PendantPageFile)
