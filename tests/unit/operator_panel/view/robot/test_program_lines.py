"""A program's listing, numbered as the robot numbers it."""

from __future__ import annotations

import pytest
from fanuc_emulator.config import load_programs
from harness.workspace import ROOT
from operator_panel.config import load_surroundings
from operator_panel.view.robot.program_lines import listing, program_text
from operator_panel.view.snapshot import RobotPackage
from scara_config import load_robot

CONFIG = ROOT / "config"


def test_lines_have_the_numbers_that_the_robot_says() -> None:
    """A step of the robot's own executor is a line of the same number here, a move a move."""
    robot = load_robot(CONFIG)
    shown = {
        program.name: {line.number: line.text for line in listing(program.lines)}
        for program in load_surroundings(robot, CONFIG).programs
    }
    words = {"MoveStep": "Move to", "WaitStep": "Wait"}
    for program in load_programs(robot, CONFIG).values():
        for step in program.steps:
            text = shown[program.name][step.line]
            assert text.startswith(words.get(type(step).__name__, ("Grip", "Let go")))


def test_loop_takes_a_number_and_its_lines_stand_deeper() -> None:
    """As FOR .. ENDFOR does."""
    move = {"do": "move", "position": "A", "speed_percent": 30, "termination": "cnt"}
    inner = [move, {"do": "gripper", "value": "on"}]
    found = listing([{"do": "wait", "wait_s": 0.5}, {"do": "repeat", "times": 2, "lines": inner}])
    assert [(line.number, line.depth, line.text) for line in found] == [
        (1, 0, "Wait 0.5 s"),
        (2, 0, "Repeat 2 times:"),
        (3, 1, "Move to A at 30 %, pass by"),
        (4, 1, "Grip"),
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
