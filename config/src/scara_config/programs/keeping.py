"""A program becomes one of the robot's: its file in programs/, and a number that starts it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from scara_config.loader import ConfigError, config_directory, load, load_keys
from scara_config.profile import PROGRAM_ENDING, PROGRAMS, locate
from scara_config.programs.files import program_files
from scara_config.writer import replace_file, write_values

COPIED = "copied_from.txt"
"""A run's copy holds it: the folder that was copied."""
NUMBERED = "rsr_programs"
MOST_NUMBERED = 8
"""As many RSR as there are."""
NAME = re.compile(r"[A-Z][A-Z0-9_]{0,15}")
"""Of a program that has a number: our choice, 16 registers of a map hold it."""


def keep_program(name: str, text: str, directory: Path | str | None = None) -> str:
    """Write a program into the chosen robot's folder, and give it the next free number of an RSR.

    The file is whole or as it was before. Both last, also where a cell reads a run's copy.

    Returns:
        The file, and what is still to do, in words.

    Raises:
        ConfigError: The name cannot be that of a numbered program, or a file cannot be written.
    """
    if not NAME.fullmatch(name):
        raise ConfigError(
            f"{name}: one of the robot's programs begins with a capital letter, then come capital "
            "letters, digits and _, 16 signs at most: rename it"
        )
    path = locate("emulator.yaml", directory)
    (numbered,) = load_keys(path, {NUMBERED: list[str]})
    if numbered and name == numbered[0]:
        raise ConfigError(f"{name} is the stream's program: rename yours")
    file = kept_file(name, directory)
    # The file first: a number without its program would start nothing.
    replace_file(file, text)
    # Nothing starts a program of background logic.
    if name in load(path, dict[str, Any]).get("background_programs", ()):
        return f"{file.name}: saved; it counts from the stand-in's next start"
    said = _give_number(path, name)
    if is_copy(directory):
        _give_number(locate(PROGRAMS, directory).resolve().with_name(path.name), name)
    return f"{file.name}: saved{said}"


def kept_file(name: str, directory: Path | str | None = None) -> Path:
    """Return the file of one of the robot's programs, which may not be there yet."""
    new = locate(PROGRAMS, directory) / f"{name}{PROGRAM_ENDING}"
    return program_files(directory).get(name, new)


def is_copy(directory: Path | str | None = None) -> bool:
    """Return whether a folder is a run's copy, of which the next start reads ``programs/`` at most.

    Whoever makes the copy says so in it: not each has links to what was copied.
    """
    return (Path(directory or config_directory()) / COPIED).is_file()


def _give_number(path: Path, name: str) -> str:
    """Let the next free RSR start a program that has none yet; return what to say of it."""
    (numbered,) = load_keys(path, {NUMBERED: list[str]})
    if name in numbered:
        return ""
    if len(numbered) == MOST_NUMBERED:
        return f", but all {MOST_NUMBERED} numbers of {path.name} are taken"
    write_values(path, {(NUMBERED,): [*numbered, name]})
    return f", RSR{len(numbered) + 1}"
