"""What is taken out of the ROS graph, one after the other, in a thread of its own.

rospy tells the master of it without a time-out: one that hangs would keep the graph's thread, and
with it all clients, waiting until it goes on.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future

from scara_ros.starting.master_io import TIMEOUT

Act = Callable[[], object]


class Leaving:
    """Takes out what it is given, in order; for one thread."""

    def __init__(self) -> None:
        """Begin with nothing to take out."""
        self._waiting: queue.SimpleQueue[tuple[Act, Future[None]]] = queue.SimpleQueue()
        self._last: Future[None] = Future()
        self._last.set_result(None)
        # A daemon: the node's end does not wait for a master that hangs.
        threading.Thread(target=self._run, name="gateway_leave", daemon=True).start()

    def leave(self, act: Act) -> None:
        """Take something out; return when it is out, so that it can be offered anew.

        While the master hangs: return after the time-out of any question to it, and at once while
        something before it still waits.

        Args:
            act: Takes it out; what it raises meanwhile is raised here.
        """
        before, self._last = self._last, Future()
        self._waiting.put((act, self._last))
        if before.done():
            with contextlib.suppress(concurrent.futures.TimeoutError):
                self._last.result(TIMEOUT)

    def _run(self) -> None:
        while True:
            act, done = self._waiting.get()
            try:
                act()
                done.set_result(None)
            except Exception as error:
                done.set_exception(error)
