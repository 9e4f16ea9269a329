"""A publisher's line to one listener; it needs no thread while the listener keeps up."""

from __future__ import annotations

import socket
import threading
from collections import deque
from typing import Any


class DirectConnection:
    """Hand messages to the listener's socket at once; queue only what it does not take.

    rospy has a thread for each listener of a topic with a queue, and wakes it for each message. On
    a machine where a wake costs 70 us the six listeners of ``twin/joint_states`` took the simulator
    more time than half of its physics.

    Takes the place of rospy's ``QueuedConnection`` and keeps its promise: :meth:`write_data` never
    waits, and of the messages that wait the oldest goes first when there are too many. A message
    that was sent in part is sent to its end, so that the stream stays whole. A thread stands by
    only while something waits.

    Args:
        connection: rospy's line to the listener (``TCPROSTransport``).
        queue_size: How many messages may wait; 0: any number.
    """

    def __init__(self, connection: Any, queue_size: int) -> None:
        self._connection = connection
        self._queue_size = queue_size
        self._lock = threading.Lock()
        self._waiting: deque[bytes] = deque()
        self._backlog = False
        """A thread sends what waits; until it has ended nobody else may send."""
        self._error: Exception | None = None

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self._connection, name)

    def write_data(self, data: bytes) -> bool:
        """Send ``data`` or let it wait.

        Raises:
            Exception: What the line raised, at the latest with the message after the one that
                failed; rospy drops the line then.
        """
        with self._lock:
            if self._error is not None:
                error, self._error = self._error, None
                raise error
            if not self._backlog:
                sent = self._send_now(data)
                if sent == len(data):
                    return True
                self._backlog = True
                thread = threading.Thread(
                    target=self._send_backlog, args=(data[sent:],), name="backlog", daemon=True
                )
                thread.start()
                return True
            if 0 < self._queue_size <= len(self._waiting):
                self._waiting.popleft()
            self._waiting.append(data)
        return True

    def _send_now(self, data: bytes) -> int:
        """Send what the socket takes without waiting; return the number of bytes."""
        line = self._connection
        if line.done or line.socket is None:
            line.write_data(data)  # says what is wrong in rospy's own way
        try:
            sent = int(line.socket.send(data, socket.MSG_DONTWAIT))
        except BlockingIOError:
            return 0
        except OSError:
            line.write_data(data)  # fails alike, closes the line and says so in rospy's own way
            return len(data)
        if sent == len(data):
            line.stat_bytes += sent
            line.stat_num_msg += 1
        return sent

    def _send_backlog(self, data: bytes) -> None:
        """Send the rest of a message and what waits behind it, waiting for the listener."""
        while True:
            try:
                self._connection.write_data(data)
            except Exception as error:
                with self._lock:
                    self._error = error
                    self._waiting.clear()
                    self._backlog = False
                return
            with self._lock:
                if not self._waiting:
                    self._backlog = False
                    return
                data = self._waiting.popleft()
