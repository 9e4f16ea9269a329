"""The answers of the kinematics services, before ROS."""

from __future__ import annotations

import math

import numpy as np
import pytest
from harness.workspace import ROOT
from scara_config import load_robot
from scara_config.profile import CHOICE
from scara_control.errors import (
    JointLimitError,
    JointVectorError,
    ScaraControlError,
    UnreachableError,
)
from scara_control.kinematics.arm_kinematics import ArmKinematics, parse_elbow
from scara_control.kinematics.scara import Elbow
from scipy.spatial.transform import Rotation

KINEMATICS = ArmKinematics(load_robot())
TURNING = ArmKinematics(load_robot(ROOT / "config" / "robots" / "scara_4axis"))


def tool_yaw(q: list[float]) -> float:
    """Return how far the tool is turned from its home pose, about the base's z [rad]."""
    turned = Rotation.from_quat(KINEMATICS.forward(q).orientation)
    home = Rotation.from_quat(KINEMATICS.forward([0.0] * len(q)).orientation)
    return float((turned * home.inv()).as_euler("zyx")[0])


def test_home_is_in_radians_and_metres(monkeypatch):
    """Of an arm that is bent at home; robot.yaml says degrees and millimetres."""
    monkeypatch.setenv(CHOICE, "articulated_six")
    home = ArmKinematics(load_robot()).home
    assert home == pytest.approx(np.radians([0.0, 39.01, 6.25, 0.0, 44.74, 0.0]))


def test_orientation_is_the_tools_at_the_home_pose():
    """Columns of M: tool x along -y, tool y along -x, tool z down."""
    rotation = Rotation.from_quat(KINEMATICS.forward([0.0, 0.0, 0.0]).orientation).as_matrix()
    np.testing.assert_allclose(rotation, [[0, -1, 0], [-1, 0, 0], [0, 0, -1]], atol=1e-15)


@pytest.mark.parametrize(
    "q", [[0.3, 0.9, -0.1], [0.3, 0.9, -0.1, 0.0], [-0.5, 1.4, 0.0, 0.7], [1.0, -2.0, -0.2, -3.0]]
)
def test_tool_is_turned_by_the_sum_of_the_turning_joints(q):
    """R = J1 + J2 + J4, without J4 for three joints."""
    expected = q[0] + q[1] + (q[3] if len(q) == 4 else 0.0)
    assert math.remainder(tool_yaw(q) - expected, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-12)


def test_joint_4_does_not_move_the_tool():
    """Its axis passes through the tool's origin."""
    positions = [KINEMATICS.forward([0.4, -1.0, -0.1, q4]).position for q4 in (0.0, 1.0, -5.0)]
    np.testing.assert_allclose(
        positions, [KINEMATICS.forward([0.4, -1.0, -0.1]).position] * 3, atol=1e-15
    )
    assert KINEMATICS.forward([0.4, -1.0, -0.1]).elbow is Elbow.LEFTY


@pytest.mark.parametrize("q", [[0.3, 0.9, -0.1], [-0.5, 1.4, 0.0, 0.7], [1.0, -2.0, -0.2, -3.0]])
def test_yaw_is_told_in_one_turn(q):
    """The sum of the turning joints, in (-pi, pi], of a twin with or without the fourth."""
    expected = math.remainder(q[0] + q[1] + sum(q[3:]), math.tau)
    assert KINEMATICS.forward(q).yaw == pytest.approx(expected, abs=1e-12)
    if len(q) == 4:
        lower = [q[0], q[1], 0.5 * q[2], q[3]]
        assert TURNING.forward(lower).yaw == pytest.approx(expected, abs=1e-12)


def test_yaw_of_an_arm_that_can_tilt_its_tool_is_from_home(monkeypatch):
    """There its tool points down, whatever it does with all joints at 0."""
    monkeypatch.setenv(CHOICE, "articulated_six")
    six = ArmKinematics(load_robot())
    assert six.forward(six.home).yaw == pytest.approx(0.0, abs=1e-12)
    turned = (six.home[0] + 0.7, *six.home[1:])
    assert six.forward(turned).yaw == pytest.approx(0.7, abs=1e-12)
    assert six.tool.yaw(turned) == pytest.approx(0.7, abs=1e-12)


def test_yaw_is_given_kept_and_refused():
    """Asked for it is reached, left out it stays as in the seed; without a wrist it is refused."""
    seed = (0.4, 1.1, -0.06, 0.7)
    for yaw in (None, -2.9, 0.0, 1.3, 9.0):
        q = TURNING.inverse(0.4, 0.14, 0.1, None, seed, yaw).chosen.q
        pose = TURNING.forward(q)
        wanted = math.remainder(sum(seed) + 0.06 if yaw is None else yaw, math.tau)
        assert pose.position == pytest.approx((0.4, 0.14, 0.1), abs=1e-12)
        assert pose.yaw == pytest.approx(wanted, abs=1e-12)
    with pytest.raises(ScaraControlError, match="yaw: this arm has no joint that turns its tool"):
        KINEMATICS.inverse(0.51, 0.16, 0.1, None, None, 0.0)


def test_yaw_rate_and_the_joints_for_it_are_each_others():
    """The tool turns on the spot, or goes on a line and does not turn."""
    q = [0.2, 1.1, -0.1, 0.4]
    linear, angular = TURNING.velocity(q, [1.0, -2.0, 0.3, 5.0])
    assert angular == pytest.approx((0.0, 0.0, 4.0))
    answer = TURNING.inverse_velocity(q, linear, 4.0)
    assert answer.qdot == pytest.approx((1.0, -2.0, 0.3, 5.0))
    straight = TURNING.inverse_velocity(q, linear).qdot
    assert TURNING.velocity(q, straight)[1] == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    with pytest.raises(JointVectorError, match=r"^tool velocity is not finite: yaw_rate = nan$"):
        TURNING.inverse_velocity(q, (0.0, 0.0, 0.0), math.nan)
    with pytest.raises(JointLimitError, match=r"joint_4 = 40 rad/s is outside \[-31\.42, 31\.42\]"):
        TURNING.inverse_velocity(q, (0.0, 0.0, 0.0), 40.0)
    with pytest.raises(ScaraControlError, match="yaw_rate: this arm has no joint that turns"):
        KINEMATICS.inverse_velocity([0.0, 1.0, 0.0], (0.0, 0.0, 0.0), 0.1)


@pytest.mark.parametrize("count", [0, 2, 5])
def test_forward_refuses_another_count(count):
    """Three joints, or four with joint_4."""
    with pytest.raises(
        JointVectorError, match=f"got {count} joint values, expected 3: .*joint_3, or .*joint_4"
    ):
        KINEMATICS.forward([0.0] * count)


@pytest.mark.parametrize(
    ("q", "text"),
    [
        ([0.0, 2.71, 0.0], r"joint_2 = 2\.71 rad"),
        ([0.0, 0.0, 0.0, 13.0], r"joint_4 = 13 rad is outside \[-12\.57, 12\.57\]"),
    ],
)
def test_forward_refuses_positions_outside_the_limits(q, text):
    """A pose the robot cannot take has no answer."""
    with pytest.raises(JointLimitError, match=text):
        KINEMATICS.forward(q)


def test_inverse_gives_both_branches_and_the_chosen_one():
    """The answer shows what was not chosen, too."""
    answer = KINEMATICS.inverse(0.51, 0.16, 0.1, Elbow.LEFTY)
    assert answer.chosen.elbow is Elbow.LEFTY and answer.chosen.q == answer.lefty
    assert answer.righty is not None and answer.righty[1] == pytest.approx(-answer.chosen.q[1])
    with pytest.raises(UnreachableError, match=r"radius 0\.9"):
        KINEMATICS.inverse(0.9, 0.0, 0.0)


def test_inverse_with_one_branch_allowed_leaves_the_other_empty():
    """Behind the base only one elbow is within the limits."""
    answer = KINEMATICS.inverse(0.3 * math.cos(2.5), 0.3 * math.sin(2.5), 0.0)
    assert answer.chosen.elbow is Elbow.RIGHTY and answer.lefty is None


def test_velocity_and_its_inverse_are_each_others():
    """Same pose, there and back."""
    q = [0.2, 1.1, -0.1]
    linear, angular = KINEMATICS.velocity(q, [1.0, -2.0, 0.3])
    assert angular == pytest.approx((0.0, 0.0, -1.0))
    assert KINEMATICS.inverse_velocity(q, linear).qdot == pytest.approx((1.0, -2.0, 0.3))


@pytest.mark.parametrize(
    ("q", "qdot", "text"),
    [
        ([0.0] * 3, [8.0, 0.0, 0.0], r"joint_1 = 8 rad/s"),
        ([3.0, 0.0, 0.0], [0.0] * 3, "joint_1 = 3 rad "),
    ],
)
def test_velocity_refuses_what_is_outside_the_limits(q, qdot, text):
    """Positions and speeds alike."""
    with pytest.raises(JointLimitError, match=text):
        KINEMATICS.velocity(q, qdot)


def test_inverse_velocity_refuses_a_joint_speed_that_no_joint_has():
    """An undamped answer near the straight arm can be too fast."""
    with pytest.raises(JointLimitError, match=r"joint_2 = .* rad/s is outside \[-12\.22, 12\.22\]"):
        KINEMATICS.inverse_velocity([0.0, 0.06, 0.0], [0.5, 0.0, 0.0])


def test_inverse_velocity_names_the_axis_that_is_not_finite():
    """Not the joint that would have got it."""
    with pytest.raises(JointVectorError, match=r"^tool velocity is not finite: y = nan$"):
        KINEMATICS.inverse_velocity([0.0, 1.0, 0.0], [0.0, math.nan, 0.0])


@pytest.mark.parametrize(
    ("text", "elbow"), [("", None), ("righty", Elbow.RIGHTY), ("lefty", Elbow.LEFTY)]
)
def test_elbow_is_read_from_its_name(text, elbow):
    """The empty name leaves the choice."""
    assert parse_elbow(text) is elbow


def test_unknown_elbow_is_refused():
    """The text says what is allowed."""
    with pytest.raises(
        ScaraControlError, match="elbow = 'left' is neither righty nor lefty nor empty"
    ):
        parse_elbow("left")
