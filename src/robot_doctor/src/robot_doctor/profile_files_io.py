"""Read a profile as it is, without giving up at the first error."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import msgspec
from scara_config import ConfigError, Robot, load, locate
from scara_config.faults import find_faults, keys_of, line_of
from scara_config.lengths import with_lengths
from scara_config.loader import load_text
from scara_config.modbus_map import ModbusMap
from scara_config.profile import PROGRAM_ENDING, PROGRAMS, known_robots, robot_folder
from scara_config.programs.files import program_files, read_listing
from scara_config.programs.tp.listing import Program
from scara_config.readers import with_line
from scara_config.robot import robot_faults
from scara_description.body import load_body, urdf_of
from twin_controller.config import load_twin_controller

from robot_doctor.examine import RobotProfile
from robot_doctor.finding import Finding, Group, Places
from scara_description.gazebo import CameraView, with_gazebo

T = TypeVar("T")
DECIMALS = 2
LINE = re.compile(r"(?P<file>/[^:]*?)(, line (?P<line>\d+):|: .*\(line (?P<other>\d+)[;)])")
KEYS = re.compile(r"[\w.\[\]]*")


def read_profile(folder: Path) -> RobotProfile:
    """Read the chosen robot's files in ``folder``.

    Raises:
        ConfigError: There is no such robot.
    """
    own = robot_folder(folder)
    robot, faults = _read_robot(folder)
    urdf: str | ConfigError = (
        robot if isinstance(robot, ConfigError) else _attempt(lambda: load_text(robot.description))
    )
    decimals = DECIMALS
    if not isinstance(robot, ConfigError):
        controller = _attempt(lambda: load_twin_controller(robot, folder))
        # Why it cannot be read is told with the other files.
        decimals = DECIMALS if isinstance(controller, ConfigError) else controller.change.decimals
    files = _attempt(lambda: program_files(folder))
    programs: dict[str, Program | ConfigError] = {}
    if not isinstance(files, ConfigError):
        for path in files.values():
            programs[path.name] = _attempt(lambda path=path: read_listing(path))  # type: ignore[misc]
    return RobotProfile(
        folder=own.name if known_robots(folder) else "",
        robot=robot,
        faults=faults,
        layout=_attempt(lambda: load(locate("modbus_map.yaml", folder), ModbusMap)),
        gains=_attempt(lambda: load(locate("pid_gains.yaml", folder), dict[str, Any])),
        programs=programs,
        urdf=urdf,
        written=_written(folder, robot),
        decimals=decimals,
        places=_places(folder, robot),
    )


def _read_robot(folder: Path) -> tuple[Robot | ConfigError, tuple[str, ...]]:
    """Return robot.yaml as far as it can be read, and everything that is wrong with it."""
    path = locate("robot.yaml", folder)
    found: list[str] = []

    def complete(tree: Any) -> Any:
        tree = with_lengths(tree)
        for fault in find_faults(tree, Robot):
            # What is too much goes; another fault is for the reader.
            part = functools.reduce(lambda at, key: at[key], fault.keys, tree)
            if fault.word and isinstance(part, dict):
                line = line_of(path.read_text(encoding="utf-8"), (*fault.keys, fault.word))
                found.append(f"{path}: {fault.text(line)}")
                del part[fault.word]
        return tree

    robot = _attempt(lambda: load(path, Robot, complete))
    if not isinstance(robot, ConfigError):
        told = [with_line(f"{path}: {fault}") for fault in robot_faults(robot)]
        if not robot.arm_joints:
            return ConfigError(told[0]), tuple(found)
        found += told
        # The other checks need a home of each joint, which was told to be missing.
        home = {joint.name: 0.0 for joint in robot.twin_joints} | robot.home
        robot = msgspec.structs.replace(robot, home=home)
    return robot, tuple(found)


def _written(folder: Path, robot: Robot | ConfigError) -> str:
    """Return the URDF that body.yaml gives; empty without one that can be used."""
    if isinstance(robot, ConfigError) or not locate("body.yaml", folder).is_file():
        return ""
    text = _attempt(lambda: urdf_of(robot, load_body(robot, folder)))
    view = _attempt(lambda: load(locate("camera.yaml", folder), CameraView))
    if isinstance(text, ConfigError) or isinstance(view, ConfigError):
        return ""
    return with_gazebo(text, view, robot.base_frame)


def place_of(finding: Finding, folder: Path, robot: Robot | ConfigError) -> str:
    """Return the file and line that a finding is about, ``FILE:LINE``; empty if it has none."""
    if finding.group is Group.LINKS:
        return ""
    if told := LINE.match(finding.what):
        return f"{told['file']}:{told['line'] or told['other']}"
    name, _, keys = finding.at.partition(" ")
    if not name:
        file, _, rest = finding.what.partition(": ")
        name, keys = file.rpartition("/")[2], KEYS.match(rest)[0]  # type: ignore[index]
    path = locate(name if "." in name else "robot.yaml", folder)
    whole = Path(finding.what.partition(": ")[0])
    if not finding.at and whole.is_absolute():
        path = whole
    if name == "URDF" or name.endswith(".urdf"):
        urdf = robot if isinstance(robot, ConfigError) else _attempt(lambda: robot.description)
        if isinstance(urdf, ConfigError):
            return ""
        if name != "URDF":
            # The first of its joints and links that the text names.
            words = re.findall(r"[\w-]+", finding.what.partition(": ")[2])
            known = _attempt(lambda: load_text(urdf))
            if isinstance(known, ConfigError):
                return ""
            keys = next((word for word in words if f'name="{word}"' in known), "robot")
        path, pattern = urdf, rf"<{keys}\b|name=\"{keys}\""
    elif name.endswith(PROGRAM_ENDING):
        path, pattern = locate(PROGRAMS, folder) / name, rf"^{re.escape(keys)}\b.*{{"
    else:
        pattern = ""
    if not path.is_file():
        return ""
    text = path.read_text(encoding="utf-8")
    if pattern:
        found = re.search(pattern, text, re.MULTILINE)
        return f"{path}:{text[: found.start()].count(chr(10)) + 1 if found else 1}"
    way = keys_of(keys)
    # What is missing is to be written where its section stands.
    lines = (line_of(text, way[:count]) for count in range(len(way), -1, -1))
    return f"{path}:{next((line for line in lines if line is not None), 1)}"


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
