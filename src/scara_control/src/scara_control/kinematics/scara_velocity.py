"""Velocity kinematics of a SCARA in closed form, damped near the straight arm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from scara_control.kinematics.scara import Scara, Triple
from scara_control.limits import check_joint_vector

DAMPED_BELOW = 0.05
"""Share of the largest manipulability, L1 L2, below which damping sets in: joint_2 within 2.9 deg
of straight. There 1 m/s of the tool asks for 128 rad/s at most (our choice: exact as long as slow
motion is possible at all)."""

DAMPING = 0.02
"""[m] Damping of the straight arm, where it takes 0.08 % off a sideways velocity (our choice)."""


class JointVelocities(NamedTuple):
    """Joint velocities for a tool velocity.

    Attributes:
        qdot: Of each joint of the arm [rad/s], prismatic [m/s].
        manipulability: abs(det J) of the plane, L1 L2 abs(sin q2) [m^2]; of another arm see there.
        damped: The wanted velocity is not reached exactly.
    """

    qdot: tuple[float, ...]
    manipulability: float
    damped: bool


def planar_jacobian(
    scara: Scara, q1: float, q2: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Compute the Jacobian of (x, y) by (joint_1, joint_2), rows x and y [m/rad]."""
    x2, y2 = scara.l2 * math.cos(q1 + q2), scara.l2 * math.sin(q1 + q2)
    return (-scara.l1 * math.sin(q1) - y2, -y2), (scara.l1 * math.cos(q1) + x2, x2)


def tool_velocity(scara: Scara, q: Sequence[float], qdot: Sequence[float]) -> Triple:
    """Compute the velocity of the tool's origin.

    Args:
        scara: Lengths.
        q: Joint positions, shape ``(3,)``: [rad], [rad], [m].
        qdot: Joint velocities, shape ``(3,)``: [rad/s], [rad/s], [m/s].

    Returns:
        Velocity in the base frame [m/s].

    Raises:
        JointVectorError: A wrong count or a value that is not finite.
    """
    q1, q2, _ = check_joint_vector(scara.joints, q)
    w1, w2, up = check_joint_vector(scara.joints, qdot)
    (a, b), (c, d) = planar_jacobian(scara, q1, q2)
    return a * w1 + b * w2, c * w1 + d * w2, up


def joint_velocities(
    scara: Scara, q: Sequence[float], velocity: Sequence[float]
) -> JointVelocities:
    r"""Compute the joint velocities for a velocity of the tool's origin.

    .. math:: \dot q = J^T (J J^T + \lambda^2 I)^{-1} v, \quad
              \lambda = \lambda_0 (1 - w / w_0) \text{ for } w = |\det J| < w_0, \text{ else } 0

    Args:
        scara: Lengths.
        q: Joint positions, shape ``(3,)``: [rad], [rad], [m].
        velocity: Wanted velocity in the base frame, shape ``(3,)`` [m/s].

    Returns:
        Joint velocities; limits are not looked at, see :func:`check_velocities`.

    Raises:
        JointVectorError: A wrong count or a value that is not finite.

    Source:
        Nakamura & Hanafusa, Inverse kinematic solutions with singularity robustness (1986).
    """
    q1, q2, _ = check_joint_vector(scara.joints, q)
    vx, vy, vz = check_joint_vector(scara.joints, velocity)
    (a, b), (c, d) = planar_jacobian(scara, q1, q2)
    manipulability = scara.l1 * scara.l2 * abs(math.sin(q2))
    threshold = DAMPED_BELOW * scara.l1 * scara.l2
    if manipulability >= threshold:
        determinant = a * d - b * c
        return JointVelocities(
            ((d * vx - b * vy) / determinant, (a * vy - c * vx) / determinant, vz),
            manipulability,
            False,
        )
    damping = (DAMPING * (1.0 - manipulability / threshold)) ** 2
    xx, xy, yy = a * a + b * b + damping, a * c + b * d, c * c + d * d + damping
    determinant = xx * yy - xy * xy
    fx, fy = (yy * vx - xy * vy) / determinant, (xx * vy - xy * vx) / determinant
    return JointVelocities((a * fx + c * fy, b * fx + d * fy, vz), manipulability, True)
