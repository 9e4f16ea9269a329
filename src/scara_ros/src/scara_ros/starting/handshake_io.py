"""Let no silent client keep the others out of a node.

rospy accepts all topic and service connections in one thread, which reads the first message of each
without a time limit. A client that connects and says nothing, as one does that takes this port for
its forerunner's, kept every new subscriber waiting for good.
"""

from __future__ import annotations

import socket
from io import BytesIO
from typing import Any

from rospy.impl import tcpros_base

PATIENCE_S = 1.0
"""A ROS client says who it is as soon as it is connected; our choice."""


def limit_handshakes() -> None:
    """Close each connection of this process that does not say who it is in time."""
    read = tcpros_base.read_ros_handshake_header
    if getattr(read, "is_limited", False):
        return

    def read_in_time(sock: socket.socket, text: BytesIO, size: int) -> dict[str, Any]:
        # One that connects to somebody else brings a limit of its own.
        if sock.gettimeout() is not None:
            return read(sock, text, size)
        sock.settimeout(PATIENCE_S)
        try:
            return read(sock, text, size)
        finally:
            sock.settimeout(None)

    read_in_time.is_limited = True
    tcpros_base.read_ros_handshake_header = read_in_time
