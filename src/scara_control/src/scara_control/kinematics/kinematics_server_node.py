"""Answer the kinematics services of the arm.

Parameters:
    ~config_dir: Folder of robot.yaml (default: the package scara_config).

Services:
    forward_kinematics, inverse_kinematics, velocity_kinematics, inverse_velocity_kinematics
    (scara_msgs).
"""

from __future__ import annotations

import traceback
from collections.abc import Callable
from typing import Any

import rospy
from geometry_msgs.msg import Quaternion, Twist, Vector3
from scara_config import load_robot
from scara_ros.shell.ros_node import starting
from scara_ros.starting.registration_node import wait_for_end

from scara_control.errors import ScaraControlError
from scara_control.kinematics.arm_kinematics import ArmKinematics, parse_elbow
from scara_control.kinematics.scara import Elbow
from scara_msgs.srv import (
    ForwardKinematics,
    ForwardKinematicsResponse,
    InverseKinematics,
    InverseKinematicsResponse,
    InverseVelocityKinematics,
    InverseVelocityKinematicsResponse,
    VelocityKinematics,
    VelocityKinematicsResponse,
)


class KinematicsServer:
    """Converts requests, asks the core, converts answers; a refusal is an answer too."""

    def __init__(self, kinematics: ArmKinematics) -> None:
        """Advertise the four services."""
        self._kinematics = kinematics
        self._advertise("forward_kinematics", ForwardKinematics, self._forward)
        self._advertise("inverse_kinematics", InverseKinematics, self._inverse)
        self._advertise("velocity_kinematics", VelocityKinematics, self._velocity)
        self._advertise(
            "inverse_velocity_kinematics", InverseVelocityKinematics, self._inverse_velocity
        )

    @staticmethod
    def _advertise(name: str, kind: Any, answer: Callable[[Any], Any]) -> None:
        """Offer a service whose refusals and failures become ``success: False`` with the reason."""

        def handle(request: Any) -> Any:
            try:
                return answer(request)
            except ScaraControlError as error:
                return kind._response_class(success=False, message=str(error))
            except Exception as error:
                rospy.logerr("%s failed:\n%s", name, traceback.format_exc())
                return kind._response_class(
                    success=False, message=f"{name} failed: {type(error).__name__}: {error}"
                )

        rospy.Service(name, kind, handle)

    def _forward(self, request: Any) -> ForwardKinematicsResponse:
        pose = self._kinematics.forward(request.joint_positions)
        return ForwardKinematicsResponse(
            True, "", *pose.position, Quaternion(*pose.orientation), _name(pose.elbow), pose.yaw
        )

    def _inverse(self, request: Any) -> InverseKinematicsResponse:
        answer = self._kinematics.inverse(
            request.x,
            request.y,
            request.z,
            parse_elbow(request.elbow),
            # A ROS message has no None: an empty array stands for it.
            request.seed or None,
            request.yaw if request.has_yaw else None,
        )
        q, elbow = answer.chosen
        return InverseKinematicsResponse(
            True, "", q, _name(elbow), answer.righty or (), answer.lefty or ()
        )

    def _velocity(self, request: Any) -> VelocityKinematicsResponse:
        twist = self._kinematics.velocity(request.joint_positions, request.joint_velocities)
        linear, angular = (Vector3(*part) for part in twist)
        return VelocityKinematicsResponse(True, "", Twist(linear, angular))

    def _inverse_velocity(self, request: Any) -> InverseVelocityKinematicsResponse:
        wanted = request.linear
        return InverseVelocityKinematicsResponse(
            True,
            "",
            *self._kinematics.inverse_velocity(
                request.joint_positions, (wanted.x, wanted.y, wanted.z), request.yaw_rate
            ),
        )


def _name(elbow: Elbow | None) -> str:
    """Return the name of a branch, nothing for an arm that has none."""
    return elbow.value if elbow else ""


def main() -> None:
    """Start the node and answer until it is told to end."""
    with starting("kinematics_server", ScaraControlError) as folder:
        kinematics = ArmKinematics(load_robot(folder))
    # A numeric solution loads a library, and the first caller would wait for it.
    x, y, z = kinematics.forward(kinematics.home).position
    try:
        kinematics.inverse(x, y, z, None, kinematics.home)
    except ScaraControlError as error:
        rospy.logwarn("the home pose has no inverse kinematics: %s", error)
    KinematicsServer(kinematics)
    rospy.loginfo("kinematics_server is ready")
    wait_for_end()
