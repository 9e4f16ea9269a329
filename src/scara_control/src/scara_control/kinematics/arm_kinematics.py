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
from scara_control.kinematics.pose_chain import PoseChain
from scara_control.kinematics.scara import Elbow, Triple
from scara_control.kinematics.scara_velocity import JointVelocities
from scara_control.kinematics.screws import ScrewModel
from scara_control.kinematics.tool import InverseAnswer, tool_kinematics
from scara_control.limits import check_limits, check_velocities


class ToolPose(NamedTuple):
    """Where the tool is: position [m], orientation as quaternion (x, y, z, w), elbow of a SCARA."""

    position: Triple
    orientation: tuple[float, float, float, float]
    elbow: Elbow | None


class ToolTwist(NamedTuple):
    """Velocity of the tool's origin [m/s] and angular velocity [rad/s], in the base frame."""

    linear: Triple
    angular: Triple


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
        self._all_joints = [joint for joint in robot.joints if joint.screw_axis is not None]
        self._chain = PoseChain(self.arm)
        self._whole_chain = PoseChain(ScrewModel.from_joints(self._all_joints, robot.home_pose))

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
        return ToolPose(position, orientation, self.tool.elbow(q))

    def inverse(
        self,
        x: float,
        y: float,
        z: float,
        elbow: Elbow | None = None,
        seed: Sequence[float] | None = None,
    ) -> InverseAnswer:
        """Compute the joint positions for a tool position [m].

        See :mod:`scara_control.kinematics.tool`.

        Raises:
            UnreachableError: Not finite or out of reach.
            JointLimitError: The wanted branch (``elbow`` None: both) breaks a limit.
            JointVectorError: ``seed`` is no joint vector.
        """
        return self.tool.inverse(x, y, z, elbow, seed)

    def velocity(self, q: Sequence[float], qdot: Sequence[float]) -> ToolTwist:
        """Compute the velocity of the tool from joint positions and velocities.

        Raises:
            JointVectorError: A wrong count or a value that is not finite.
            JointLimitError: A position or speed is outside its limits.
        """
        positions, velocities = check_limits(self._joints, q), check_velocities(self._joints, qdot)
        wx, wy, wz, vx, vy, vz = (tip_jacobian(self.arm, positions) @ velocities).tolist()
        return ToolTwist((vx, vy, vz), (wx, wy, wz))

    def inverse_velocity(self, q: Sequence[float], velocity: Sequence[float]) -> JointVelocities:
        """Compute the joint velocities for a velocity of the tool's origin [m/s].

        Raises:
            JointVectorError: A wrong count or a value that is not finite.
            JointLimitError: A position is outside its limits, or a joint would have to be too fast.
        """
        broken = [
            f"{axis} = {value}" for axis, value in zip("xyz", velocity) if not math.isfinite(value)
        ]
        if broken:
            raise JointVectorError(f"tool velocity is not finite: {', '.join(broken)}")
        answer = self.tool.joint_velocities(check_limits(self._joints, q), velocity)
        check_velocities(self._joints, answer.qdot)
        return answer
