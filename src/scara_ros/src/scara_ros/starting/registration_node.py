"""Stay registered: a roscore that was started again knows nobody.

rospy registers each topic and service only once. Connections between nodes outlive the master, so
a running cell goes on without it. But no new node finds them, and no service is found at all,
until each node has said again what it offers. A new master knows no parameter either.
"""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Mapping
from io import BytesIO
from typing import Any

import rosgraph
import rospy
import rospy.core
from rospy.impl import tcpros_base
from rospy.impl.paramserver import get_param_server_cache
from rospy.impl.registration import (
    RegManager,
    get_registration_listeners,
    get_service_manager,
    get_topic_manager,
)

from scara_ros.starting.full_disk_io import limit_log_file
from scara_ros.starting.master_io import UNREACHABLE, MasterClient, MasterError
from scara_ros.starting.xmlrpc_guard_io import harden_process

PERIOD = 0.5  # our choice: with the time-out, all is registered again within 2 s
WATCHED_S = 5.0
"""A master that answers is asked so often; our choice. It shows its end itself, by closing the line
of the last question; asking finds one that hangs, or a machine that is gone."""
HANDSHAKE_S = 1.0
"""A ROS client says who it is as soon as it is connected; our choice."""
_LOST = -1
_kept: dict[str, Any] = {}  # parameters by absolute name


def keep_registered() -> None:
    """Watch the master from now on, in a thread of its own; call once, after ``rospy.init_node``.

    From then on a log line asks nobody either. As long as the flag below is not set, rospy asks the
    master for it at each line, and waits for the answer without a time-out: a master that hangs
    stopped whoever had something to say. A node that did not become one by ``become_node`` is
    hardened here. The node's log file has a limit from then on, a client that says nothing keeps
    nobody out, and the node's end does not wait for rospy's pauses.
    """
    harden_process()
    _limit_handshakes()
    # Else the thread that connects topics sleeps until its next look, and the node's end waits for
    # it. It exists from rospy.init_node on.
    for listener in get_registration_listeners().listeners:
        if isinstance(listener, RegManager):
            _wake_at_end(listener.cond)
    limit_log_file()
    get_param_server_cache().set("/rosout_disable_topics_generation", False)
    watch = _Watch(rosgraph.get_master_uri())
    watch.look()
    threading.Thread(target=watch.run, name="registration", daemon=True).start()


def keep_parameters(values: Mapping[str, Any]) -> None:
    """Set parameters now and again at each new master; to be called after ``keep_registered``.

    A master that is away is waited for, until the node ends.

    Args:
        values: By relative or absolute name; remappings hold.
    """
    _kept.update({rospy.resolve_name(name): value for name, value in values.items()})
    while not rospy.is_shutdown():
        try:
            return _set_parameters(MasterClient(rosgraph.get_master_uri(), rospy.get_caller_id()))
        except UNREACHABLE:  # the watch tells
            time.sleep(PERIOD)


class _Watch:
    """Asks the master who it is, and registers everything with each new one."""

    def __init__(self, uri: str) -> None:
        self._uri = uri
        self._line = MasterClient(uri, rospy.get_caller_id())
        self._pid: int | None = None

    def run(self) -> None:
        while not rospy.is_shutdown():
            if self._pid == _LOST or not self._line.is_open():
                time.sleep(PERIOD)
            else:
                self._line.wait_for_end(WATCHED_S)
            self.look()

    def look(self) -> None:
        """Compare the master with the one before.

        One that did not answer for a while counts as another.
        """
        try:
            pid = self._line.ask("getPid")
            if self._pid is not None and pid != self._pid:
                # Another master, or the same after a time without answers: it may know nothing of
                # this node. Who publishes is told to our own subscribers, as a master would.
                topics, services, uri = (
                    get_topic_manager(),
                    get_service_manager(),
                    rospy.get_node_uri(),
                )
                offered = _offers(topics, services)
                own = MasterClient(uri, rospy.get_caller_id())
                for kind, name, what in offered:
                    publishers = self._line.ask(f"register{kind}", name, what, uri)
                    if kind == "Subscriber":
                        own.ask("publisherUpdate", name, publishers)
                # What was given up while we registered must not come back by it.
                for kind, name, what in offered - _offers(topics, services):
                    self._line.ask(f"unregister{kind}", name, what if kind == "Service" else uri)
                count = len(offered)
                _set_parameters(self._line)
                rospy.logwarn(
                    "the ROS master was away: %d topics and services registered again", count
                )
            self._pid = pid
        except (*UNREACHABLE, MasterError) as error:
            if self._pid != _LOST and not rospy.is_shutdown():
                rospy.logwarn(
                    "the ROS master at %s does not answer: %s; what is connected goes on",
                    self._uri,
                    error,
                )
            self._pid = _LOST
            self._line = MasterClient(self._uri, rospy.get_caller_id())


def _set_parameters(line: MasterClient) -> None:
    for name, value in list(_kept.items()):
        line.ask("setParam", name, value)


def _offers(topics: Any, services: Any) -> set[tuple[str, str, str]]:
    """List (kind, resolved name, type or address) of all registrations of this node."""
    lists: list[tuple[str, Callable[[], list[Any]]]] = [
        ("Publisher", topics.get_publications),
        ("Subscriber", topics.get_subscriptions),
        ("Service", services.get_services),
    ]
    return {(kind, name, what) for kind, listed in lists for name, what in listed()}


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


def _limit_handshakes() -> None:
    """Close each connection to this node that does not say in time who it is.

    rospy accepts them in one thread, which reads the first message of each without a limit. A
    client that says nothing, as one does that takes this port for its forerunner's, kept every new
    subscriber waiting for good.
    """
    read = tcpros_base.read_ros_handshake_header

    def read_in_time(sock: socket.socket, text: BytesIO, size: int) -> Any:
        # One that this node has opened brings a limit of its own.
        if sock.gettimeout() is not None:
            return read(sock, text, size)
        sock.settimeout(HANDSHAKE_S)
        try:
            return read(sock, text, size)
        finally:
            sock.settimeout(None)

    tcpros_base.read_ros_handshake_header = read_in_time
