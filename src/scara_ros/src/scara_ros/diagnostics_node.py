"""The topic ``/diagnostics`` (REP-107): one way to build and publish its messages."""

from __future__ import annotations

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

from scara_ros.diagnosis import Diagnosis, Level
from scara_ros.starting.full_disk_io import Loss, lost_lines

PERIOD_S = 1.0  # REP-107
RECENT_S = 60.0  # our choice: so long after the last lost line the log still counts as broken


def log_diagnosis(loss: Loss, node: str) -> Diagnosis | None:
    """Say how many lines the log of ``node`` lacks; None if it is complete."""
    if not loss.lines:
        return None
    level = Level.WARN if loss.age < RECENT_S else Level.OK
    text = f"{loss.lines} log lines lost: {loss.reason}"
    return Diagnosis(level, f"{node}/log", text, {"lines": loss.lines, "reason": loss.reason})


class Diagnostics:
    """Publishes what a piece of hardware, or a part of a node, says about itself."""

    def __init__(self, hardware_id: str, queue_size: int = 10) -> None:
        """Advertise."""
        self._hardware_id = hardware_id
        self._publisher = rospy.Publisher(
            "/diagnostics", DiagnosticArray, queue_size=queue_size, tcp_nodelay=True
        )

    def publish(self, *found: Diagnosis, stamp: rospy.Time | None = None) -> None:
        """Publish all of ``found`` in one message, stamped with ``stamp`` or now.

        A status on this node's log is added when lines of it were lost.
        """
        log = log_diagnosis(lost_lines.loss, rospy.get_name())
        everything = found if log is None else (*found, log)
        array = DiagnosticArray()
        for each in everything:
            values = [KeyValue(name, str(value)) for name, value in each.values.items()]
            status = DiagnosticStatus(
                each.level, each.name, each.message, self._hardware_id, values
            )
            array.status.append(status)
        array.header.stamp = rospy.get_rostime() if stamp is None else stamp
        self._publisher.publish(array)
