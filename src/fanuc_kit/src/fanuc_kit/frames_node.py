"""Compare frames.yaml with a robot's frames: rosrun fanuc_kit frames ADDRESS|FILE ...

A file is a printout of the controller (SYSFRAME.VA), or a program whose remarks tell its frames.
``--save`` writes what differs into frames.yaml; nothing is ever written to a robot. Exit code 0:
the same, or saved; 1: they differ; 2: it cannot be read, or is not taken over.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from scara_config import ConfigError
from scara_config.frames import (
    FILE,
    LETTERS,
    VARIABLES,
    WORDS,
    Kind,
    Numbered,
    find_frames,
    frame_differences,
    save_theirs,
)
from scara_config.loader import load_text
from scara_config.modbus_map import load_modbus_map
from scara_config.profile import PROGRAM_ENDING, chosen_robot
from scara_config.programs.frame_remarks import told_frames
from scara_config.programs.tp.reader import read
from scara_config.set_up.slots import FRAMES, frames_of
from scara_ros.shell.command_line_io import CommandLine, ConfigDir, RobotName, choose_robot
from scara_ros.shell.program_io import FAILED, WRONG
from twin_controller.modbus.blocks import Block
from twin_controller.modbus.port_io import LinkLostError, ModbusPort

from fanuc_kit.printouts import Printout, read_printout

ANSWERS_S = 2.0
"""So long one answer is waited for."""
app = CommandLine(
    "frames", dict.fromkeys((ConfigError, LinkLostError, OSError), WRONG), help="Compare frames."
)


@app.command()
def frames(
    source: Annotated[
        list[str], typer.Argument(help="The robot, printouts, or programs.", metavar="ADDRESS|FILE")
    ],
    port: Annotated[int, typer.Option(help="Its Modbus port.", min=1, max=65535)] = 502,
    save: Annotated[bool, typer.Option("--save", help=f"Take over what differs: {FILE}.")] = False,
    robot: RobotName = None,
    config_dir: ConfigDir = None,
) -> None:
    """Compare frames.yaml with a robot's frames."""
    choose_robot(robot)
    files = [Path(each) for each in source]
    if all(path.is_file() for path in files):
        theirs: Numbered = {}
        for path in files:
            theirs = {**theirs, **_told(path)}
        whose = "file"
    elif len(source) == 1:
        theirs, whose = _asked(source[0], port, load_modbus_map(config_dir).device_id), "robot"
    else:
        missing = next(path for path in files if not path.is_file())
        raise ConfigError(f"{missing}: there is no such file")
    console, ours = Console(highlight=False, soft_wrap=True), find_frames(config_dir)
    differ = list(frame_differences(theirs, ours, whose))
    for line in differ:
        console.print(line, markup=False)
    said = f"{len(theirs)} frames looked at, {len(differ)} differ"
    if differ and save:
        count = save_theirs(config_dir, theirs, ours, from_slots=whose == "robot")
        said += f"; {count} written to {FILE}"
    console.print(said, markup=False)
    raise typer.Exit(FAILED if differ and not save else 0)


def _told(path: Path) -> Numbered:
    """Return the frames that a file tells.

    Raises:
        ConfigError: It tells none, or not all six numbers of one.
        OSError: It cannot be read.
    """
    if path.suffix.upper() == PROGRAM_ENDING:
        found = told_frames(read(load_text(path), str(path)))
    else:
        printout = Printout()
        read_printout(path.read_text(encoding="utf-8", errors="replace"), path.name, printout)
        found = _printed(printout, path)
    if not found:
        raise ConfigError(f"{path}: tells no frames, as SYSFRAME.VA and remarks of programs do")
    return found


def _printed(printout: Printout, path: Path) -> Numbered:
    """Return the frames of the first group in a printout.

    Raises:
        ConfigError: One has not all six numbers, as where the file was cut off.
    """
    found: dict[tuple[Kind, int], tuple[float, ...]] = {}
    for kind, variable in VARIABLES.items():
        form = re.compile(re.escape(variable) + rf"\[1,(\d+)\]\.[{LETTERS}]")
        numbers = {int(hit[1]) for hit in map(form.fullmatch, printout.variables) if hit}
        for number in sorted(numbers):
            values = [printout.variables.get(f"{variable}[1,{number}].{at}") for at in LETTERS]
            told = tuple(value for value in values if isinstance(value, float))
            # A number that is not told is no 0: it would be written over a taught one.
            if len(told) < len(LETTERS):
                what = f"{WORDS[kind]}[{number}] tells {len(told)} of {', '.join(LETTERS)}"
                raise ConfigError(f"{path}: {what}: the file is damaged or cut off, print it anew")
            found[kind, number] = told
    return found


def _asked(host: str, port: int, unit: int) -> Numbered:
    """Return the frames that a robot shows.

    Raises:
        LinkLostError: Nobody answers.
        ConfigError: No slot shows frames, or nobody ever set one.
    """
    one = ModbusPort(host, port, unit, ANSWERS_S)
    one.open()
    try:
        words = {
            kind: one.read_words(Block(slot.address - 1, slot.size))
            for kind, slot in FRAMES.items()
        }
    finally:
        one.close()
    # A controller answers 0, and no exception, where no slot stands: both look the same from here.
    if not any(map(any, words.values())):
        names = ", ".join(f"{slot.name} at {slot.address}" for slot in FRAMES.values())
        raise ConfigError(
            f"{host}: all frames read 0: nobody has set one, or the slots {names} are not there: "
            f"`rosrun fanuc_kit write {host} --robot {chosen_robot()}`"
        )
    return frames_of(words)


main = app.run
