"""A topic that a client has just advertised: what it publishes reaches who connects meanwhile."""

from __future__ import annotations

import contextlib
import threading
import time
from typing import Any

import rospy

from rosbridge_gateway.protocol.first_messages import FirstOnes


class Opening(rospy.SubscribeListener):  # type: ignore[misc]
    """The first second of a topic.

    All publishers of a topic in one process share rospy's connections, so they share this too.
    While it lasts, each connection gets each message once and in order: first what came before it,
    then what comes. rospy's own ``publish`` cannot tell which connections it has served, therefore
    messages go to each connection by itself. Of a latching topic rospy sends the newest
    message once more, after these.
    """

    def __init__(self, publisher: rospy.Publisher, first: FirstOnes) -> None:
        self._impl = publisher.impl
        self._publishing = publisher.impl.publock  # the implementation forgets it when it closes
        self._first = first
        self._greeted: list[Any] = []
        self._lock = threading.RLock()
        self._impl.add_subscriber_listener(self)
        with self._lock:
            self._greet()  # who connected before we listened

    def is_of(self, publisher: rospy.Publisher) -> bool:
        """Return whether ``publisher`` uses these connections."""
        return publisher.impl is self._impl

    def extend(self) -> None:
        """Begin the first second again, for another publisher of the topic."""
        with self._lock:
            self._first.extend(time.monotonic())

    def publish(self, message: Any) -> bool:
        """Publish, and keep for who connects; return False when the first second is over.

        Raises:
            genpy.MessageException: ``message`` cannot be written.
        """
        now = time.monotonic()
        with self._lock:
            if not self._first.over_in(now):
                return False
            self._greet()
            self._first.add(message, now)
            impl = self._impl
            with self._publishing:
                if impl.is_latch:
                    impl.latch = message
                sequence = impl.seq
                present = impl.connections
                self._greeted = [c for c in self._greeted if any(c is one for one in present)]
                for connection in self._greeted:
                    impl.seq = sequence  # one message has one number, whoever gets it
                    impl.publish(message, connection_override=connection)
        return True

    def peer_subscribe(self, topic: str, to_all: Any, to_one: Any) -> None:
        """Send a new connection what it has missed; called by rospy."""
        with self._lock, contextlib.suppress(rospy.ROSException):  # the topic has just been closed
            self._greet()

    def forget(self, until: float) -> bool:
        """Forget what came until then (monotonic, [s]); return whether nobody had got it yet."""
        with self._lock:
            return self._first.forget(until, time.monotonic()) and not self._greeted

    def wanted_for(self) -> float:
        """Return how long [s] the publisher has to stay for subscribers to come."""
        with self._lock:
            return self._first.wanted_for(time.monotonic())

    def is_over(self) -> bool:
        """Return whether the first second is over."""
        with self._lock:
            return not self._first.over_in(time.monotonic())

    def end(self) -> None:
        """Forget everything if the first second is over."""
        with self._lock:
            if not self.is_over():  # another client still uses it
                return
            self._greeted.clear()
            listeners = self._impl.subscriber_listeners
            if listeners and self in listeners:
                listeners.remove(self)

    def _greet(self) -> None:
        """Send what is kept to connections that have got nothing yet."""
        impl = self._impl
        if impl.closed:
            return
        fresh = [c for c in impl.connections if not any(c is known for known in self._greeted)]
        kept = self._first.young(time.monotonic())
        for connection in fresh:
            self._greeted.append(connection)
            for message in kept:
                with self._publishing:
                    impl.publish(message, connection_override=connection)
