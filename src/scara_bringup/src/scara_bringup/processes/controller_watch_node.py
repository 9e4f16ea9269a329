"""The twin controller's mode, as it publishes it."""

from __future__ import annotations

import threading

import rospy
from scara_ros.names import resolve

from scara_bringup.processes.preflight_io import namespace
from scara_msgs.msg import TwinControllerState


class ControllerWatch:
    """Keep the last mode of the twin controller; this makes the process a node of the master."""

    def __init__(self) -> None:
        """Subscribe to ``twin_controller/state``; signals stay with the caller."""
        self._lock = threading.Lock()
        self._mode, self._why = "", ""
        rospy.init_node("cell", anonymous=True, disable_signals=True)
        # rospy has read the namespace when it was imported, before the cell had its name.
        state = resolve("twin_controller/state", namespace())
        self._subscriber: rospy.Subscriber | None = rospy.Subscriber(
            state, TwinControllerState, self._keep, queue_size=1, tcp_nodelay=True
        )

    def last(self) -> tuple[str, str]:
        """Return the last mode and the reason given with it, empty before the first state."""
        with self._lock:
            return self._mode, self._why

    def rest(self) -> None:
        """Hear no more: nobody needs the mode of a cell that is ready."""
        if self._subscriber is not None:
            self._subscriber.unregister()
            self._subscriber = None

    def close(self) -> None:
        """Leave the master."""
        # Without rest(): at the exit rospy waits for the master unless this has begun before.
        rospy.signal_shutdown("the cell ends")

    def _keep(self, state: TwinControllerState) -> None:
        with self._lock:
            self._mode, self._why = state.mode, state.why
