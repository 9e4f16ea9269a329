"""Report a person who walks to the robot and back: a sensor's stand-in, and no safety function.

For ``separation`` in twin_controller.yaml; needs a running cell and ``source env.sh``. Arguments:
where the person turns [m from the robot's base] and how fast the person walks [m/s].
"""

from __future__ import annotations

import sys
import time

import rosgraph
import rospy
from geometry_msgs.msg import PointStamped
from scara_config import load_robot
from scara_ros.shell.ros_node import own_frame

FAR = 3.0  # [m] where the person begins
PERIOD_S = 0.05  # far below separation.stale_ms

near = float(sys.argv[1]) if len(sys.argv) > 1 else 0.9
speed = float(sys.argv[2]) if len(sys.argv) > 2 else 0.5
if not rosgraph.is_master_online():
    sys.exit("no ROS master answers: start a cell first (./cell up)")
rospy.init_node("walking_person")  # the name stands in separation.sensors
publisher = rospy.Publisher("people/nearest", PointStamped, queue_size=1, tcp_nodelay=True)
sighting = PointStamped()
sighting.header.frame_id = own_frame(load_robot().base_frame)
begun = time.monotonic()
while not rospy.is_shutdown():
    walked = speed * (time.monotonic() - begun) % (2.0 * (FAR - near))  # there and back
    sighting.point.x = near + abs(FAR - near - walked)
    sighting.header.stamp = rospy.get_rostime()
    publisher.publish(sighting)
    time.sleep(PERIOD_S)
