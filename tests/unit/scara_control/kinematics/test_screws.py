"""Product of exponentials: one or many joint vectors, any open chain."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from msgspec.structs import replace
from scara_config import load_robot
from scara_control.errors import JointVectorError, ScrewModelError
from scara_control.kinematics.screws import (
    ScrewModel,
    forward_kinematics,
    forward_kinematics_batch,
    tool_position,
    tool_positions,
)
from scara_control.kinematics.twists import adjoint, twist_matrix
from scipy.linalg import expm

ROBOT = load_robot()
ARM = ScrewModel.from_robot(ROBOT)
WHOLE_ARM = ScrewModel.from_joints(
    [joint for joint in ROBOT.joints if joint.screw_axis is not None], ROBOT.home_pose
)


def six_axis_arm() -> ScrewModel:
    """Build a chain of six turning joints in general position."""
    rng = np.random.default_rng(6)
    omegas = rng.normal(size=(6, 3))
    omegas /= np.linalg.norm(omegas, axis=1)[:, None]
    points = rng.normal(size=(6, 3))
    axes = np.hstack([omegas, -np.cross(omegas, points)]).T
    home = expm(twist_matrix(rng.normal(size=6)))
    home[3] = [0.0, 0.0, 0.0, 1.0]
    return ScrewModel(axes, home)


ARMS = {"twin": ARM, "with joint_4": WHOLE_ARM, "six axes": six_axis_arm()}


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@settings(deadline=None, max_examples=50)
@given(data=st.data())
def test_pose_equals_the_product_of_general_matrix_exponentials(arm, data):
    """T = exp([S1] q1) .. exp([Sn] qn) M, by scipy's expm."""
    q = data.draw(arrays(float, arm.joint_count, elements=st.floats(-6.0, 6.0)))
    expected = arm.home_pose
    for axis, position in reversed(list(zip(arm.screw_axes.T, q))):
        expected = expm(twist_matrix(axis) * position) @ expected
    np.testing.assert_allclose(forward_kinematics(arm, q), expected, atol=1e-10)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_many_joint_vectors_give_what_each_alone_gives(arm):
    """The batch functions are the same formula."""
    q = np.random.default_rng(1).uniform(-3.0, 3.0, (200, arm.joint_count))
    expected = np.array([forward_kinematics(arm, row) for row in q])
    np.testing.assert_allclose(forward_kinematics_batch(arm, q), expected, atol=1e-12)
    np.testing.assert_allclose(tool_positions(arm, q), expected[:, :3, 3], atol=1e-12)
    alone = [tool_position(arm, row.tolist()) for row in q]
    np.testing.assert_allclose(alone, expected[:, :3, 3], atol=1e-12)


def test_body_screws_are_those_of_the_article():
    """B1 = (0 0 -1, -0.65 0 0) as the article derives it, and the other joints alike."""
    expected = [
        [0, 0, -1, -0.65, 0, 0],
        [0, 0, -1, -0.30, 0, 0],
        [0, 0, 0, 0, 0, -1],
        [0, 0, -1, 0, 0, 0],
    ]
    body_screws = adjoint(np.linalg.inv(WHOLE_ARM.home_pose)) @ WHOLE_ARM.screw_axes
    np.testing.assert_allclose(body_screws.T, expected, atol=1e-15)


def test_twin_arm_has_the_joints_that_move_the_tool_in_file_order():
    """The table does not move the tool; joint_4 is not moved by the twin."""
    assert [joint.name for joint in ROBOT.arm_joints] == ["joint_1", "joint_2", "joint_3"]
    assert ARM.joint_count == 3


def test_order_of_wrist_and_stroke_does_not_matter():
    """Their axes coincide: the article counts R R R P, the robot R R P R."""
    swapped = ScrewModel(WHOLE_ARM.screw_axes[:, [0, 1, 3, 2]], WHOLE_ARM.home_pose)
    q = np.array([0.3, -0.9, -0.1, 2.0])
    np.testing.assert_allclose(
        forward_kinematics(swapped, q[[0, 1, 3, 2]]), forward_kinematics(WHOLE_ARM, q), atol=1e-15
    )


def test_no_joint_vectors_give_no_poses():
    """An empty batch is a batch."""
    assert tool_positions(ARM, np.empty((0, 3))).shape == (0, 3)
    assert forward_kinematics_batch(ARM, np.empty((0, 3))).shape == (0, 4, 4)


def test_model_cannot_be_changed():
    """The model is frozen, its arrays included."""
    with pytest.raises(ValueError, match="read-only"):
        ARM.screw_axes[0, 0] = 1.0


@pytest.mark.parametrize(
    ("q", "text"),
    [
        ([0.0, 0.0], r"shape \(2,\), expected \(3,\)"),
        ([[0.0, 0.0, 0.0]], r"shape \(1, 3\), expected \(3,\)"),
        ([0.0, np.nan, 0.0], "not finite"),
        ([0.0, 0.0, np.inf], "not finite"),
    ],
)
def test_refuses_what_is_no_joint_vector(q, text):
    """A pose is never computed from a wrong count or from NaN."""
    with pytest.raises(JointVectorError, match=text):
        forward_kinematics(ARM, q)


@pytest.mark.parametrize("function", [forward_kinematics_batch, tool_positions])
def test_refuses_what_is_no_joint_matrix(function):
    """The batch functions want (m, n)."""
    with pytest.raises(JointVectorError, match=r"shape \(3,\), expected \(m, 3\)"):
        function(ARM, [0.0, 0.0, 0.0])


@pytest.mark.parametrize(
    ("axes", "home", "text"),
    [
        (np.zeros((3, 6)), np.eye(4), r"screw_axes has shape \(3, 6\)"),
        (np.zeros((6, 0)), np.eye(4), r"screw_axes has shape \(6, 0\)"),
        ([[0], [0], [2], [0], [0], [0]], np.eye(4), "screw axis 1 .* has length 2, expected 1"),
        ([[0], [0], [0], [0], [0], [0]], np.eye(4), "has length 0, expected 1"),
        ([[0], [0], [np.nan], [0], [0], [0]], np.eye(4), "has length nan"),
        ([[0], [0], [1], [0], [np.inf], [0]], np.eye(4), "screw axis 1 .*inf"),
        ([[0], [0], [1], [0], [0], [0]], np.eye(3), "no 4 x 4 homogeneous transform"),
        ([[0], [0], [1], [0], [0], [0]], np.diag([1.0, 1.0, -1.0, 1.0]), "no proper rotation"),
        ([[0], [0], [1], [0], [0], [0]], np.diag([2.0, 0.5, 1.0, 1.0]), "no proper rotation"),
    ],
)
def test_refuses_what_is_no_mechanism(axes, home, text):
    """A wrong profile is found when the model is built, not in a pose."""
    with pytest.raises(ScrewModelError, match=text):
        ScrewModel(np.array(axes, dtype=float), home)


def test_refuses_a_joint_without_screw_axis():
    """The table cannot be a joint of the arm."""
    with pytest.raises(ScrewModelError, match="no screw_axis: table_joint"):
        ScrewModel.from_joints(ROBOT.twin_joints, ROBOT.home_pose)


def test_directions_of_a_few_digits_are_unit_vectors():
    """A profile's axis at 45 degrees has as many as somebody types, and so has its tool's turn."""
    half = 0.7071
    leaning = replace(ROBOT.arm_joints[0], screw_axis=(half, 0.0, half, 0.0, 0.42426, 0.0))
    home = [[half, 0.0, half, 0.1], [0, 1, 0, 0], [-half, 0.0, half, 0.2], [0, 0, 0, 1]]
    arm = ScrewModel.from_joints([leaning], home)
    assert np.linalg.norm(arm.screw_axes[:3, 0]) == pytest.approx(1.0, abs=1e-12)
    place = arm.screw_axes[4, 0] / arm.screw_axes[2, 0]
    assert place == pytest.approx(0.42426 / half, rel=1e-12), "the axis stays where it is"
    assert arm.home_pose[:3, 3].tolist() == [0.1, 0.0, 0.2]
    shipped = np.array([joint.screw_axis for joint in ROBOT.arm_joints]).T
    assert (ARM.screw_axes == shipped).all()
    with pytest.raises(ScrewModelError, match=r"has length 1\.1, expected 1"):
        ScrewModel.from_joints([replace(leaning, screw_axis=(1.1, 0, 0, 0, 0, 0))], np.eye(4))
