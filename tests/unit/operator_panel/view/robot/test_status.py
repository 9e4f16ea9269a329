"""A program's listing, numbered as the robot numbers it."""

from __future__ import annotations

import pytest
from fanuc_emulator.tp.rehearsal import read_program
from harness.workspace import ROOT
from operator_panel.config import load_surroundings
from operator_panel.view.robot.status import listing, program_text
from operator_panel.view.snapshot import RobotPackage
from scara_config import load_robot
from scara_config.programs.files import program_files
from scara_config.programs.tp.lines import read_line
from scara_config.programs.tp.listing import Program

CONFIG = ROOT / "config"


def test_lines_have_the_numbers_that_the_robot_says() -> None:
    """A step of the robot's own executor is a line of the same number here, a move a move."""
    robot = load_robot(CONFIG)
    shown = {
        program.name: {number: text for number, _, text in listing(program)}
        for program in load_surroundings(robot, CONFIG).programs
    }
    begins = {"WaitStep": "WAIT", "GripperStep": "WAIT RI[1"}
    for name in set(shown) - {"DOCKWTCH"}:  # background logic: no steps
        for step in read_program(program_files(CONFIG)[name], robot, CONFIG).steps:
            begin = begins.get(type(step).__name__, "J P[")
            assert shown[name][step.line].startswith(begin)


def test_what_stands_in_a_block_stands_deeper() -> None:
    """Lines as on the robot's pendant."""
    texts = ("FOR R[51]=1 TO 2", "J P[1:over] 30% CNT0", "IF (DI[1]) THEN", "ELSE", "PAUSE")
    program = Program("TEST", tuple(map(read_line, (*texts, "ENDIF", "ENDFOR", "END"))))
    assert listing(program) == [
        (1, 0, "FOR R[51]=1 TO 2"),
        (2, 1, "J P[1:over] 30% CNT0"),
        (3, 1, "IF (DI[1]) THEN"),
        (4, 1, "ELSE"),
        (5, 2, "PAUSE"),
        (6, 1, "ENDIF"),
        (7, 0, "ENDFOR"),
        (8, 0, "END"),
    ]


@pytest.mark.parametrize(
    ("kind", "running", "said", "shown"),
    [
        ("program", True, "ARTICLE line 5 running", "ARTICLE line 5 running"),
        ("program", False, "ARTICLE line 5 paused", "ARTICLE line 5 paused"),
        ("none", False, "ARTICLE line 8 aborted", "no program runs"),
        ("stream", True, "STREAM line 1 running", "follows the twin"),
        ("none", False, "STREAM line 1 aborted", "no program runs"),
        ("none", False, "", "no program runs"),
    ],
)
def test_a_program_that_has_ended_is_not_called_aborted(
    kind: str, running: bool, said: str, shown: str
) -> None:
    """A good move of the twin ends the robot's stream program, which nobody has aborted."""
    assert program_text(RobotPackage(kind, 50.0, True, running, said)) == shown
