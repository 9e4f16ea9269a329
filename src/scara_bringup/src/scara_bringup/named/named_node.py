"""What belongs to a cell by its name: whether it may start, and what its journal tells."""

from __future__ import annotations

import os
import subprocess

from scara_ros.shell.program_io import command_of

from scara_bringup.named.load_io import load, measure_cores_left
from scara_bringup.named.room import no_room
from scara_bringup.named.turn_io import StartTurn
from scara_bringup.processes.preflight_io import CannotStartError
from scara_bringup.status.running_io import RunningCell, index, running_cells
from scara_bringup.terminal import screen_io as screen


def take_turn(name: str | None) -> StartTurn | None:
    """Wait until no other cell is starting.

    Args:
        name: Of the cell; None: it has none, and starts without a turn where none can be had.

    Raises:
        CannotStartError: The runs folder cannot be written to.
    """
    try:
        return StartTurn(
            index().parent,
            lambda: screen.say("cell: another cell is starting: waiting until it is ready"),
        )
    except OSError as error:
        if name is None:
            return None
        raise CannotStartError(f"{error.filename}: {error.strerror}") from error


def refuse_second(name: str) -> None:
    """Refuse a name that a running cell has.

    Raises:
        CannotStartError: A cell of this name runs.
    """
    for cell in running_cells():
        if cell.name == name:
            raise CannotStartError(
                f"{name} runs already, process {cell.pid}: ./cell status --name {name} shows it; "
                "end it, or choose another name"
            )


def refuse_without_room(name: str) -> None:
    """Refuse to start a cell that would disturb those that run.

    Raises:
        CannotStartError: Less than one processor is free.
    """
    if text := no_room(measure_cores_left(), load().cores, name):
        raise CannotStartError(text)


def ask_why(words: list[str]) -> int:
    """Let ``why`` tell the journal of the cell that is meant; return its exit code.

    A running cell says by itself where its journal is, wherever its folder is.
    """
    cell = meant(words, os.environ.get("ROS_NAMESPACE", ""), running_cells())
    told = list(words)
    if cell is not None and cell.runs and not has_option(words, "--runs"):
        told += ["--runs", cell.runs]
        told += [] if has_option(words, "--name") else ["--name", cell.name]
    return subprocess.call([*command_of("cell_recorder", "why", os.environ), *told])


def has_option(words: list[str], option: str) -> bool:
    """Return whether an option is given, as a word of its own or with its value."""
    return any(word == option or word.startswith(f"{option}=") for word in words)


def meant(words: list[str], namespace: str, cells: list[RunningCell]) -> RunningCell | None:
    """Return the running cell that is asked for: by name, by namespace, or the only one.

    Args:
        words: Of the command line.
        namespace: ROS_NAMESPACE of the shell.
        cells: That run.
    """
    names = [namespace]
    for place, word in enumerate(words):
        if word == "--name":
            names += words[place + 1 : place + 2]
        elif word.startswith("--name="):
            names.append(word.partition("=")[2])
    wanted = names[-1].strip("/")
    if not wanted:
        return cells[0] if len(cells) == 1 else None
    return next((cell for cell in cells if cell.name == wanted), None)
