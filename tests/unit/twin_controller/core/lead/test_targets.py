"""A move is judged to its target before it is accepted: an answer of yes is not taken back."""

from __future__ import annotations

import re

import msgspec
import numpy as np
import pytest
from harness.pair import HOME, SETUP, Pair
from scara_control.joint_motion import JointMotion
from scara_control.keep_out.points import positions
from twin_controller.core.actions import MoveTwin
from twin_controller.core.events import MoveEnded, Operator
from twin_controller.core.lead import operator
from twin_controller.core.lead.commands.allowed import refusals
from twin_controller.core.lead.commands.judging import judge_move
from twin_controller.core.lead.modes import Mode
from twin_controller.view import state_view

BELOW_TABLE = (0.4, 0.0, -0.045)


@pytest.mark.parametrize(
    ("target", "elbow", "text"),
    [
        (BELOW_TABLE, "", "below_table"),
        ((0.9, 0.0, 0.0), "", r"0\.9"),
        ((0.3, 0.0, 0.5), "", "joint_3"),
        ((0.4, 0.1, 0.1), "sideways", "elbow = 'sideways' is neither righty nor lefty"),
    ],
)
def test_a_point_that_cannot_be_reached_is_refused_before_anything_moves(
    pair: Pair, target: tuple[float, ...], elbow: str, text: str
) -> None:
    """Until now it was accepted, and stopped 10 ms later."""
    answer = pair.operate("MOVE", target=target, elbow=elbow, speed_percent=20.0)
    assert not answer.success
    assert re.search(text, answer.message), answer.message
    assert pair.mode is Mode.IDLE
    assert not pair.made(MoveTwin)


def test_a_point_that_can_be_reached_is_accepted(pair: Pair) -> None:
    """The twin gets the point as it was given."""
    assert pair.operate("MOVE", target=(0.51, 0.16, 0.10), speed_percent=20.0).success
    (move,) = pair.made(MoveTwin)
    assert move.command == "MOVE" and move.target == (0.51, 0.16, 0.10)


@pytest.mark.parametrize(
    ("yaw", "text"),
    [(0.5, "yaw: this arm has no joint that turns its tool"), (float("nan"), "yaw")],
)
def test_a_yaw_that_the_arm_cannot_have_is_refused(pair: Pair, yaw: float, text: str) -> None:
    """The article's twin leaves joint 4 out; test_yaw.py in virtual time turns one that has it."""
    answer = pair.operate("MOVE", target=(0.51, 0.16, 0.10), yaw=yaw, speed_percent=20.0)
    assert not answer.success and text in answer.message
    assert not pair.made(MoveTwin)


def test_what_is_allowed_at_all_does_not_depend_on_a_target(pair: Pair) -> None:
    """The page asks before anybody has typed one."""
    assert refusals(SETUP, pair.state, pair.now)["MOVE"] == ""


@pytest.mark.parametrize(
    ("command", "target", "elbow"),
    [
        ("MOVE", (0.51, 0.16, 0.10), ""),
        ("MOVE", BELOW_TABLE, ""),
        ("MOVE", (0.9, 0.0, 0.0), ""),
        ("MOVE", (0.4, 0.1, 0.1), "sideways"),
        ("MOVE", (0.0, 0.0, 0.0), ""),
        ("MOVE_JOINTS", (0.1, 0.2, -0.1, 0.0), ""),
        ("MOVE_JOINTS", (9.0, 0.2, -0.1, 0.0), ""),
        ("MOVE_JOINTS", (), ""),
        ("HOME", (), ""),
    ],
)
def test_what_is_only_asked_about_gets_the_answer_of_the_move(
    pair: Pair, command: str, target: tuple[float, ...], elbow: str
) -> None:
    """The preview and the move come to one verdict, in the same words."""
    event = Operator(pair.now, command, 7, 20.0, target, elbow)
    judged = judge_move(SETUP, pair.state.sides.twin, event)
    answer = pair.operate(command, target=target, elbow=elbow, speed_percent=20.0)
    assert answer.success is not bool(judged.refusal)
    if judged.refusal:
        assert answer.message == judged.refusal


def test_what_is_asked_about_is_told_with_its_branch_and_joints(pair: Pair) -> None:
    """The page draws the pose and names the elbow."""
    event = Operator(pair.now, "MOVE", 7, 20.0, (0.51, 0.16, 0.10), "righty")
    judged = judge_move(SETUP, pair.state.sides.twin, event)
    assert judged.elbow == "righty" and f"{judged.elbow}" == "righty"
    assert positions(SETUP.points[0], np.array([judged.target]))[0] == pytest.approx(event.target)
    assert len(judged.target) == len(SETUP.names)


def test_a_line_may_begin_where_a_joint_reads_a_little_beyond_its_limit(pair: Pair) -> None:
    """So does a robot that stands at its limit; its twin is where it is."""
    limits = SETUP.joints[1]
    beyond = (HOME[0], limits.upper + 1e-4, *HOME[2:])
    twin = pair.state.sides.twin
    there = JointMotion.measured(beyond, (0.0,) * len(beyond), twin.last.time)
    twin = msgspec.structs.replace(twin, history=(there,))
    target = (HOME[0], limits.upper - 0.1, *HOME[2:])
    event = Operator(pair.now, "MOVE_JOINTS", 7, 20.0, target, path="linear", speed_mm_s=50.0)
    assert judge_move(SETUP, twin, event).refusal == ""


def test_a_move_without_coordinates_is_refused_with_what_is_missing(pair: Pair) -> None:
    """A message whose fields nobody fills asks for the middle of the base."""
    answer = pair.operate("MOVE", target=(0.0, 0.0, 0.0), speed_percent=20.0)
    assert not answer.success and "MOVE needs the point to move to" in answer.message


def test_a_target_is_judged_only_where_its_move_would_begin(
    pair: Pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Kinematics by numbers take tenths of a second, in which the controller does nothing else."""
    assert pair.operate("MOVE_JOINTS", target=(0.1, 0.2, -0.1, 0.0)).success
    monkeypatch.setattr(operator, "judge_move", pytest.fail)
    answer = pair.operate("MOVE", target=(0.9, 0.0, 0.0))
    assert not answer.success and answer.message == "something else leads: STOP first"


def test_a_way_nearer_than_the_clearance_is_refused(pair: Pair) -> None:
    """The sides stray a little from a way; so it has to stay off the zone by more than that."""
    surface = SETUP.keep_out[0].upper_mm[2] * 1e-3
    clearance = SETUP.config.cell.keep_out_clearance_mm * 1e-3
    near = pair.operate("MOVE", target=(0.5, 0.0, surface + clearance - 1e-3))
    assert not near.success
    assert "come nearer than 5 mm to keep-out zone below_table" in near.message
    assert pair.operate("MOVE", target=(0.5, 0.0, surface + clearance + 1e-3)).success


def test_an_accepted_move_that_fails_is_a_decision_with_its_reason(pair: Pair) -> None:
    """In the state and in why, until the next move begins; it is no line of a log alone."""
    assert pair.operate("MOVE_JOINTS", target=(0.1, 0.2, -0.1, 0.0)).success
    pair.feed(MoveEnded(pair.now, False, "joint_1 stays 3 deg from its target"))
    failed = pair.decisions()[-1]
    assert failed.trigger == "MOVE_FAILED" and failed.mode_after == "OPERATOR_LEADS"
    for text in (failed.why, pair.why, state_view(SETUP, pair.state, pair.now).why):
        assert text == (
            "the operator's move did not reach its target: joint_1 stays 3 deg from its target"
        )
    pair.run(2.0)
    assert pair.mode is Mode.IDLE
    assert "joint_1 stays" in state_view(SETUP, pair.state, pair.now).move_failed
    assert pair.operate("MOVE_JOINTS", target=(0.1, 0.2, -0.1, 0.0)).success
    assert state_view(SETUP, pair.state, pair.now).move_failed == ""


def test_what_ended_a_move_stays_the_reason(pair: Pair) -> None:
    """The twin answers after the STOP that ended its move: both are said, the STOP stays why."""
    assert pair.operate("MOVE_JOINTS", target=(0.1, 0.2, -0.1, 0.0)).success
    pair.do("STOP")
    stopped = pair.why
    pair.feed(MoveEnded(pair.now, False, "cancelled by STOP"))
    assert pair.why == stopped
    assert pair.decisions()[-1].trigger == "MOVE_FAILED"
    assert "cancelled by STOP" in pair.state.lead.move_failed


def test_an_answer_to_an_older_move_says_nothing_of_the_newer_one(pair: Pair) -> None:
    """It comes late, from a node that stood still: the newer move goes on, and may still fail."""
    older = pair.operate("MOVE_JOINTS", target=(0.1, 0.2, -0.1, 0.0))
    number = pair.made(MoveTwin)[-1].number
    pair.do("STOP", run=2.0)
    begun = len(pair.decisions())
    newer = pair.operate("MOVE_JOINTS", target=(0.2, 0.2, -0.1, 0.0))
    assert older.success and newer.success
    assert (number, pair.made(MoveTwin)[-1].number) == (1, 2)
    waits = msgspec.structs.replace(pair.state.lead, move_pending=True, move_failed="")
    pair.state = msgspec.structs.replace(pair.state, lead=waits)
    pair.feed(MoveEnded(pair.now, False, "cancelled by STOP", number))
    assert pair.state.lead == waits
    pair.feed(MoveEnded(pair.now, False, "joint_1 stays 3 deg from its target", number + 1))
    assert not pair.state.lead.move_pending
    assert pair.triggers(begun) == ["MOVE", "MOVE_FAILED"]
