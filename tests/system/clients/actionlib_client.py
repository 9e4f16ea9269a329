"""A plain actionlib client: sends one trajectory and prints as JSON how it ended.

Usage: actionlib_client.py SECONDS J1 [J2 [J3 [TABLE]]]; joints without a position are not named.
With ``GOAL_LISTENERS=N`` it sends the goal once so many listen to it.
"""

from __future__ import annotations

import json
import os
import sys
import time

import actionlib
import rospy
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from control_msgs.msg import FollowJointTrajectoryAction, FollowJointTrajectoryGoal

NAMES = ["joint_1", "joint_2", "joint_3", "table_joint"]


def main() -> None:
    """Send a goal of one point and wait for its end."""
    seconds, *positions = map(float, sys.argv[1:])
    rospy.init_node("actionlib_client", anonymous=True)
    client = actionlib.SimpleActionClient("joint_trajectory_action", FollowJointTrajectoryAction)
    if not client.wait_for_server(rospy.Duration(20)):
        sys.exit("no joint_trajectory_action")
    goals = client.action_client.pub_goal
    until = time.monotonic() + 20.0
    while goals.get_num_connections() < int(os.environ.get("GOAL_LISTENERS", "1")):
        if time.monotonic() > until:
            sys.exit(f"{goals.get_num_connections()} listen to the goals")
        time.sleep(0.01)
    point = JointTrajectoryPoint(
        positions=positions, time_from_start=rospy.Duration.from_sec(seconds)
    )
    goal = FollowJointTrajectoryGoal(
        trajectory=JointTrajectory(joint_names=NAMES[: len(positions)], points=[point])
    )
    feedback: list[float] = []
    client.send_goal(
        goal, feedback_cb=lambda message: feedback.append(max(map(abs, message.error.positions)))
    )
    if not client.wait_for_result(rospy.Duration(60)):
        sys.exit("no result")
    result = client.get_result()
    ended = {
        "state": client.get_state(),
        "code": result.error_code,
        "text": result.error_string,
        "feedback": len(feedback),
    }
    print("ended " + json.dumps(ended), flush=True)


if __name__ == "__main__":
    main()
