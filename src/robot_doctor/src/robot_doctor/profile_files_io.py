"""Read a profile as it is, without giving up at the first error."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from scara_config import ConfigError, Robot, load, load_robot, locate
from scara_config.modbus_map import ModbusMap
from scara_config.profile import PROGRAMS, known_robots, robot_folder
from scara_config.programs.files import program_files, read_listing
from scara_config.programs.tp.listing import Program
from twin_controller.config import load_twin_controller

from robot_doctor.examine import RobotProfile
from robot_doctor.finding import Places

T = TypeVar("T")
DECIMALS = 2


def read_profile(folder: Path) -> RobotProfile:
    """Read the chosen robot's files in ``folder``.

    Raises:
        ConfigError: There is no such robot.
    """
    own = robot_folder(folder)
    robot = _attempt(lambda: load_robot(folder))
    urdf: str | ConfigError = (
        robot
        if isinstance(robot, ConfigError)
        else _attempt(lambda: robot.description.read_text("utf-8"))
    )
    decimals = DECIMALS
    if not isinstance(robot, ConfigError):
        controller = _attempt(lambda: load_twin_controller(robot, folder))
        decimals = DECIMALS if isinstance(controller, ConfigError) else controller.change.decimals
    files = _attempt(lambda: program_files(folder))
    programs: dict[str, Program | ConfigError] = {}
    if not isinstance(files, ConfigError):
        for path in files.values():
            programs[path.name] = _attempt(lambda path=path: read_listing(path))  # type: ignore[misc]
    return RobotProfile(
        folder=own.name if known_robots(folder) else "",
        robot=robot,
        layout=_attempt(lambda: load(locate("modbus_map.yaml", folder), ModbusMap)),
        gains=_attempt(lambda: load(locate("pid_gains.yaml", folder), dict[str, Any])),
        programs=programs,
        urdf=urdf,
        decimals=decimals,
        places=_places(folder, robot),
    )


def _places(folder: Path, robot: Robot | ConfigError) -> Places:
    """Return where the chosen robot's files are."""
    body = locate("body.yaml", folder)
    urdf = robot if isinstance(robot, ConfigError) else _attempt(lambda: robot.description)
    return Places(
        robot=str(locate("robot.yaml", folder)),
        programs=str(locate(PROGRAMS, folder)),
        urdf="" if isinstance(urdf, ConfigError) else str(urdf),
        body=str(body) if body.is_file() else "",
    )


def _attempt(read: Callable[[], T]) -> T | ConfigError:
    """Return what ``read`` gives, or why it does not."""
    try:
        return read()
    except ConfigError as error:
        return error
