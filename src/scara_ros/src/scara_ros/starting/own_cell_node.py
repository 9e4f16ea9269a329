"""The cell that this node belongs to: its frames, and which messages are its own."""

from __future__ import annotations

from typing import Any

import rospy

from scara_ros.names import frame_in, is_of_cell


def own_frame(frame: str) -> str:
    """Return a frame as it is called on ``/tf``, in the namespace of this node."""
    return frame_in(frame, rospy.get_namespace())


def is_own(message: Any) -> bool:
    """Return whether a received message comes from a node of this node's cell."""
    return is_of_cell(message._connection_header.get("callerid", ""), rospy.get_namespace())
