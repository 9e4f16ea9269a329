"""Node ``rosout``: collects what all nodes log, in place of Debian's node of that name.

Debian's listens on all addresses of the machine, and obeys a ``shutdown`` from there.

Subscribes to ``/rosout`` (rosgraph_msgs/Log), publishes the same to ``/rosout_agg`` and writes
``rosout.log`` in the folder of ROS's logs. Parameter: ``~config_dir`` (bringup.yaml,
``log_limit_mb``: that large the file grows; one older file is kept).
"""

from __future__ import annotations

from pathlib import Path

import rospkg
import rospy
from rosgraph_msgs.msg import Log
from scara_ros.diagnostics_node import PERIOD_S, Diagnostics
from scara_ros.shell.ros_node import starting
from scara_ros.starting.starting_node import until_shutdown

from scara_bringup.config import load_bringup
from scara_bringup.processes.log_file_io import LogFile

BURST = 1000  # our choice: a cell that starts says some hundred lines at once
LEVELS = {Log.DEBUG: "DEBUG", Log.INFO: "INFO", Log.WARN: "WARN", Log.ERROR: "ERROR"}


class Collector:
    """Hands each log message on, and writes it down."""

    def __init__(self, file: LogFile) -> None:
        """Publish first, so that no message is taken that could not be handed on."""
        self._file = file
        self._publisher = rospy.Publisher("/rosout_agg", Log, queue_size=BURST, tcp_nodelay=True)
        self._subscriber = rospy.Subscriber("/rosout", Log, self._take, queue_size=BURST)

    def _take(self, message: Log) -> None:
        level = LEVELS.get(message.level, "FATAL")
        stamp = message.header.stamp.to_sec()
        self._file.write(f"{stamp:.6f} {level} {message.name}: {message.msg}")
        with until_shutdown():
            self._publisher.publish(message)


def main() -> None:
    """Collect until shut down."""
    with starting("rosout") as folder:
        limit_mb = load_bringup(folder).log_limit_mb
    Collector(LogFile(Path(rospkg.get_log_dir()) / "rosout.log", limit_mb))
    diagnostics = Diagnostics("log")
    rospy.loginfo("rosout is ready")
    with until_shutdown():
        while not rospy.is_shutdown():
            diagnostics.publish()
            # By the wall clock: rospy.sleep follows /clock, which may stand still.
            rospy.rostime.wallsleep(PERIOD_S)
