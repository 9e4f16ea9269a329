"""A program that the robot starts by itself is judged once, and held only where that is wanted."""

from __future__ import annotations

from unittest.mock import Mock

import msgspec
import pytest
from scara_control.joint_motion import JointMotion
from scara_ros.gate.permit import Permit
from twin_controller.core.events import RealMeasured
from twin_controller.services.own_programs_node import OwnPrograms
from twin_controller.twin_controller_node import Node

RESTS = RealMeasured(0.0, 0.0, 0.0, 0, JointMotion.at_rest((0.0,)))
FREE, REFUSED = Permit(True, "OK: takes 7.01 s"), Permit(False, "REFUSED at 0.31 s")


class Robot:
    """A robot, a judge and a button PAUSE."""

    def __init__(self, judgement: Permit, hold: bool, ends: bool = False) -> None:
        """Let the judge say that; ``ends``: the program ends while it is judged."""
        self.judgement, self.ends = judgement, ends
        self.flags: RealMeasured | None = None
        self.asked: list[dict[str, str]] = []
        self.pauses = 0
        self.programs = OwnPrograms(self, hold, lambda: self.flags, self.pause)

    def ask(self, what: str, who: str = "", **request: str) -> Permit:
        """Be asked for a program."""
        self.asked.append({"who": who, **request})
        if self.ends:
            self.flags = RESTS
        return self.judgement

    def pause(self) -> None:
        """Count."""
        self.pauses += 1

    def runs(self, program: str) -> None:
        """Run a program, or none, and be looked at."""
        self.flags = msgspec.structs.replace(RESTS, own_program=bool(program), program=program)
        thread = self.programs.look()
        if thread is not None:
            thread.join(10.0)


def test_each_start_is_judged_once() -> None:
    """Whatever is looked at meanwhile; again when it is started again or calls another one."""
    robot = Robot(FREE, hold=True)
    robot.programs.look()
    for program in ("ARTICLE", "ARTICLE", "", "ARTICLE", "PALLETISE"):
        robot.runs(program)
    assert [asked["program"] for asked in robot.asked] == ["ARTICLE", "ARTICLE", "PALLETISE"]
    assert {(asked["who"], asked["motion"]) for asked in robot.asked} == {("the robot", "PROGRAM")}
    assert robot.pauses == 0


def test_a_program_that_runs_on_behind_a_lost_link_is_not_held_again() -> None:
    """The robot says nothing for a while; the operator has resumed what was held."""
    robot = Robot(REFUSED, hold=True)
    robot.runs("ARTICLE")
    robot.flags = None
    assert robot.programs.look() is None
    robot.runs("ARTICLE")
    assert (len(robot.asked), robot.pauses) == (1, 1)


@pytest.mark.parametrize(
    ("judgement", "hold", "ends", "pauses"),
    [
        (REFUSED, True, False, 1),
        (REFUSED, False, False, 0),
        (REFUSED, True, True, 0),
        (FREE, True, False, 0),
    ],
)
def test_a_refused_program_is_held_only_where_that_is_wanted(
    judgement: Permit, hold: bool, ends: bool, pauses: int
) -> None:
    """And not if it has ended meanwhile: a pause would then hold what comes next."""
    robot = Robot(judgement, hold, ends)
    robot.runs("ARTICLE")
    assert robot.pauses == pauses


def test_a_pause_that_the_engine_does_not_answer_is_told() -> None:
    """The judge's thread would end with it, and nobody would know that the robot goes on."""
    told = Mock()
    engine = Mock(operate=Mock(side_effect=TimeoutError("no answer within 2 s")))
    Node._pause(Mock(_engine=engine, _publishing=told))
    told.audit.assert_called_once_with(
        "what_if", "PAUSE (hold_own_programs)", False, "the engine gave no answer within 2 s"
    )
