"""Let the twin visit two points and print who leads: a running cell, and `source env.sh`."""

from __future__ import annotations

import sys

import rosgraph
import rospy

from scara_msgs.msg import TwinControllerState
from scara_msgs.srv import MoveTo

POINTS = [(0.51, 0.16, 0.10), (0.51, -0.16, 0.16)]  # [m] in base_link

if not rosgraph.is_master_online():
    sys.exit("no ROS master answers: start a cell first (./cell up)")
rospy.init_node("move_and_watch", anonymous=True)
seen = []


def show(state: TwinControllerState) -> None:
    """Print the mode each time it changes."""
    if [state.mode] != seen[-1:]:
        seen.append(state.mode)
        print(f"{state.mode}: {state.why}")


rospy.Subscriber("twin_controller/state", TwinControllerState, show)
rospy.wait_for_service("move_to", timeout=10.0)
move_to = rospy.ServiceProxy("move_to", MoveTo)
for x, y, z in POINTS:
    answer = move_to(x=x, y=y, z=z, speed_percent=50.0)
    print(f"at ({x}, {y}, {z}): {answer.message}, off by {answer.error * 1000.0:.2f} mm")
    if not answer.success:
        sys.exit(1)
