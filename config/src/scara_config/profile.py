"""Which robot the cell has.

Everything that belongs to one robot stands in its own folder, ``robots/<name>``.

A file of the robot's folder is taken before one of the same name above it, so a robot brings what
is its own and shares the rest. A flat folder (a run's copy, a test's) has no ``robots`` and holds
one robot.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

from scara_config.faults import nearest
from scara_config.loader import ConfigError, config_directory, package_folder

CHOICE = "SCARA_ROBOT"
DEFAULT = "fanuc_sr6ia"
FOLDER = "robots"
PROGRAMS = "programs"
PROGRAM_ENDING = ".LS"
FARM = "farm"
"""Folder of what a cell tells a farm, and keeps for it."""
PLANTS = "plants"
PLANT_CHOICE = "SCARA_PLANT"
DEFAULT_PLANT = "ideal"
SETTINGS = "settings"
SETTINGS_CHOICE = "SCARA_SETTINGS"


def known_robots(directory: Path | str | None = None) -> list[str]:
    """Return the robots that have a folder in ``directory`` (default: the package scara_config).

    None if it is flat.
    """
    folder = Path(directory or config_directory()) / FOLDER
    return (
        sorted(entry.name for entry in folder.iterdir() if entry.is_dir())
        if folder.is_dir()
        else []
    )


def chosen_robot() -> str:
    """Return the robot that ``SCARA_ROBOT`` names, else the article's."""
    return os.environ.get(CHOICE) or DEFAULT


def robot_folder(directory: Path | str | None = None) -> Path:
    """Return the folder of the chosen robot; in a flat folder this is the folder itself.

    Raises:
        ConfigError: There is no such robot; the text lists those that exist.
    """
    folder = Path(directory or config_directory())
    known = known_robots(folder)
    if not known:
        return folder
    name = chosen_robot()
    if name not in known:
        raise ConfigError(
            f"unknown robot {name!r}: {folder / FOLDER} has {', '.join(known)}{_meant(name, known)}"
        )
    return folder / FOLDER / name


def locate(name: str, directory: Path | str | None = None) -> Path:
    """Return where the file or folder ``name`` is.

    It is with the chosen robot, else in ``directory`` itself.

    A name that is in neither place belongs to the robot: that is where it has to be written.

    Args:
        name: For example ``robot.yaml`` or ``programs``.
        directory: Folder with all YAML files; default: the package scara_config.

    Raises:
        ConfigError: There is no such robot.
    """
    folder = Path(directory or config_directory())
    own, shared = robot_folder(folder) / name, folder / name
    return shared if shared.exists() and not own.exists() else own


def files_in_force(directory: Path | str | None = None) -> dict[str, Path]:
    """Return every YAML file and every program of the chosen robot's cell by its name.

    ``programs/ARTICLE.LS``, ``plants/ideal.yaml`` and ``farm/journal.yaml`` are among them.

    Raises:
        ConfigError: There is no such robot.
    """
    folder = Path(directory or config_directory())
    # The robot's folder last: of two files with one name its own is in force.
    found = {
        path.name: path
        for place in (folder, robot_folder(folder))
        for path in sorted(place.glob("*.yaml"))
        if path.exists()  # a cell's copy names frames.yaml before anybody has taught a frame
    }
    endings = {PROGRAMS: PROGRAM_ENDING, PLANTS: ".yaml", SETTINGS: ".yaml", FARM: ".yaml"}
    for kind, ending in endings.items():
        for path in sorted(locate(kind, folder).glob(f"*{ending}")):
            found[f"{kind}/{path.name}"] = path
    return found


def copy_in_force(source: Path, target: Path) -> None:
    """Copy the chosen robot's files: flat, one robot, no folder of robots; comments are kept.

    A file of the target that the source does not have goes: it would be in force, too. A link in
    the target gives way, so that nothing is written or removed where it leads to.
    """
    target.mkdir(parents=True, exist_ok=True)
    wanted = files_in_force(source)
    for name in {**files_in_force(target), **wanted}:
        for place in dict.fromkeys((target / Path(name).parts[0], target / name)):
            if place.is_symlink():
                place.unlink()
        if name not in wanted:
            (target / name).unlink(missing_ok=True)
    for name, file in wanted.items():
        (target / name).parent.mkdir(exist_ok=True)
        shutil.copy(file, target / name)


def chosen_plant() -> str:
    """Return the plant that ``SCARA_PLANT`` names, else ``ideal``."""
    return os.environ.get(PLANT_CHOICE) or DEFAULT_PLANT


def chosen_settings() -> str:
    """Return what ``SCARA_SETTINGS`` says of how the stand-in was set up; empty: as filed."""
    return os.environ.get(SETTINGS_CHOICE, "")


def plant_path(directory: Path | str | None = None, name: str | None = None) -> Path:
    """Return the file that says how the chosen robot's stand-in behaves.

    Args:
        directory: Folder with all YAML files; default: the package scara_config.
        name: Of the plant, with or without a draw; default: the chosen one.

    Raises:
        ConfigError: There is no such robot or plant; the text lists those that exist. The draw is
            no whole number.
    """
    return _one_of(PLANTS, "plant", plant_draw(name or chosen_plant())[0], directory)


def plant_draw(name: str) -> tuple[str, int | None]:
    """Return a plant's file and the seed by which its numbers are drawn; None: as they are filed.

    Args:
        name: As ``field``, or ``field:7``.

    Raises:
        ConfigError: The draw is no whole number.
    """
    plant, drawn, seed = name.partition(":")
    if not drawn:
        return plant, None
    if not seed.isdecimal():
        raise ConfigError(f"plant = {name}: a draw is a whole number, as {plant}:7")
    return plant, int(seed)


def settings_path(directory: Path | str | None, name: str) -> Path:
    """Return the file that says how the chosen robot's controller was set up.

    Args:
        directory: Folder with all YAML files; None: the package scara_config.
        name: Of the settings.

    Raises:
        ConfigError: There is no such robot or file; the text lists those that exist.
    """
    return _one_of(SETTINGS, "settings", name, directory)


def _one_of(kind: str, what: str, wanted: str, directory: Path | str | None) -> Path:
    """Return the file called ``wanted`` in the chosen robot's folder of a kind."""
    folder = locate(kind, directory)
    known = {path.stem: path for path in sorted(folder.glob("*.yaml"))}
    if wanted not in known:
        there = ", ".join(known) or "none"
        raise ConfigError(
            f"unknown {what} {wanted!r}: {folder} has {there}{_meant(wanted, list(known))}"
        )
    return known[wanted]


def _meant(word: str, known: list[str]) -> str:
    """Return the question whether a known name was meant, empty if none is near."""
    meant = nearest(word, known)
    return f"; did you mean {meant}?" if meant else ""


def description_path(urdf: str) -> Path:
    """Return a robot's URDF in the package ``scara_description``.

    Args:
        urdf: File name, as robot.yaml says.

    Raises:
        ConfigError: ROS cannot find the package, or the file is not there.
    """
    path = package_folder("scara_description") / "urdf" / urdf
    if not path.is_file():
        raise ConfigError(f"{path}: is missing")
    return path
