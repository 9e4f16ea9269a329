"""ROS messages of joint motion, converted to our types and back: the only place that does it."""

from __future__ import annotations

from typing import Any

import rospy
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from scara_control.joint_motion import JointMotion, Setpoints


def to_motion(point: Any, time: float = 0.0) -> JointMotion:
    """Convert a JointTrajectoryPoint as it is; fields that are left out stay empty.

    Args:
        point: The message.
        time: The instant of the motion, where the motion itself shall tell it [s].
    """
    return JointMotion(
        tuple(point.positions), tuple(point.velocities), tuple(point.accelerations), time
    )


def to_setpoints(message: JointTrajectory, times: tuple[float, ...]) -> Setpoints:
    """Convert set points; missing velocities and accelerations are zeros. Nothing is checked here.

    Args:
        message: The message.
        times: When each point is due, on the axis of the receiver [s].
    """
    points = (to_motion(point, at).filled() for at, point in zip(times, message.points))
    return Setpoints(tuple(message.joint_names), tuple(points))


def due_times(message: JointTrajectory, offset: float) -> tuple[float, ...]:
    """Return when the points are due [s]; ``offset`` is ROS time minus the axis of times."""
    start = message.header.stamp.to_sec() - offset
    return tuple(start + point.time_from_start.to_sec() for point in message.points)


def to_point(motion: JointMotion, from_start: rospy.Duration) -> JointTrajectoryPoint:
    """Build the message of one instant."""
    return JointTrajectoryPoint(motion.q, motion.qdot, motion.qddot, [], from_start)


def to_message(setpoints: Setpoints, offset: float) -> JointTrajectory:
    """Build the message of set points; its stamp is the first point's time."""
    first = setpoints.points[0].time
    message = JointTrajectory(joint_names=list(setpoints.names))
    message.header.stamp = rospy.Time.from_sec(first + offset)
    message.points = [
        to_point(motion, rospy.Duration.from_sec(motion.time - first))
        for motion in setpoints.points
    ]
    return message
