"""Make the files of a new robot from those of one that is there."""

from __future__ import annotations

import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import msgspec
import rospkg
from scara_config import ConfigError, load, load_robot, locate
from scara_config.faults import nearest
from scara_config.profile import CHOICE, FOLDER, known_robots
from scara_config.programs.files import read_listing
from scara_config.programs.tp.printer import print_program
from scara_config.writer import replace_file
from scara_description.body import load_body, urdf_of
from scara_description.inertia import largest_inertia

from robot_doctor.new_scara import LIKE, STOPPING, ScaraSize, body_text, robot_text
from robot_doctor.scaled_files import of_joints, started, taught, two_points
from scara_description.gazebo import CameraView, with_gazebo

STAND_IN = "127.0.0.1"
_STOPPING = re.compile(r"^stopping:.*\n(?: .*\n)*", re.MULTILINE)
NAME = re.compile(r"[a-z][a-z0-9_]{0,40}")


def make_profile(config: Path, name: str, source: str, urdf_folder: Path | None = None) -> Path:
    """Copy a robot's folder under a new name, rename it inside, and write its URDF.

    Args:
        config: Folder with all YAML files.
        name: Of the new robot: lower-case letters, digits and underlines.
        source: Of the robot that is copied.
        urdf_folder: Where URDFs are; default: that of the package scara_description.

    Returns:
        The new folder.

    Raises:
        ConfigError: The name is not usable or taken, there is no such robot, or its files are
            wrong; nothing was made then.
    """
    if source not in (known := known_robots(config)):
        meant = nearest(source, known)
        hint = f"; did you mean {meant}?" if meant else ""
        raise ConfigError(
            f"unknown robot {source!r}: {config / FOLDER} has {', '.join(known)}{hint}"
        )
    with new_folder(config, name, source) as folder:
        # What stopped that robot at its address stops no other one that comes to stand there.
        with chosen(name):
            tried = load_robot(config).stopping.tried
        if set(tried.values()) - {STAND_IN}:
            path, stand_in = folder / "robot.yaml", STOPPING.partition("\n")[2]
            text = path.read_text(encoding="utf-8")
            replace_file(path, _STOPPING.sub(lambda _: stand_in, text))
        # A robot without a body shares the URDF of the one that was copied.
        if (folder / "body.yaml").is_file():
            with _own_urdf(config, name, urdf_folder):
                pass
    return folder


def make_scara(config: Path, name: str, size: ScaraSize, urdf_folder: Path | None = None) -> Path:
    """Make the files of a SCARA from its lengths, and its URDF.

    Args:
        config: Folder with all YAML files.
        name: Of the new robot: lower-case letters, digits and underlines.
        size: What is told of it.
        urdf_folder: Where URDFs are; default: that of the package scara_description.

    Returns:
        The new folder.

    Raises:
        ConfigError: The name is not usable or taken, or a SCARA of this size cannot reach its set
            positions; nothing was made then.
    """
    # Here, as the physics engine takes its time: the doctor's other questions need none.
    from scara_simulation.tuning.propose_gains_node import gains_text

    with new_folder(config, name, LIKE) as folder, chosen(name):
        replace_file(folder / "body.yaml", body_text(name, size))
        # First without inertias: they are those of the URDF, which is made from this file.
        replace_file(folder / "robot.yaml", robot_text(name, size, {}))
        robot = load_robot(config)
        urdf = urdf_of(robot, load_body(robot, config))
        ranges = {joint.name: (joint.lower, joint.upper) for joint in robot.twin_joints}
        inertias = {joint: largest_inertia(urdf, ranges, joint) for joint in ranges}
        replace_file(folder / "robot.yaml", robot_text(name, size, inertias))
        robot = load_robot(config)
        with _own_urdf(config, name, urdf_folder):
            for file in folder.glob("programs/*.LS"):
                program = msgspec.structs.replace(
                    read_listing(file),
                    positions=taught(robot, two_points(size) if file.stem == "TWO_POINT" else None),
                )
                replace_file(file, print_program(program))
            emulator = folder / "emulator.yaml"
            replace_file(emulator, started(emulator.read_text(encoding="utf-8"), robot))
            for file in folder.glob("plants/*.yaml"):
                replace_file(file, of_joints(file.read_text(encoding="utf-8"), size.joints))
            replace_file(folder / "pid_gains.yaml", gains_text(robot, config))
    return folder


@contextmanager
def new_folder(config: Path, name: str, source: str) -> Iterator[Path]:
    """Give a copy of a robot's folder under a new name; it is gone again if the rest fails."""
    if not NAME.fullmatch(name):
        raise ConfigError(f"{name!r} is no name for a robot: like my_robot_2, a letter first")
    folder = config / FOLDER / name
    if name in known_robots(config):
        raise ConfigError(f"{folder} is there already")
    try:
        shutil.copytree(config / FOLDER / source, folder)
        _rename(folder, name, source)
        yield folder
    # Also at Ctrl-C: a folder counts as a robot, even half of one.
    except BaseException as error:
        shutil.rmtree(folder, ignore_errors=True)
        if isinstance(error, OSError | ValueError):
            raise ConfigError(f"{folder} was not made: {error}") from error
        raise


@contextmanager
def chosen(name: str) -> Iterator[None]:
    """Choose a robot for what is read within."""
    before = os.environ.get(CHOICE)
    # All readers of a profile take the robot from there.
    os.environ[CHOICE] = name
    try:
        yield
    finally:
        if before is None:
            del os.environ[CHOICE]
        else:
            os.environ[CHOICE] = before


def _rename(folder: Path, name: str, source: str) -> None:
    """Put the new name in place of the old one, comments included; a shared URDF stays shared."""
    for file in sorted(folder.rglob("*.yaml")):
        text = file.read_text(encoding="utf-8")
        own_urdf = (folder / "body.yaml").is_file()
        changed = re.sub(
            rf"\b{source}\b(?!\.urdf)" if not own_urdf else rf"\b{source}\b", name, text
        )
        replace_file(file, changed)


@contextmanager
def _own_urdf(config: Path, name: str, urdf_folder: Path | None) -> Iterator[None]:
    """Write the URDF of a robot from its body.yaml, as :func:`new_urdf` does."""
    with chosen(name):
        robot = load_robot(config)
        text = urdf_of(robot, load_body(robot, config))
        text = with_gazebo(text, load(locate("camera.yaml", config), CameraView), robot.base_frame)
    with new_urdf(urdf_place(urdf_folder) / robot.urdf, text):
        yield


@contextmanager
def new_urdf(path: Path, text: str) -> Iterator[None]:
    """Write a URDF where none is yet; it is gone again if the rest fails."""
    if path.exists():
        raise ConfigError(f"{path} is there already")
    replace_file(path, text)
    try:
        yield
    # Also at Ctrl-C, as in new_folder: the URDF stands elsewhere.
    except BaseException:
        path.unlink()
        raise


def urdf_place(folder: Path | None) -> Path:
    """Return where URDFs are: ``folder``, or that of the package scara_description."""
    return folder or Path(rospkg.RosPack().get_path("scara_description")) / "urdf"
