"""A pair of robots that only say where their joints are, and move as a test wants."""

from __future__ import annotations

import numpy as np

from harness.ros import Ros

NAMES = ["joint_1", "joint_2", "joint_3", "table_joint"]
HOME = (0.0, 0.0, -0.16, 0.0)
PERIOD_S = 0.01


class PlayedRobot:
    """Joint states of both sides, played by the test on the clock of the cell."""

    def __init__(self, ros: Ros) -> None:
        """Advertise, and stand at home."""
        import rospy
        from sensor_msgs.msg import JointState

        self.joints = [
            rospy.Publisher(ros.name(f"{side}/joint_states"), JointState, queue_size=10)
            for side in ("real", "twin")
        ]
        self._now, self._timer = HOME, None
        self._stand = rospy.Timer(rospy.Duration(PERIOD_S), lambda _: self.say())

    def say(self) -> None:
        """Tell where the joints are."""
        import rospy
        from sensor_msgs.msg import JointState

        for publisher in self.joints:
            message = JointState(name=NAMES, position=self._now, effort=[10.0, 0.0, 0.0, 0.0])
            message.header.stamp = rospy.get_rostime()
            publisher.publish(message)

    def move(self, target: tuple[float, ...], duration: float) -> None:
        """Go to a target along a smooth curve."""
        import rospy

        begin, start = rospy.get_time(), np.array(self._now)
        while (share := (rospy.get_time() - begin) / duration) < 1.0:
            smooth = share * share * (3.0 - 2.0 * share)
            self._now = tuple((start + smooth * (np.array(target) - start)).tolist())
            rospy.sleep(PERIOD_S)
        self._now = target

    def close(self) -> None:
        """Fall silent."""
        self._stand.shutdown()
