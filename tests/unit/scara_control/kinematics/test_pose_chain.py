"""One pose in plain numbers is the pose of the matrix exponentials."""

from __future__ import annotations

import numpy as np
import pytest
from scara_config import load_robot
from scara_control.kinematics.pose_chain import PoseChain
from scara_control.kinematics.screws import ScrewModel, forward_kinematics
from scara_control.kinematics.twists import quaternion

ROBOT = load_robot()


def skew_arm(joints: int, seed: int) -> ScrewModel:
    """Return an arm of random screws: turning, sliding, and both at once."""
    rng = np.random.default_rng(seed)
    axes = rng.normal(size=(6, joints))
    axes[:3] /= np.linalg.norm(axes[:3], axis=0)
    axes[:3, ::3] = 0.0
    axes[3:, ::3] /= np.linalg.norm(axes[3:, ::3], axis=0)
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    home = np.eye(4)
    home[:3, :3], home[:3, 3] = turn * np.sign(np.linalg.det(turn)), rng.normal(size=3)
    return ScrewModel(axes, home)


def upright_arm(seed: int) -> ScrewModel:
    """Return an arm whose joints turn about z, as a SCARA's, with a tool that points anywhere."""
    home = skew_arm(1, seed).home_pose
    points = np.random.default_rng(seed).normal(size=(3, 3))
    axis = np.array([0.0, 0.0, 1.0])
    axes = [np.concatenate([axis, -np.cross(axis, point)]) for point in points]
    return ScrewModel(np.array(axes).T, home)


ARMS = {
    "the robot": ScrewModel.from_robot(ROBOT),
    "upright": upright_arm(3),
    **{f"{n} joints": skew_arm(n, n) for n in (1, 2, 5, 7)},
}


@pytest.mark.parametrize("arm", list(ARMS.values()), ids=list(ARMS))
def test_pose_is_that_of_the_matrix_exponentials(arm):
    """Any open chain: position to rounding, quaternion with the same sign."""
    chain = PoseChain(arm)
    for q in np.random.default_rng(1).uniform(-3.0, 3.0, (200, arm.joint_count)):
        position, orientation = chain.pose(q.tolist())
        pose = forward_kinematics(arm, q)
        np.testing.assert_allclose(position, pose[:3, 3], atol=1e-13 * max(1.0, np.abs(pose).max()))
        np.testing.assert_allclose(orientation, quaternion(pose[:3, :3]), atol=1e-12)


def test_pose_at_zero_is_the_home_pose():
    """No motion, no rounding."""
    arm = ScrewModel.from_robot(ROBOT)
    position, orientation = PoseChain(arm).pose([0.0] * arm.joint_count)
    assert position == tuple(arm.home_pose[:3, 3])
    assert orientation == quaternion(arm.home_pose[:3, :3])
