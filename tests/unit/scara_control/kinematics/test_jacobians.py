"""Jacobians of any chain, against finite differences and against the article's closed form."""

from __future__ import annotations

import numpy as np
import pytest
from scara_config import load_robot
from scara_control.errors import JointVectorError
from scara_control.kinematics.jacobians import space_jacobian, tip_jacobian
from scara_control.kinematics.screws import ScrewModel, forward_kinematics

ROBOT = load_robot()
ARM = ScrewModel.from_robot(ROBOT)
WHOLE_ARM = ScrewModel.from_joints(
    [joint for joint in ROBOT.joints if joint.screw_axis is not None], ROBOT.home_pose
)
RNG = np.random.default_rng(5)
SLANTED = ScrewModel(
    np.array(
        [
            [0.6, 0, 0.8, 0.1, 0.2, 0.3],
            [0, 1, 0, -0.4, 0, 0.2],
            [0, 0, 0, 0.6, 0.8, 0],
            [0, 0, 1, 0, -0.65, 0],
        ]
    ).T,
    ROBOT.home_pose,
)
ARMS = {"twin": ARM, "with joint_4": WHOLE_ARM, "slanted": SLANTED}
STEP = 1e-6


def derivative(arm: ScrewModel, q: np.ndarray, joint: int) -> np.ndarray:
    """Differentiate the pose by one joint, centrally."""
    ahead, behind = q.copy(), q.copy()
    ahead[joint] += STEP
    behind[joint] -= STEP
    return (forward_kinematics(arm, ahead) - forward_kinematics(arm, behind)) / (2.0 * STEP)


def vee(matrix: np.ndarray) -> np.ndarray:
    """Return the twist of a 4 x 4 matrix form."""
    return np.array([matrix[2, 1], matrix[0, 2], matrix[1, 0], *matrix[:3, 3]])


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
@pytest.mark.parametrize("seed", range(10))
def test_jacobians_are_the_derivative_of_the_pose(arm, seed):
    """[V_s] = T' T^-1, and the tip's lower rows are the derivative of the position."""
    q = np.random.default_rng(seed).uniform(-2.0, 2.0, arm.joint_count)
    inverse = np.linalg.inv(forward_kinematics(arm, q))
    space, tip = space_jacobian(arm, q), tip_jacobian(arm, q)
    for joint in range(arm.joint_count):
        slope = derivative(arm, q, joint)
        np.testing.assert_allclose(space[:, joint], vee(slope @ inverse), atol=1e-8)
        np.testing.assert_allclose(tip[:3, joint], space[:3, joint], atol=1e-15)
        np.testing.assert_allclose(tip[3:, joint], slope[:3, 3], atol=1e-8)


def test_space_jacobian_is_the_one_derived_by_hand():
    """Columns J1 to J4 of the closed form; J4's omega is constant, its axis through the tool."""
    q1, q2 = 0.7, -1.1
    l1, l2 = 0.35, 0.30
    x1, y1 = l1 * np.cos(q1), l1 * np.sin(q1)
    x, y = x1 + l2 * np.cos(q1 + q2), y1 + l2 * np.sin(q1 + q2)
    expected = [[0, 0, 1, 0, 0, 0], [0, 0, 1, y1, -x1, 0], [0, 0, 0, 0, 0, 1], [0, 0, 1, y, -x, 0]]
    np.testing.assert_allclose(
        space_jacobian(WHOLE_ARM, [q1, q2, -0.1, 2.0]).T, expected, atol=1e-15
    )


@pytest.mark.parametrize("function", [space_jacobian, tip_jacobian])
@pytest.mark.parametrize("q", [[0.0], [0.0, np.nan, 0.0]])
def test_refuses_what_is_no_joint_vector(function, q):
    """A Jacobian is never computed from a wrong count or from NaN."""
    with pytest.raises(JointVectorError):
        function(ARM, q)
