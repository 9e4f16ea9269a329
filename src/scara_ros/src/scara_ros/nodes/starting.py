"""Become a ROS node: wait for the master, end by a signal, stay registered."""

from __future__ import annotations

import atexit
import contextlib
import queue
import signal
import sys
import threading
from collections.abc import Iterator

import rosgraph
import rospy

from scara_ros.nodes.registration import keep_registered

RETRY_S = 0.5
ENDING_S = 5.0
SIGNALS = (signal.SIGINT, signal.SIGTERM)


def become_node(name: str) -> None:
    """Become the node ``name`` once there is a master; to be called once, in the main thread.

    SIGINT or SIGTERM ends the waiting, later the node: ``rospy.is_shutdown`` is true then and ``rospy.spin`` returns. The
    shutdown runs in a thread of its own. rospy's own handler runs it inside the interrupted thread, and where that was just
    publishing and held the lock of a connection, the shutdown waited for that lock for ever.

    Raises:
        SystemExit: A signal came before there was a master; the code is 0.
    """
    received: queue.SimpleQueue[int] = queue.SimpleQueue()  # the one queue that a handler may always put into
    for number in SIGNALS:
        signal.signal(number, lambda caught, _frame: received.put(caught))
    _wait_for_master(name, received)
    rospy.init_node(name, disable_signals=True)
    ending = threading.Thread(target=_end_with, args=(received,), name="ending", daemon=True)
    ending.start()
    atexit.register(_finish, received, ending)
    keep_registered()


@contextlib.contextmanager
def until_shutdown() -> Iterator[None]:
    """Run a node's loop; what it publishes while the node shuts down has no topic any more, and ends the loop."""
    try:
        yield
    except rospy.ROSException:
        if not rospy.core.is_shutdown_requested():  # topics are closed before is_shutdown is true
            raise


def _wait_for_master(name: str, received: queue.SimpleQueue[int]) -> None:
    """Say once that the master is missing, and wait."""
    told = False
    while not rosgraph.is_master_online():
        if not told:
            print(f"{name}: no roscore at {rosgraph.get_master_uri()}: waiting for it", file=sys.stderr, flush=True)
            told = True
        try:
            received.get(timeout=RETRY_S)
        except queue.Empty:
            continue
        sys.exit(0)


def _end_with(received: queue.SimpleQueue[int]) -> None:
    """Shut the node down when a signal, or the end of the program, has come."""
    number = received.get()
    rospy.signal_shutdown(f"signal {number}" if number else "the program has ended")


def _finish(received: queue.SimpleQueue[int], ending: threading.Thread) -> None:
    """Let the shutdown come to its end before the interpreter goes."""
    received.put(0)
    ending.join(ENDING_S)
