"""Stay registered: a roscore that was started again knows nobody, and rospy registers each topic and service only once.

Connections between nodes outlive the master, so that a running cell goes on without it; but nobody new finds them, and no
service is found at all, until each node has said again what it offers.
"""

from __future__ import annotations

import http.client
import threading
import time
import xmlrpc.client
from collections.abc import Callable
from typing import Any

import rosgraph
import rospy
from rospy.impl.paramserver import get_param_server_cache
from rospy.impl.registration import get_service_manager, get_topic_manager

PERIOD = 0.5  # our choice: with the time-out, everything is registered again within 2 s
TIMEOUT = 1.0  # our choice: a master that is stopped or overloaded holds nobody up for longer
UNREACHABLE = (OSError, http.client.HTTPException, xmlrpc.client.Error)

_LOST = -1


class MasterError(RuntimeError):
    """The master refused what it was asked."""


class _Transport(xmlrpc.client.Transport):
    """HTTP with a time-out: xmlrpc's own waits for ever on a master that does not answer."""

    def __init__(self, timeout: float) -> None:
        super().__init__()
        self._timeout = timeout

    def make_connection(self, host: Any) -> http.client.HTTPConnection:
        connection = super().make_connection(host)
        connection.timeout = self._timeout
        return connection


class MasterLine:
    """A line to a ROS master (or another node) on which no call lasts longer than ``timeout`` [s]."""

    def __init__(self, uri: str, timeout: float = TIMEOUT) -> None:
        self._proxy = xmlrpc.client.ServerProxy(uri, transport=_Transport(timeout))

    def ask(self, method: str, *args: Any) -> Any:
        """Call ``method`` in this node's name and return its value.

        Raises:
            MasterError: It answered with an error.
            OSError, HTTPException, xmlrpc.client.Error: It did not answer; see ``UNREACHABLE``.
        """
        code, text, value = getattr(self._proxy, method)(rospy.get_caller_id(), *args)
        if code != 1:
            raise MasterError(f"{method}: {text}")
        return value


def keep_registered() -> None:
    """Watch the master from now on, in a thread of its own; to be called once, after ``rospy.init_node``.

    From then on a log line asks nobody either: rospy asks the master for the flag below at each line as long as it is not
    set, and waits for the answer without a time-out, so that a master that hangs stopped whoever had something to say.
    """
    get_param_server_cache().set("/rosout_disable_topics_generation", False)
    watch = _Watch(rosgraph.get_master_uri())
    watch.look()
    threading.Thread(target=watch.run, name="registration", daemon=True).start()


class _Watch:
    """Asks the master who it is, and registers everything with each new one."""

    def __init__(self, uri: str) -> None:
        self._uri = uri
        self._line = MasterLine(uri)
        self._pid: int | None = None

    def run(self) -> None:
        while not rospy.is_shutdown():
            time.sleep(PERIOD)
            self.look()

    def look(self) -> None:
        """Compare the master with the one before; one that did not answer for a while counts as another."""
        try:
            pid = self._line.ask("getPid")
            if self._pid is not None and pid != self._pid:
                count = _register_all(self._line)
                rospy.logwarn("the ROS master was away: %d topics and services registered again", count)
            self._pid = pid
        except (*UNREACHABLE, MasterError) as error:
            if self._pid != _LOST and not rospy.is_shutdown():
                rospy.logwarn("the ROS master at %s does not answer: %s; what is connected goes on", self._uri, error)
            self._pid = _LOST
            self._line = MasterLine(self._uri)


def _register_all(line: MasterLine) -> int:
    """Say everything again that this node publishes, subscribes to and serves; return how much that is."""
    topics, services, uri = get_topic_manager(), get_service_manager(), rospy.get_node_uri()
    offered = _offers(topics, services)
    own = MasterLine(uri)
    for kind, name, what in offered:
        publishers = line.ask(f"register{kind}", name, what, uri)
        if kind == "Subscriber":
            own.ask("publisherUpdate", name, publishers)
    for kind, name, what in offered - _offers(topics, services):
        line.ask(f"unregister{kind}", name, what if kind == "Service" else uri)
    return len(offered)


def _offers(topics: Any, services: Any) -> set[tuple[str, str, str]]:
    """List (kind, resolved name, type or address) of all registrations of this node."""
    lists: list[tuple[str, Callable[[], list[Any]]]] = [
        ("Publisher", topics.get_publications),
        ("Subscriber", topics.get_subscriptions),
        ("Service", services.get_services),
    ]
    return {(kind, name, what) for kind, listed in lists for name, what in listed()}
