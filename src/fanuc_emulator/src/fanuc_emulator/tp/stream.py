"""The program that follows the client's set points."""

from __future__ import annotations

from scara_config.programs.files import Taught
from scara_config.programs.tp.execution import flow_of
from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import MotionLine, Program

LINES = ("LBL[1]", "J PR[1] R[2]% CNT100", "JMP LBL[1]")
"""As published clients of R553 have it [src]: MisoRobotics/fanuc-hmi-jointstreaming."""


def stream_program(name: str) -> Taught:
    """Return the program that follows the client's set points."""
    return Taught(flow_of(Program(name, tuple(map(read_line, LINES))), name), {})


def streams(program: Taught) -> bool:
    """Tell whether a program follows PR[1]."""
    lines = program.flow.program.lines
    return any(isinstance(line, MotionLine) and line.targets[0].kind == "PR" for line in lines)
