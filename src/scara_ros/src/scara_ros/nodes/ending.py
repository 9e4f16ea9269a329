"""End a node as soon as it is asked to.

rospy waits twice for the end of a pause of 0.5 s: in the thread that connects topics, which the
shutdown wakes too early, and in ``rospy.spin``. A cell has a dozen nodes.
"""

from __future__ import annotations

import threading

import rospy
import rospy.core
from rospy.impl.registration import RegManager, get_registration_listeners


def end_promptly() -> None:
    """Wake the thread that connects topics when the node ends; call after ``rospy.init_node``."""
    for listener in get_registration_listeners().listeners:
        if isinstance(listener, RegManager):
            _wake_at_end(listener.cond)


def wait_for_end() -> None:
    """Wait until the node ends, as ``rospy.spin`` does, and return at once then."""
    ended = threading.Event()
    rospy.core.add_shutdown_hook(lambda reason: ended.set())
    ended.wait()


def _wake_at_end(condition: threading.Condition) -> None:
    """Wake who waits, once ``rospy.is_shutdown`` is true: before that it would wait again."""

    def wake(reason: str) -> None:
        with condition:
            condition.notify_all()

    rospy.core.add_shutdown_hook(wake)
