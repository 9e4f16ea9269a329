"""Joint vectors outside the limits of robot.yaml are refused by name, value and range."""

from __future__ import annotations

import math

import pytest
from scara_config import load_robot
from scara_control.errors import JointLimitError, JointVectorError, ScaraControlError
from scara_control.limits import LIMIT_TOLERANCE, check_joint_vector, check_limits, check_velocities

JOINTS = load_robot().arm_joints
LOWER = [joint.lower for joint in JOINTS]
UPPER = [joint.upper for joint in JOINTS]


@pytest.mark.parametrize("q", [[0.0, 0.0, 0.0], LOWER, UPPER, [2.5, -2.6, -0.2], (1, 1, 0)])
def test_positions_within_their_limits_come_back_unchanged(q):
    """The limits themselves are allowed."""
    assert check_limits(JOINTS, q) == tuple(q)


def test_position_beyond_a_limit_by_rounding_is_the_limit():
    """A tool at z = -0.05 gives joint_3 = -0.21000000000000002, which is not outside."""
    assert JOINTS[2].lower > -0.05 - 0.16
    assert check_limits(JOINTS, [0.0, 0.0, -0.05 - 0.16]) == (0.0, 0.0, JOINTS[2].lower)


@pytest.mark.parametrize(
    ("q", "text"),
    [
        ([0.0, 2.71, 0.0], r"^joint_2 = 2\.71 rad is outside \[-2\.618, 2\.618\]$"),
        ([-3.0, 0.0, 0.0], r"^joint_1 = -3 rad is outside \[-2\.583, 2\.583\]$"),
        ([0.0, 0.0, 0.001], r"^joint_3 = 0\.001 m is outside \[-0\.21, 0\]$"),
        ([9.0, 9.0, 9.0], "joint_1 = 9 rad .*; joint_2 = 9 rad .*; joint_3 = 9 m "),
        ([0.0, 0.0, 2.0 * LIMIT_TOLERANCE], "joint_3 = 2e-09 m is outside"),
    ],
)
def test_position_outside_is_refused_with_joint_value_and_range(q, text):
    """Never clamped: the text says which joint, which value, which range."""
    with pytest.raises(JointLimitError, match=text):
        check_limits(JOINTS, q)


@pytest.mark.parametrize("check", [check_joint_vector, check_limits, check_velocities])
@pytest.mark.parametrize(
    ("values", "text"),
    [
        ([], "got 0 joint values, expected 3: joint_1, joint_2, joint_3"),
        ([0.0] * 4, "got 4 joint values, expected 3: joint_1, joint_2, joint_3"),
        ([0.0, math.nan, 0.0], "^not finite: joint_2 = nan$"),
        ([math.inf, 0.0, -math.inf], "^not finite: joint_1 = inf, joint_3 = -inf$"),
    ],
)
def test_what_is_no_joint_vector_is_refused_by_every_check(check, values, text):
    """NaN compares false with every limit, so it is looked for first."""
    with pytest.raises(JointVectorError, match=text):
        check(JOINTS, values)


def test_speed_above_the_joints_is_refused():
    """The limit is symmetric and named with its unit per second."""
    assert check_velocities(JOINTS, [7.6, -12.2, 2.0]) == (7.6, -12.2, 2.0)
    with pytest.raises(
        JointLimitError, match=r"^joint_1 = -7\.7 rad/s is outside \[-7\.679, 7\.679\]$"
    ):
        check_velocities(JOINTS, [-7.7, 0.0, 0.0])


def test_every_refusal_is_one_kind_of_error():
    """A service catches the root and answers with its text."""
    assert issubclass(JointLimitError, ScaraControlError)
    assert issubclass(JointVectorError, ScaraControlError)
    assert issubclass(ScaraControlError, ValueError)
