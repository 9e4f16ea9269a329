"""The configuration that a cell starts with: its files, other ports, a change from elsewhere."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import msgspec
from ruamel.yaml import YAML
from scara_config.frames import FILE as FRAMES
from scara_config.profile import PROGRAMS, copy_in_force, locate
from scara_config.programs.keeping import COPIED
from scara_config.rollout.kept import RUNNING, Kept, faults_of, read_kept, write_kept

from scara_bringup.config import DOOR_FILES, Ports

NO_PORTS = Ports()


def copy_with_ports(source: Path, target: Path, ports: Ports = NO_PORTS) -> Path:
    """Copy the chosen robot's files from ``source`` to ``target`` and change the ports.

    Both ends of a line read the port, so it is changed for both.

    The copy is flat: one robot, no folder of robots. Comments are kept. A copy of an earlier start
    that is read again stays where it is. Returns ``target``.
    """
    if not _are_one(source, target):
        copy_in_force(source, target)
        (target / COPIED).write_text(f"{source}\n", encoding="utf-8")
        # Of a change in what stood there before.
        (target / RUNNING).unlink(missing_ok=True)
    for name, port in msgspec.structs.asdict(ports).items():
        if port is not None:
            _change(target / DOOR_FILES[name], ["port"], port)
    if ports.modbus is not None:
        _change(target / "twin_controller.yaml", ["real", "port"], ports.modbus)
    if ports.gateway is not None:
        _change(target / "twin_controller.yaml", ["twin", "url"], f"ws://127.0.0.1:{ports.gateway}")
    return target


def link_taught(source: Path, copied: Path) -> None:
    """Let what people teach, frames and programs, be saved where the next start reads it.

    Args:
        source: Folder of the configuration that was copied.
        copied: The copy, in which nothing else changes.
    """
    if _are_one(source, copied):
        return  # it says already where that is
    shutil.rmtree(copied / PROGRAMS, ignore_errors=True)
    (copied / FRAMES).unlink(missing_ok=True)
    # A robot of which nobody taught any frame has no file yet: the first Save makes it there.
    for name in (PROGRAMS, FRAMES):
        (copied / name).symlink_to(locate(name, source).resolve())


def _are_one(source: Path, copied: Path) -> bool:
    """Return whether a cell reads the copy that an earlier start in the same folder made."""
    return source.resolve() == copied.resolve()


def begin_with_change(file: Path, source: Path) -> Kept:
    """Begin a start: note that the cell's change is tried now, or leave it.

    Args:
        file: Where the cell keeps it.
        source: Folder of the configuration that it is applied to.

    Returns:
        What holds from this start on.

    Raises:
        ConfigError: The file cannot be read or written.
    """
    kept = read_kept(file)
    now = kept.start()
    # What held before may no longer fit, either.
    while now.wanted is not None and (faults := faults_of(now.wanted, source)):
        now = now.unfit(faults[0])
    if now != kept:
        write_kept(file, now)
    return now


def got_ready(file: Path) -> None:
    """Note that the cell has got ready with its change.

    Raises:
        ConfigError: The file cannot be read or written.
    """
    kept = read_kept(file)
    # What was offered meanwhile has not begun: this start proves nothing of it.
    if kept.begun and not kept.proven:
        write_kept(file, kept.ready())


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
