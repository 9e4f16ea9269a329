"""A program as the robot's listing shows it, and the line that it is in."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import msgspec
from scara_ros.names import STREAM, current_line

from operator_panel.view.snapshot import RobotPackage


class ProgramLine(msgspec.Struct, frozen=True):
    """One line: its number in the listing, how deep it stands in loops, its text."""

    number: int
    depth: int
    text: str


def listing(lines: Sequence[Mapping[str, Any]]) -> tuple[ProgramLine, ...]:
    """Return the lines of a program file, numbered as the robot counts them.

    A loop takes a number of its own, and its lines follow.
    """
    numbered = enumerate(_walked(lines, 0), start=1)
    return tuple(ProgramLine(number, depth, text) for number, (depth, text) in numbered)


def program_text(package: RobotPackage) -> str:
    """Return what the robot executes now, in words.

    A program that has ended is none: the controller calls each end "aborted", a good one too.
    """
    if package.control_type == STREAM and package.running:
        return "follows the twin"
    name, _ = current_line(package.program)
    return package.program if name else "no program runs"


def _walked(lines: Sequence[Mapping[str, Any]], depth: int) -> Iterator[tuple[int, str]]:
    for line in lines:
        yield depth, _text(line)
        yield from _walked(line.get("lines", ()), depth + 1)


def _text(line: Mapping[str, Any]) -> str:
    """Return one line in words."""
    match line.get("do"):
        case "move":
            ending = "stop there" if line.get("termination", "fine") == "fine" else "pass by"
            return f"Move to {line['position']} at {line['speed_percent']:g} %, {ending}"
        case "wait":
            return f"Wait {line['wait_s']:g} s"
        case "gripper":
            return "Grip" if line["value"] == "on" else "Let go"
        case "repeat":
            return f"Repeat {line['times']} times:"
        case other:
            return str(other)
