"""``motion_command`` as a node hears it: before all that waits beside it."""

from __future__ import annotations

import select
import time
from collections.abc import Callable
from typing import Any

from scara_ros.standstill import WAITING_S

from scara_control.nodes.wiring import Guard, subscribe
from scara_msgs.msg import MotionCommand

_TURN_S = 0.002
"""Who has read a message and waits for the interpreter gets it in this time; our choice."""


class CommandListener:
    """Subscribes, and can wait until what has come is heard.

    Behind a standstill stops and requests wait side by side in sockets of their own, and chance
    says which thread goes first. So the stops are let go first: see :meth:`read_out`.
    """

    def __init__(self, callback: Callable[[MotionCommand], None], guard: Guard) -> None:
        """Subscribe."""
        self._subscriber = subscribe("motion_command", MotionCommand, callback, guard, 20)

    def read_out(self) -> None:
        """Return once no command waits any more; to be called without the callback's lock."""
        deadline = time.monotonic() + WAITING_S
        while True:
            time.sleep(_TURN_S)
            if not self._waits() or time.monotonic() >= deadline:
                return

    def _waits(self) -> bool:
        """Return whether a connection has something to read."""
        poll, found = select.poll(), False
        for connection in self._connections():
            socket = connection.socket
            if socket is not None and socket.fileno() >= 0:
                poll.register(socket, select.POLLIN)
                found = True
        return found and bool(poll.poll(0))

    def _connections(self) -> list[Any]:
        # rospy forgets the implementation when it unsubscribes.
        implementation = self._subscriber.impl
        return list(implementation.connections) if implementation is not None else []
