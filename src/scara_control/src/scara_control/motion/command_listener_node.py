"""``motion_command`` as a node hears it, before all that waits beside it; and for whom it moves.

Who asks for a motion is said to the twin controller before the twin moves, and named in a stop.
"""

from __future__ import annotations

import select
import threading
import time
from collections.abc import Callable
from typing import Any

import rospy
from scara_ros.services.service_client_node import ServiceClient
from scara_ros.services.service_connection_io import ServiceError

from scara_control.motion.commands import STOPPED_AGAIN
from scara_control.motion.epoch import Epoch
from scara_control.motion.wiring_node import CallbackGuard, subscribe
from scara_msgs.msg import Audit, MotionCommand
from scara_msgs.srv import Control

_TURN_S = 0.002
"""Who has read a message and waits for the interpreter gets it in this time; our choice."""
AGAIN_S = 1.0
"""So often it is said of a motion that goes on: half of control.lend_ms; our choice."""
WITHIN_S = 0.5
"""A controller that does not answer by then stops what it does not know; our choice."""

OWN = ("motion_server", "trajectory_server", "joint_vel_controller", "joint_pose_controller")
"""Nodes that pass on what others have asked them for; they name those themselves."""


def _asking(message: Any) -> str:
    """Return who has sent a message or request; empty: nobody knows, or it is passed on."""
    caller = str((getattr(message, "_connection_header", None) or {}).get("callerid", ""))
    return "" if caller.rsplit("/", 1)[-1] in OWN else caller


class Movers:
    """Names who moves the twin although the pair is stopped, once in a stop.

    Its program may never have heard of the stop, and the person at the page has to find it.
    """

    def __init__(self, tell: Callable[[Audit], None]) -> None:
        """Remember whom to ``tell``; :func:`told_movers` tells the audit."""
        self._tell = tell
        self._asked: dict[str, str] = {}
        self._named: set[tuple[str, str]] = set()

    def asked(self, what: str, message: Any) -> None:
        """Note who has sent a message or a request that moves the twin.

        Args:
            what: Its topic or service.
            message: Its connection header says who.
        """
        if caller := _asking(message):
            self._asked[caller] = what

    def stopped(self, message: MotionCommand) -> None:
        """Name who has moved the twin since the stop before, if this one says that it may not."""
        again = message.reason == STOPPED_AGAIN
        for caller, what in self._asked.items():
            if again and (caller, what) not in self._named:
                self._named.add((caller, what))
                self._tell(Audit(who=caller, what=what, success=False, outcome=message.reason))
        if not again:
            self._named.clear()
        self._asked.clear()


def told_movers() -> Movers:
    """Return movers that are told to the audit and to the log."""
    audit = rospy.Publisher("twin_controller/audit", Audit, queue_size=10)

    def tell(entry: Audit) -> None:
        entry.header.stamp = rospy.Time.now()
        audit.publish(entry)
        rospy.logwarn("%s moves the twin by %s: %s", entry.who, entry.what, entry.outcome)

    return Movers(tell)


class Lending:
    """Says who asks for a motion: a program of this machine may be the holder's own.

    Without an answer the motion begins all the same. The controller judges it, as any other.
    """

    def __init__(self) -> None:
        """Call nothing yet."""
        self._control = ServiceClient("twin_controller/control", Control, WITHIN_S, keep=True)
        self._lock = threading.Lock()
        self._said: dict[str, tuple[float, bool]] = {}

    def say(self, message: Any, goes_on: bool = False) -> bool:
        """Return whether the sender of a message or request may move the twin as the holder's own.

        What another node of ours passes on is its own to say. To be called without a lock that a
        stop needs.

        Args:
            message: Its connection header names the sender.
            goes_on: Their motion runs already: it is said once in a while, and nobody waits for
                the answer, so a jog and a stop that come meanwhile are heard at once.
        """
        caller = _asking(message)
        if not caller:
            return False
        now = time.monotonic()
        with self._lock:
            known = goes_on and caller in self._said
            when, lent = self._said.get(caller, (float("-inf"), False))
            if known and now - when < AGAIN_S:
                return lent
            self._said = {caller: (now, lent)}  # of the newest only: senders come and go
        if known:
            self._control.start(action="LEND", by=caller)
            return lent
        try:
            # Without the lock: another sender's jog must not wait until this call has ended.
            lent = bool(self._control(action="LEND", by=caller).success)
        except (ServiceError, rospy.ROSException, OSError):
            lent = False
        with self._lock:
            self._said[caller] = (now, lent)
        return lent


class CommandListener:
    """Subscribes, and can wait until what has come is heard.

    Behind a standstill stops and requests wait side by side in sockets of their own, and chance
    says which thread goes first. So the stops are let go first: see :meth:`hear_first`.
    """

    def __init__(
        self,
        callback: Callable[[MotionCommand], None],
        guard: CallbackGuard,
        epoch: Epoch,
        lock: threading.Lock | threading.Condition,
        stood_still: Callable[[float], None] = lambda gap: None,
    ) -> None:
        """Subscribe.

        Args:
            callback: Gets each command.
            guard: Counts what it raises.
            epoch: Knows when the node may have stood still.
            lock: That of the epoch, which the callback takes too.
            stood_still: Told of each such gap [s], with the lock held.
        """
        self._epoch, self._lock, self._stood_still = epoch, lock, stood_still
        self._subscriber = subscribe("motion_command", MotionCommand, callback, guard, 20)

    def hear_first(self) -> None:
        """Let a stop that waits be heard before us, if this node may have stood still.

        Whoever of the node's threads has noticed that first. To be called without the lock.
        """
        with self._lock:
            now = time.monotonic()
            gap = self._epoch.ran(now)
            if gap:
                self._stood_still(gap)
            deadline = self._epoch.found_by(now)
        while time.monotonic() < deadline:
            time.sleep(_TURN_S)
            if not self._waits():
                return

    def _waits(self) -> bool:
        """Return whether a connection has something to read."""
        poll, found = select.poll(), False
        # rospy forgets the implementation when it unsubscribes.
        for connection in list(getattr(self._subscriber.impl, "connections", ())):
            socket = connection.socket
            # A connection that is being closed has no socket, or one that poll refuses.
            if socket is not None and socket.fileno() >= 0:
                poll.register(socket, select.POLLIN)
                found = True
        return found and bool(poll.poll(0))
