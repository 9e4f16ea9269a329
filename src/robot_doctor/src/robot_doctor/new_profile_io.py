"""Make the files of a new robot from those of one that is there."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

import rospkg
from scara_config import ConfigError, load_robot
from scara_config.faults import nearest
from scara_config.profile import CHOICE, FOLDER, known_robots
from scara_config.writer import replace_file
from scara_description.body import load_body, urdf_of

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
    known = known_robots(config)
    if not NAME.fullmatch(name):
        raise ConfigError(f"{name!r} is no name for a robot: like my_robot_2, a letter first")
    if name in known:
        raise ConfigError(f"{config / FOLDER / name} is there already")
    if source not in known:
        meant = nearest(source, known)
        hint = f"; did you mean {meant}?" if meant else ""
        raise ConfigError(
            f"unknown robot {source!r}: {config / FOLDER} has {', '.join(known)}{hint}"
        )
    folder = config / FOLDER / name
    try:
        shutil.copytree(config / FOLDER / source, folder)
        _rename(folder, name, source)
        _write_urdf(config, folder, name, urdf_folder)
    except (OSError, ConfigError) as error:
        shutil.rmtree(folder, ignore_errors=True)
        raise ConfigError(f"{folder} was not made: {error}") from error
    return folder


def _rename(folder: Path, name: str, source: str) -> None:
    """Put the new name in place of the old one, comments included; a shared URDF stays shared."""
    for file in sorted(folder.rglob("*.yaml")):
        text = file.read_text(encoding="utf-8")
        own_urdf = (folder / "body.yaml").is_file()
        changed = re.sub(
            rf"\b{source}\b(?!\.urdf)" if not own_urdf else rf"\b{source}\b", name, text
        )
        replace_file(file, changed)


def _write_urdf(config: Path, folder: Path, name: str, urdf_folder: Path | None) -> None:
    """Write the URDF from body.yaml, if the robot has one."""
    if not (folder / "body.yaml").is_file():
        return
    before = os.environ.get(CHOICE)
    os.environ[CHOICE] = name
    try:
        robot = load_robot(config)
        text = urdf_of(robot, load_body(robot, config))
    finally:
        if before is None:
            del os.environ[CHOICE]
        else:
            os.environ[CHOICE] = before
    place = urdf_folder or Path(rospkg.RosPack().get_path("scara_description")) / "urdf"
    replace_file(place / robot.urdf, text)
