"""The real robot in words: who may move it, drives, stop, motion, and the program it is in."""

from __future__ import annotations

from scara_config.programs.tp.listing import For, IfThen, Program, Word
from scara_config.programs.tp.printer import print_line
from scara_ros.names import STREAM, current_line

from operator_panel.view.snapshot import RobotPackage, RobotStatus

YES, NO = 1, 0
MODES = {1: "by hand, at its pendant", 2: "automatic"}
SWITCH = {
    "AUTO": "AUTO: automatic, can be started from here",
    "T1": "T1: by hand, at most 250 mm/s, started at its pendant",
    "T2": "T2: by hand, full speed, started at its pendant",
}
"""Where its mode switch stands says more than that somebody may move it by hand."""
UNKNOWN = "not known"


def status_texts(status: RobotStatus | None, switch: str = "") -> dict[str, str]:
    """Return what stands on the page, by place.

    Args:
        status: What the robot says; None: nothing.
        switch: At what its mode switch stands; empty: it does not tell.
    """
    if status is None:
        return dict.fromkeys(
            ("status.mode", "status.drives", "status.stop", "status.motion", "status.error"),
            UNKNOWN,
        )
    motion = "moves"
    if status.in_motion != YES:
        motion = _answer(status.motion_possible, "stands, can move", "stands, cannot move")
    error = _answer(status.in_error, "yes", "none")
    if status.in_error == YES and status.error_code:
        error = f"yes, number {status.error_code}"
    return {
        "status.mode": SWITCH.get(switch, MODES.get(status.mode, UNKNOWN)),
        "status.drives": _answer(status.drives_powered, "on", "off"),
        "status.stop": _answer(status.e_stopped, "pressed", "not pressed"),
        "status.motion": motion,
        "status.error": error,
    }


def _answer(value: int, yes: str, no: str) -> str:
    return {YES: yes, NO: no}.get(value, UNKNOWN)


def listing(program: Program) -> list[tuple[int, int, str]]:
    """Return the lines of a program as the robot's pendant shows them.

    Of each its number, how deep it stands in blocks, and its text.
    """
    found, depth = [], 0
    for number, line in enumerate(program.lines, start=1):
        ends = isinstance(line, Word) and line.words in ("ELSE", "ENDIF", "ENDFOR")
        depth -= ends
        found.append((number, depth, print_line(line).strip()))
        depth += isinstance(line, For | IfThen) or line == Word("ELSE")
    return found


def program_text(package: RobotPackage) -> str:
    """Return what the robot executes now, in words.

    A program that has ended is none: the controller calls each end "aborted", a good one too.
    """
    if package.control_type == STREAM and package.running:
        return "follows the twin"
    name, _ = current_line(package.program)
    return package.program if name else "no program runs"
