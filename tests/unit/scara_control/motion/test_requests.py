"""Requests for a joint move: what is refused, with which text; how a move ends."""

from __future__ import annotations

import math

import pytest
from scara_config import load_robot
from scara_control.config import load_motion
from scara_control.errors import JointLimitError, JointVectorError
from scara_control.joint_motion import JointMotion
from scara_control.motion.commands import MotionRefusedError
from scara_control.motion.requests import MoveLedger, check_move, check_speed

JOINTS = load_robot().twin_joints
CONFIG = load_motion().move
TARGET = (0.1, 0.2, -0.1, 0.0)


@pytest.mark.parametrize(
    ("names", "positions", "speed", "error", "text"),
    [
        (
            ["elbow"],
            [0.0],
            50.0,
            MotionRefusedError,
            "unknown joint 'elbow': the twin has joint_1, joint_2, joint_3, table_joint",
        ),
        (["joint_4"], [0.0], 50.0, MotionRefusedError, "unknown joint 'joint_4'"),
        (
            ["joint_1", "joint_1"],
            [0.0, 0.0],
            50.0,
            MotionRefusedError,
            "a joint occurs twice: joint_1, joint_1",
        ),
        ([], [0.0] * 3, 50.0, JointVectorError, "got 3 joint values, expected 4"),
        (["joint_1"], [], 50.0, JointVectorError, "got 0 joint values, expected 1: joint_1"),
        ([], [0.0, math.nan, -0.1, 0.0], 50.0, JointVectorError, "not finite: joint_2 = nan"),
        (
            [],
            [0.0, 2.71, -0.1, 0.0],
            50.0,
            JointLimitError,
            r"joint_2 = 2\.71 rad is outside \[-2\.618, 2\.618\]",
        ),
        (
            ["joint_3"],
            [0.001],
            50.0,
            JointLimitError,
            r"joint_3 = 0\.001 m is outside \[-0\.21, 0\]",
        ),
        (
            [],
            TARGET,
            101.0,
            MotionRefusedError,
            r"speed_percent = 101 is outside \[1, 100\] \(0: the default\)",
        ),
        ([], TARGET, -1.0, MotionRefusedError, r"speed_percent = -1 is outside"),
        ([], TARGET, math.nan, MotionRefusedError, r"speed_percent = nan is outside"),
        ([], TARGET, 0.5, MotionRefusedError, r"speed_percent = 0\.5 is outside"),
    ],
)
def test_a_wrong_request_is_refused_by_name_value_and_range(names, positions, speed, error, text):
    """Nothing is clamped."""
    with pytest.raises(error, match=text):
        check_move(JOINTS, names, positions, speed, CONFIG)


@pytest.mark.parametrize(
    ("speed", "percent"), [(0.0, CONFIG.default_speed_percent), (1.0, 1.0), (100.0, 100.0)]
)
def test_speed_zero_is_the_default(speed, percent):
    """A service field that was left out is 0."""
    assert check_speed(speed, CONFIG) == percent


def test_joints_that_are_not_named_hold():
    """A move of one joint is a move of all, with the others where they are."""
    request = check_move(JOINTS, ["table_joint", "joint_1"], [0.5, 0.3], 0.0, CONFIG)
    assert request.target(JOINTS, TARGET) == (0.3, 0.2, -0.1, 0.5)


def ledger_at_end():
    """Return a ledger whose move began at 1 s and whose plan ended at 2 s."""
    ledger = MoveLedger(load_robot(), load_motion())
    ledger.begin(1.0, is_move=True)
    ledger.settle(TARGET, 2.0)
    return ledger


def test_a_move_has_ended_when_the_joints_are_there():
    """Not the plan's end counts but the measured positions."""
    ledger = ledger_at_end()
    away = JointMotion.measured((0.1, 0.21, -0.1, 0.0), (0.0,) * 4, 2.1)
    assert ledger.arrive(away, 2.1) == "" and ledger.running and not ledger.take_outcomes()
    there = JointMotion.measured((0.1001, 0.2, -0.1, 0.0), (0.0,) * 4, 2.5)
    assert ledger.arrive(there, 2.5) == "" and not ledger.running
    (outcome,) = ledger.take_outcomes()
    assert outcome.success
    assert outcome.message == "reached in 1.50 s"
    assert outcome.duration == 1.5
    assert outcome.positions == there.q


def test_a_move_whose_joints_do_not_arrive_fails_and_says_which():
    """Joint, rest and time."""
    ledger = ledger_at_end()
    away = JointMotion.measured((0.1, 0.21, -0.1001, 0.0), (0.0,) * 4, 4.0)
    text = (
        "not reached 2 s after the end of the plan: joint_2 is 0.573 deg from its target; "
        "joint_3 is 0.100 mm from its target"
    )
    assert ledger.arrive(away, 4.0) == text
    (outcome,) = ledger.take_outcomes()
    assert not outcome.success and outcome.message == text


def test_a_move_has_one_outcome_and_a_stream_none():
    """Whoever waits is answered once."""
    ledger = ledger_at_end()
    ledger.end(False, "aborted", None, 3.0)
    ledger.end(False, "again", None, 3.0)
    assert [outcome.message for outcome in ledger.take_outcomes()] == ["aborted"]
    ledger.begin(4.0, is_move=False)
    ledger.end(False, "stream", None, 5.0)
    assert ledger.take_outcomes() == [] and ledger.move_id == 2
