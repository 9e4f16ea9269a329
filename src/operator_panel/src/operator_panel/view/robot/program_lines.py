"""A program as the robot's listing shows it, and the line that it is in."""

from __future__ import annotations

import msgspec
from scara_config.programs.tp.listing import For, IfThen, Program, Word
from scara_config.programs.tp.printer import print_line
from scara_ros.names import STREAM, current_line

from operator_panel.view.snapshot import RobotPackage


class ProgramLine(msgspec.Struct, frozen=True):
    """One line: its number in the listing, how deep it stands in blocks, its text."""

    number: int
    depth: int
    text: str


def listing(program: Program) -> tuple[ProgramLine, ...]:
    """Return the lines of a program as the robot's pendant shows them; blocks stand deeper."""
    found, depth = [], 0
    for number, line in enumerate(program.lines, start=1):
        ends = isinstance(line, Word) and line.words in ("ELSE", "ENDIF", "ENDFOR")
        depth -= ends
        found.append(ProgramLine(number, depth, print_line(line).strip()))
        depth += isinstance(line, For | IfThen) or line == Word("ELSE")
    return tuple(found)


def program_text(package: RobotPackage) -> str:
    """Return what the robot executes now, in words.

    A program that has ended is none: the controller calls each end "aborted", a good one too.
    """
    if package.control_type == STREAM and package.running:
        return "follows the twin"
    name, _ = current_line(package.program)
    return package.program if name else "no program runs"
