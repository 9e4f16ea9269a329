"""Velocity kinematics of any open chain: Jacobians of its screw axes, rows (omega, v).

Source: Lynch & Park, Modern Robotics (2017), chapter 5.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from scara_control.kinematics.screws import ScrewModel, joint_vector
from scara_control.kinematics.twists import FloatArray, adjoint, exp6, skew


def space_jacobian(arm: ScrewModel, q: ArrayLike) -> FloatArray:
    r"""Compute the Jacobian of the spatial twist.

    .. math:: J_{s,i}(q) = \mathrm{Ad}_{e^{[S_1]q_1} \cdots e^{[S_{i-1}]q_{i-1}}} S_i

    Its lower half is the velocity of the body's point that passes the base's origin, not that of
    the tool.

    Args:
        arm: Screw axes and home pose.
        q: Joint positions, base to tool, shape ``(n,)``: [rad], prismatic [m].

    Returns:
        Shape ``(6, n)``, in the base frame.

    Raises:
        JointVectorError: ``q`` is not of shape ``(n,)`` or not finite.
    """
    return _along(arm, q)[0]


def tip_jacobian(arm: ScrewModel, q: ArrayLike) -> FloatArray:
    r"""Compute the Jacobian of the tool's angular velocity and of the velocity of its origin.

    .. math:: \dot p = v_s + \omega \times p

    Args:
        arm: Screw axes and home pose.
        q: Joint positions, base to tool, shape ``(n,)``: [rad], prismatic [m].

    Returns:
        Shape ``(6, n)``, rows (omega, velocity of the origin), both in the base frame.

    Raises:
        JointVectorError: ``q`` is not of shape ``(n,)`` or not finite.
    """
    return pose_and_jacobian(arm, q)[1]


def pose_and_jacobian(arm: ScrewModel, q: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Compute the tool's pose and :func:`tip_jacobian` with one way along the chain."""
    jacobian, pose = _along(arm, q)
    # omega x p, written as - p x omega.
    jacobian[3:] -= skew(pose[:3, 3]) @ jacobian[:3]
    return pose, jacobian


def _along(arm: ScrewModel, q: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the space Jacobian and the tool's pose."""
    jacobian, before = np.empty((6, arm.joint_count)), np.eye(4)
    for index, (axis, position) in enumerate(zip(arm.screw_axes.T, joint_vector(arm, q))):
        jacobian[:, index] = adjoint(before) @ axis
        before = before @ exp6(axis * position)
    return jacobian, before @ arm.home_pose
