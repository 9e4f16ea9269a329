"""The four questions of the kinematics services, with every check.

They are pure; joints are in the order of robot.yaml.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from scara_config import Robot

from scara_control.errors import JointVectorError, ScaraControlError
from scara_control.kinematics.jacobians import tip_jacobian
from scara_control.kinematics.pose_chain import PoseChain, Quaternion
from scara_control.kinematics.scara import Elbow, Triple
from scara_control.kinematics.scara_velocity import JointVelocities
from scara_control.kinematics.screws import ScrewModel
from scara_control.kinematics.tool import InverseAnswer, tool_kinematics
from scara_control.limits import check_limits, check_velocities


class ToolPose(NamedTuple):
    """Where the tool is.

    Attributes:
        position: [m].
        orientation: Quaternion (x, y, z, w).
        elbow: Of a SCARA.
        yaw: Turn about z of the base, in (-pi, pi] [rad]: a SCARA's from zero joints, another arm's
            from home.
    """

    position: Triple
    orientation: Quaternion
    elbow: Elbow | None
    yaw: float


def parse_elbow(text: str) -> Elbow | None:
    """Return the branch called ``text``; None for the empty text.

    Raises:
        ScaraControlError: Another text.
    """
    if not text:
        return None
    try:
        return Elbow(text)
    except ValueError:
        raise ScaraControlError(f"elbow = {text!r} is neither righty nor lefty nor empty") from None


class ArmKinematics:
    """Kinematics of one robot profile, refusing what is malformed or outside the limits."""

    def __init__(self, robot: Robot) -> None:
        """Build the models of ``robot``; its profile decides between closed form and numbers.

        Raises:
            ScaraControlError: The profile is no SCARA although it has ``geometry``, or no mechanism
                at all.
        """
        self.tool = tool_kinematics(robot)
        self.arm = ScrewModel.from_robot(robot)
        self._joints = robot.arm_joints
        self.home = tuple(robot.home[joint.name] * joint.scale for joint in self._joints)
        # With the joints that the twin leaves out, since the real robot's readings have them.
        self._all_joints = [joint for joint in robot.joints if joint.screw_axis is not None]
        self._chain = PoseChain(self.arm)
        self._whole_chain = PoseChain(ScrewModel.from_joints(self._all_joints, robot.home_pose))
        self._columns = [self._all_joints.index(joint) for joint in self._joints]
        straight = self.home if robot.geometry is None else (0.0,) * len(self._joints)
        self._straight = self._chain.pose(straight)[1]

    def forward(self, q: Sequence[float]) -> ToolPose:
        """Compute the tool's pose.

        Args:
            q: The twin's joints of the arm, or all that the robot has: [rad], prismatic [m].

        Raises:
            JointVectorError: A wrong count or a value that is not finite.
            JointLimitError: A joint is outside its limits.
        """
        if len(q) not in (len(self._joints), len(self._all_joints)):
            names, more = (
                ", ".join(joint.name for joint in joints)
                for joints in (self._joints, self._all_joints)
            )
            raise JointVectorError(
                f"got {len(q)} joint values, expected {len(self._joints)}: {names}, or {more}"
            )
        if len(q) == len(self._joints):
            position, orientation = self._chain.pose(check_limits(self._joints, q))
        else:
            position, orientation = self._whole_chain.pose(check_limits(self._all_joints, q))
            q = [q[column] for column in self._columns]
        return ToolPose(position, orientation, self.tool.elbow(q), self._yaw(orientation))

    def _yaw(self, orientation: Quaternion) -> float:
        """Return the turn about z in the turn from where the tool is straight (its twist) [rad]."""
        (x, y, z, w), (a, b, c, d) = orientation, self._straight
        return math.remainder(
            2.0 * math.atan2(z * d - w * c + y * a - x * b, w * d + x * a + y * b + z * c), math.tau
        )

    def inverse(
        self,
        x: float,
        y: float,
        z: float,
        elbow: Elbow | None = None,
        seed: Sequence[float] | None = None,
        yaw: float | None = None,
    ) -> InverseAnswer:
        """Compute the joint positions for a tool position [m] and, if given, its yaw [rad].

        See :mod:`scara_control.kinematics.tool`.

        Raises:
            UnreachableError: Not finite or out of reach.
            JointLimitError: The wanted branch (``elbow`` None: both) breaks a limit.
            JointVectorError: ``seed`` is no joint vector.
            ScaraControlError: A ``yaw`` that this arm cannot choose.
        """
        return self.tool.inverse(x, y, z, elbow, seed, yaw)

    def velocity(self, q: Sequence[float], qdot: Sequence[float]) -> tuple[Triple, Triple]:
        """Compute the tool's velocity from joint positions and velocities.

        Returns:
            Velocity of the tool's origin [m/s] and angular velocity [rad/s], in the base frame.

        Raises:
            JointVectorError: A wrong count or a value that is not finite.
            JointLimitError: A position or speed is outside its limits.
        """
        positions, velocities = check_limits(self._joints, q), check_velocities(self._joints, qdot)
        wx, wy, wz, vx, vy, vz = (tip_jacobian(self.arm, positions) @ velocities).tolist()
        return (vx, vy, vz), (wx, wy, wz)

    def inverse_velocity(
        self, q: Sequence[float], velocity: Sequence[float], yaw_rate: float = 0.0
    ) -> JointVelocities:
        """Compute the joint velocities for a velocity of the tool's origin [m/s] and its turn.

        Raises:
            JointVectorError: A wrong count or a value that is not finite.
            JointLimitError: A position is outside its limits, or a joint would have to be too fast.
            ScaraControlError: A ``yaw_rate`` [rad/s] that this arm cannot have.
        """
        broken = [
            f"{name} = {value}"
            for name, value in zip(("x", "y", "z", "yaw_rate"), (*velocity, yaw_rate))
            if not math.isfinite(value)
        ]
        if broken:
            raise JointVectorError(f"tool velocity is not finite: {', '.join(broken)}")
        answer = self.tool.joint_velocities(check_limits(self._joints, q), velocity, yaw_rate)
        check_velocities(self._joints, answer.qdot)
        return answer
