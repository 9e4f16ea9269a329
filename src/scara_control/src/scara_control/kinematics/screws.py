"""Forward kinematics of any open chain from its screw axes: product of exponentials.

Nothing here knows a SCARA: joints are columns of ``screw_axes``, turning or sliding, as many as
there are.

Source: Lynch & Park, Modern Robotics (2017), chapter 4.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from scara_config import Joint, Robot
from scara_config.robot import UNIT_TOLERANCE

from scara_control.errors import JointVectorError, ScrewModelError
from scara_control.kinematics.twists import FloatArray, exp6, twist_matrix

Point = tuple[float, float, float]

_RIGID_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class ScrewModel:
    """An open chain at its home pose.

    Attributes:
        screw_axes: Unit screws ``(omega, v)`` in the base frame {s}, shape ``(6, n)``, base to
            tool.
        home_pose: Pose of the tool frame {b} in {s} at zero joints, shape ``(4, 4)``.

    Raises:
        ScrewModelError: A wrong shape, a screw that is not of unit length, a home pose that is no
            rigid motion.
    """

    screw_axes: FloatArray
    home_pose: FloatArray

    def __post_init__(self) -> None:
        axes, pose = np.array(self.screw_axes, dtype=float), np.array(self.home_pose, dtype=float)
        _check_screws(axes)
        _check_pose(pose)
        for field, value in (("screw_axes", axes), ("home_pose", pose)):
            # Frozen holds for the names alone: what is cached would not follow a changed array.
            value.setflags(write=False)
            object.__setattr__(self, field, value)

    @classmethod
    def from_joints(cls, joints: Sequence[Joint], home_pose: ArrayLike) -> ScrewModel:
        """Build the chain of ``joints``, base to tool.

        Raises:
            ScrewModelError: A joint has no screw axis, or see :class:`ScrewModel`.
        """
        without = [joint.name for joint in joints if joint.screw_axis is None]
        if without:
            raise ScrewModelError(f"no screw_axis: {', '.join(without)}")
        axes = np.array([joint.screw_axis for joint in joints], dtype=float)
        pose = np.array(home_pose, dtype=float)
        # A profile writes directions with a few digits.
        for axis in axes:
            part = axis[:3] if axis[:3].any() else axis[3:]
            if _RIGID_TOLERANCE < abs((length := np.linalg.norm(part)) - 1.0) < UNIT_TOLERANCE:
                axis /= length
        if pose.shape == (4, 4):
            left, stretch, right = np.linalg.svd(pose[:3, :3])
            if _RIGID_TOLERANCE < np.abs(stretch - 1.0).max() < UNIT_TOLERANCE:
                pose[:3, :3] = left @ right
        return cls(axes.T, pose)

    @classmethod
    def from_robot(cls, robot: Robot) -> ScrewModel:
        """Build the chain of the joints of robot.yaml that move the twin's tool, in file order."""
        return cls.from_joints(robot.arm_joints, robot.home_pose)

    @property
    def joint_count(self) -> int:
        """Number of joints, n."""
        return int(self.screw_axes.shape[1])

    @cached_property
    def plain_screws(self) -> tuple[tuple[bool, Point, Point], ...]:
        """For each joint, base to tool: whether it turns, ``omega`` and ``v`` as plain numbers."""
        rows = self.screw_axes.T.tolist()
        return tuple((any(row[:3]), tuple(row[:3]), tuple(row[3:])) for row in rows)

    @cached_property
    def screw_matrices(self) -> tuple[tuple[bool, FloatArray], ...]:
        """For each joint, tool to base: whether it turns, and its screw's matrix, transposed."""
        return tuple((bool(s[:3].any()), twist_matrix(s).T) for s in self.screw_axes.T[::-1])

    @cached_property
    def home_origin(self) -> Point:
        """The tool's origin in the base frame at zero joints [m]."""
        x, y, z = self.home_pose[:3, 3].tolist()
        return x, y, z


def _check_screws(axes: FloatArray) -> None:
    """Raise ScrewModelError unless each column is a unit screw."""
    if axes.ndim != 2 or axes.shape[0] != 6 or axes.shape[1] == 0:
        raise ScrewModelError(f"screw_axes has shape {axes.shape}, expected (6, n)")
    for number, axis in enumerate(axes.T, start=1):
        turning = np.linalg.norm(axis[:3])
        length = np.linalg.norm(axis[3:]) if turning == 0.0 else turning
        if not (np.isfinite(axis).all() and abs(length - 1.0) <= _RIGID_TOLERANCE):
            raise ScrewModelError(
                f"screw axis {number} = {axis.tolist()} has length {length:.6g}, expected 1"
            )


def _check_pose(pose: FloatArray) -> None:
    """Raise ScrewModelError unless ``pose`` is a proper rigid motion."""
    if pose.shape != (4, 4) or not np.array_equal(pose[3], [0.0, 0.0, 0.0, 1.0]):
        raise ScrewModelError(f"home_pose is no 4 x 4 homogeneous transform: {pose.tolist()}")
    rotation = pose[:3, :3]
    orthogonal = np.allclose(rotation @ rotation.T, np.eye(3), rtol=0.0, atol=_RIGID_TOLERANCE)
    if not orthogonal or np.linalg.det(rotation) < 0.0:
        raise ScrewModelError(f"home_pose holds no proper rotation: {rotation.tolist()}")


def joint_vector(arm: ScrewModel, q: ArrayLike) -> FloatArray:
    """Return ``q`` as an array of shape ``(n,)``.

    Raises:
        JointVectorError: ``q`` is not of shape ``(n,)`` or not finite.
    """
    vector = np.asarray(q, dtype=float)
    if vector.shape != (arm.joint_count,):
        raise JointVectorError(
            f"joint vector has shape {vector.shape}, expected ({arm.joint_count},)"
        )
    if not np.isfinite(vector).all():
        raise JointVectorError(f"joint vector is not finite: {vector.tolist()}")
    return vector


def forward_kinematics(arm: ScrewModel, q: ArrayLike) -> FloatArray:
    r"""Compute the pose of the tool frame {b} in the base frame {s}.

    .. math:: T_{sb}(q) = e^{[S_1] q_1} \cdots e^{[S_n] q_n} M

    Args:
        arm: Screw axes and home pose.
        q: Joint positions, base to tool, shape ``(n,)``: [rad], prismatic [m].

    Returns:
        Homogeneous transform ``T_sb``, shape ``(4, 4)``, translation in [m].

    Raises:
        JointVectorError: ``q`` is not of shape ``(n,)`` or not finite. Limits: see
            :func:`check_limits`.

    Source:
        Lynch & Park, Modern Robotics (2017), sec. 4.1.1.
    """
    pose = np.eye(4)
    for axis, position in zip(arm.screw_axes.T, joint_vector(arm, q)):
        pose = pose @ exp6(axis * position)
    return pose @ arm.home_pose


def forward_kinematics_batch(arm: ScrewModel, q: ArrayLike) -> FloatArray:
    r"""Compute the tool's pose for many joint vectors at once.

    The screws are of unit length, so :math:`e^{[S]q} = I + q[S] + (1-\cos q)[S]^2 + (q-\sin
    q)[S]^3` for turning and sliding joints alike; it is applied to the columns of the home pose,
    tool to base.

    Args:
        arm: Screw axes and home pose.
        q: Joint positions, shape ``(m, n)``: [rad], prismatic [m].

    Returns:
        Homogeneous transforms, shape ``(m, 4, 4)``. A row of ``q`` with NaN gives NaN.

    Raises:
        JointVectorError: ``q`` is not of shape ``(m, n)``.
    """
    positions = _joint_matrix(arm, q)
    columns = np.broadcast_to(arm.home_pose.T, (len(positions), 4, 4))
    return np.ascontiguousarray(_move(arm, positions, columns).transpose(0, 2, 1))


def tool_positions(arm: ScrewModel, q: ArrayLike) -> FloatArray:
    """Compute where the tool's origin is for many joint vectors.

    See :func:`forward_kinematics_batch`.

    Args:
        arm: Screw axes and home pose.
        q: Joint positions, shape ``(m, n)``: [rad], prismatic [m].

    Returns:
        Positions in the base frame, shape ``(m, 3)`` [m]. A row of ``q`` with NaN gives NaN.

    Raises:
        JointVectorError: ``q`` is not of shape ``(m, n)``.
    """
    positions = _joint_matrix(arm, q)
    origins = np.broadcast_to(arm.home_pose[:, 3], (len(positions), 1, 4))
    return np.ascontiguousarray(_move(arm, positions, origins)[:, 0, :3])


def tool_position(arm: ScrewModel, q: Sequence[float]) -> Point:
    """Compute where the tool's origin is, for one joint vector in a control loop.

    The formula of :func:`forward_kinematics_batch` in plain numbers: a tenth of the time of arrays
    of one row.

    Args:
        arm: Screw axes and home pose.
        q: Joint positions, base to tool, ``n`` of them: [rad], prismatic [m].

    Returns:
        Position in the base frame [m].
    """
    x, y, z = arm.home_origin
    for (turning, (a, b, c), (u, v, w)), angle in zip(reversed(arm.plain_screws), reversed(q)):
        if not turning:
            x, y, z = x + angle * u, y + angle * v, z + angle * w
            continue
        # The screw applied once, twice and three times: no calls, this is an inmost loop.
        x1, y1, z1 = b * z - c * y + u, c * x - a * z + v, a * y - b * x + w
        x2, y2, z2 = b * z1 - c * y1, c * x1 - a * z1, a * y1 - b * x1
        x3, y3, z3 = b * z2 - c * y2, c * x2 - a * z2, a * y2 - b * x2
        # The first is 1 - cos, written so that a small angle keeps its digits.
        square, cube = 2.0 * math.sin(angle / 2.0) ** 2, angle - math.sin(angle)
        x += angle * x1 + square * x2 + cube * x3
        y += angle * y1 + square * y2 + cube * y3
        z += angle * z1 + square * z2 + cube * z3
    return x, y, z


def nearest_on_axis(omega: Point, v: Point, place: FloatArray) -> FloatArray:
    """Return the point of a turning joint's axis ``(omega, v)`` that is nearest to a place [m]."""
    on_axis = np.cross(omega, v)
    nearest: FloatArray = on_axis + np.array(omega) * (omega @ (place - on_axis))
    return nearest


def _joint_matrix(arm: ScrewModel, q: ArrayLike) -> FloatArray:
    """Return ``q`` as an array of shape ``(m, n)`` or raise JointVectorError."""
    matrix = np.asarray(q, dtype=float)
    if matrix.ndim != 2 or matrix.shape[1] != arm.joint_count:
        raise JointVectorError(
            f"joint matrix has shape {matrix.shape}, expected (m, {arm.joint_count})"
        )
    return matrix


def _move(arm: ScrewModel, q: FloatArray, points: FloatArray) -> FloatArray:
    """Carry homogeneous ``points``, shape ``(m, k, 4)``, through the joints, last joint first."""
    # One product of all points is quicker than one for each pose, and has the same bits; points
    # side by side are quicker still, for what differs by pose then runs along the memory.
    flat = np.ascontiguousarray(points.reshape(-1, 4).T)

    def each(factors: FloatArray) -> FloatArray:
        return np.repeat(factors, points.shape[1])

    for (turning, screw), angle in zip(arm.screw_matrices, q.T[::-1]):
        across = screw.T
        first = across @ flat
        flat = flat + each(angle) * first
        if turning:
            second = across @ first
            flat = (
                flat
                + each(2.0 * np.sin(angle / 2.0) ** 2) * second
                + each(angle - np.sin(angle)) * (across @ second)
            )
    return flat.T.reshape(points.shape)
