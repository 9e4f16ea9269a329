"""The real robot for ROS-Industrial clients: ``robot_status``, and ``speed_scaling_factor``."""

from __future__ import annotations

import msgspec
import rospy
from scara_ros.pacing import Pace
from std_msgs.msg import Float64

from industrial_msgs.msg import RobotMode, RobotStatus, TriState
from twin_controller.core.setup import Setup
from twin_controller.core.state import CoreState
from twin_controller.reporting.robot_status import robot_status, scaling_factor

STATUS_PERIOD_S = (
    0.1  # our choice: often enough for a light on a panel; changes are published at once
)


class StatusPublisher:
    """Publishes from the publisher's thread."""

    def __init__(self, setup: Setup) -> None:
        """Advertise."""
        self._setup = setup
        self.pendant_enabled: bool | None = None
        self.alarm_number = 0
        self._status = rospy.Publisher("robot_status", RobotStatus, queue_size=2, tcp_nodelay=True)
        self._factor = rospy.Publisher(
            "speed_scaling_factor", Float64, queue_size=2, tcp_nodelay=True
        )
        self._pace = Pace(STATUS_PERIOD_S)

    def publish(self, state: CoreState, now: float, stamp: rospy.Time) -> None:
        """Publish at the rate, and at once when anything changes; nothing while nobody listens."""
        if not (self._status.get_num_connections() or self._factor.get_num_connections()):
            # Who comes next gets the status at once.
            self._pace.hurry()
            return
        status = robot_status(self._setup, state, self.pendant_enabled, self.alarm_number, now)
        factor = scaling_factor(state)
        if not self._pace.is_due(now, (status, factor)):
            return
        fields = msgspec.structs.asdict(status)
        mode, code = RobotMode(int(fields.pop("mode"))), fields.pop("error_code")
        answers = {name: TriState(int(value)) for name, value in fields.items()}
        self._status.publish(
            RobotStatus(header=rospy.Header(stamp=stamp), mode=mode, error_code=code, **answers)
        )
        self._factor.publish(Float64(factor))
