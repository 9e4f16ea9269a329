"""Refuse joint vectors that cannot be.

They are no numbers, of the wrong length, or outside the limits of robot.yaml.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from scara_config import Joint

from scara_control.errors import JointLimitError, JointVectorError

LIMIT_TOLERANCE = 1e-9
"""[rad] or [m]: what floating point may put a value beyond a limit (our choice: 10 000 times finer
than the robot's repeatability, 10 000 times coarser than rounding)."""


def check_joint_vector(joints: Sequence[Joint], values: Sequence[float]) -> tuple[float, ...]:
    """Return ``values`` as floats, one finite number per joint.

    Args:
        joints: The joints meant, in order.
        values: Positions or velocities, shape ``(n,)``, SI.

    Raises:
        JointVectorError: Another count than ``joints`` has, or a value that is not finite.
    """
    if len(values) != len(joints):
        names = ", ".join(joint.name for joint in joints)
        raise JointVectorError(f"got {len(values)} joint values, expected {len(joints)}: {names}")
    numbers = tuple(map(float, values))
    # One look at the sum does for all: what is not finite makes the sum so.
    if math.isfinite(sum(numbers)):
        return numbers
    broken = [
        f"{joint.name} = {value}"
        for joint, value in zip(joints, numbers)
        if not math.isfinite(value)
    ]
    # Huge numbers overflow in the sum although each of them is finite.
    if broken:
        raise JointVectorError(f"not finite: {', '.join(broken)}")
    return numbers


def check_limits(joints: Sequence[Joint], q: Sequence[float]) -> tuple[float, ...]:
    """Return joint positions that lie within their limits.

    Args:
        joints: The joints meant, in order.
        q: Joint positions, shape ``(n,)``: [rad], prismatic [m].

    Returns:
        The positions; one beyond a limit by no more than :data:`LIMIT_TOLERANCE` is the limit
        itself.

    Raises:
        JointVectorError: See :func:`check_joint_vector`.
        JointLimitError: A position is outside; the text names each such joint, value and range.
    """
    numbers = check_joint_vector(joints, q)
    for joint, value in zip(joints, numbers):
        if not joint.lower <= value <= joint.upper:
            break
    else:
        return numbers
    outside = [
        (
            f"{joint.name} = {value:.6g} {joint.si_unit} is outside [{joint.lower:.4g}, "
            f"{joint.upper:.4g}]"
        )
        for joint, value in zip(joints, numbers)
        if not joint.lower - LIMIT_TOLERANCE <= value <= joint.upper + LIMIT_TOLERANCE
    ]
    if outside:
        raise JointLimitError("; ".join(outside))
    return tuple(min(max(value, joint.lower), joint.upper) for joint, value in zip(joints, numbers))


def check_velocities(joints: Sequence[Joint], qdot: Sequence[float]) -> tuple[float, ...]:
    """Return joint velocities that no joint is too slow for.

    Args:
        joints: The joints meant, in order.
        qdot: Joint velocities, shape ``(n,)``: [rad/s], prismatic [m/s].

    Raises:
        JointVectorError: See :func:`check_joint_vector`.
        JointLimitError: A speed is above the joint's; the text names each such joint, value and
            range.
    """
    numbers = check_joint_vector(joints, qdot)
    outside = [
        (
            f"{joint.name} = {value:.6g} {joint.si_unit}/s is outside [{-joint.velocity:.4g}, "
            f"{joint.velocity:.4g}]"
        )
        for joint, value in zip(joints, numbers)
        if abs(value) > joint.velocity + LIMIT_TOLERANCE
    ]
    if outside:
        raise JointLimitError("; ".join(outside))
    return numbers


def inside(joints: Sequence[Joint], q: Sequence[float]) -> tuple[float, ...]:
    """Return joint positions within the limits, next to ``q``: what may be planned or commanded.

    A robot at its limit may read a little beyond it.
    """
    return tuple([min(max(each, joint.lower), joint.upper) for joint, each in zip(joints, q)])
