"""``rosrun scara_bringup master --core -p PORT``: Debian's ROS master, closed to web pages.

Its options are rosmaster's. It listens where ROS_IP or ROS_HOSTNAME says.
"""

from __future__ import annotations

import sys

from rosmaster.main import rosmaster_main
from scara_ros.starting.xmlrpc_guard_io import harden_process


def main() -> None:
    """Run the master until a signal comes."""
    harden_process()
    rosmaster_main(sys.argv)
