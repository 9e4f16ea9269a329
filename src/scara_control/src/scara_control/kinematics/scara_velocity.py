"""Velocity kinematics of a SCARA in closed form, damped near the straight arm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from scara_control.errors import ScaraControlError
from scara_control.kinematics.scara import Scara, Triple, tool_yaw
from scara_control.limits import check_joint_vector

DAMPED_BELOW = 0.05
"""Share of the largest manipulability, L1 L2, below which damping sets in: the forearm within 2.9
deg of straight. There 1 m/s of the tool asks for 128 rad/s at most (our choice: exact as long as
slow motion is possible at all)."""

DAMPING = 0.02
"""[m] Damping of the straight arm, where it takes 0.08 % off a sideways velocity (our choice)."""


class JointVelocities(NamedTuple):
    """Joint velocities for a tool velocity.

    Attributes:
        qdot: Of each joint of the arm [rad/s], prismatic [m/s].
        manipulability: abs(det J) of the plane, L1 L2 abs(sin bend) [m^2]; of another arm see
            there.
        damped: The wanted velocity is not reached exactly.
    """

    qdot: tuple[float, ...]
    manipulability: float
    damped: bool


def planar_jacobian(
    scara: Scara, q: Sequence[float]
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Compute the Jacobian of the wrist's (x, y) by (shoulder, elbow), rows x and y [m/rad]."""
    _, shoulder, elbow, _, _, _ = scara.axes
    upper = shoulder.sign * q[shoulder.column]
    fore = upper + elbow.sign * q[elbow.column] + elbow.zero
    upper += shoulder.zero
    x2, y2 = scara.l2 * math.cos(fore), scara.l2 * math.sin(fore)
    x12, y12 = scara.l1 * math.cos(upper) + x2, scara.l1 * math.sin(upper) + y2
    return (
        (-shoulder.sign * y12, -elbow.sign * y2),
        (shoulder.sign * x12, elbow.sign * x2),
    )


def tool_velocity(scara: Scara, q: Sequence[float], qdot: Sequence[float]) -> Triple:
    """Compute the velocity of the tool's origin.

    Args:
        scara: Lengths and axes.
        q: Joint positions, shape ``(n,)``: [rad], prismatic [m].
        qdot: Joint velocities, shape ``(n,)``: [rad/s], prismatic [m/s].

    Returns:
        Velocity in the base frame [m/s].

    Raises:
        JointVectorError: A wrong count or a value that is not finite.
    """
    q, qdot = check_joint_vector(scara.joints, q), check_joint_vector(scara.joints, qdot)
    _, shoulder, elbow, slide, _, _ = scara.axes
    (a, b), (c, d) = planar_jacobian(scara, q)
    w1, w2 = qdot[shoulder.column], qdot[elbow.column]
    vx, vy = _by_turning(scara, q, tool_yaw(scara, qdot))
    return a * w1 + b * w2 + vx, c * w1 + d * w2 + vy, slide.sign * qdot[slide.column]


def joint_velocities(
    scara: Scara, q: Sequence[float], velocity: Sequence[float], yaw_rate: float = 0.0
) -> JointVelocities:
    r"""Compute the joint velocities for a velocity of the tool's origin.

    .. math:: \dot q = J^T (J J^T + \lambda^2 I)^{-1} v, \quad
              \lambda = \lambda_0 (1 - w / w_0) \text{ for } w = |\det J| < w_0, \text{ else } 0

    Args:
        scara: Lengths and axes.
        q: Joint positions, shape ``(n,)``: [rad], prismatic [m].
        velocity: Wanted velocity in the base frame, shape ``(3,)`` [m/s].
        yaw_rate: How fast the tool turns about z of the base [rad/s]. Without a wrist it turns as
            the arm does.

    Returns:
        Joint velocities; limits are not looked at, see :func:`check_velocities`.

    Raises:
        JointVectorError: A wrong count or a value that is not finite.
        ScaraControlError: ``yaw_rate`` for an arm without a wrist, or not finite.

    Source:
        Nakamura & Hanafusa, Inverse kinematic solutions with singularity robustness (1986).
    """
    _, shoulder, elbow, slide, wrist, _ = scara.axes
    if not math.isfinite(yaw_rate):
        raise ScaraControlError(f"yaw_rate = {yaw_rate} is not finite")
    if wrist is None and yaw_rate:
        raise ScaraControlError("yaw_rate: this arm has no joint that turns its tool; leave it 0")
    q = check_joint_vector(scara.joints, q)
    # Three of the joints stand for the three coordinates: their names are in the text.
    vx, vy, vz = check_joint_vector(scara.joints[:3], velocity)
    if wrist is not None:
        by_x, by_y = _by_turning(scara, q, yaw_rate)
        vx, vy = vx - by_x, vy - by_y
    (a, b), (c, d) = planar_jacobian(scara, q)
    manipulability = scara.l1 * scara.l2 * abs(math.sin(scara.bend(q)))
    threshold = DAMPED_BELOW * scara.l1 * scara.l2
    damped = manipulability < threshold
    if damped:
        damping = (DAMPING * (1.0 - manipulability / threshold)) ** 2
        xx, xy, yy = a * a + b * b + damping, a * c + b * d, c * c + d * d + damping
        determinant = xx * yy - xy * xy
        fx, fy = (yy * vx - xy * vy) / determinant, (xx * vy - xy * vx) / determinant
        w1, w2 = a * fx + c * fy, b * fx + d * fy
    else:
        determinant = a * d - b * c
        w1, w2 = (d * vx - b * vy) / determinant, (a * vy - c * vx) / determinant
    qdot = [0.0] * len(scara.joints)
    qdot[shoulder.column], qdot[elbow.column], qdot[slide.column] = w1, w2, slide.sign * vz
    if wrist is not None:
        left = yaw_rate - shoulder.sign * w1 - elbow.sign * w2
        qdot[wrist.column] = wrist.sign * left
    return JointVelocities(tuple(qdot), manipulability, damped)


def _by_turning(scara: Scara, q: Sequence[float], yaw_rate: float) -> tuple[float, float]:
    """Return the velocity that a turn gives the tool's origin, which may be off the wrist [m/s]."""
    wrist, offset = scara.axes.wrist, scara.axes.offset
    if wrist is None or not offset:
        return 0.0, 0.0
    direction = tool_yaw(scara, q) + wrist.zero
    return -yaw_rate * offset * math.sin(direction), yaw_rate * offset * math.cos(direction)
