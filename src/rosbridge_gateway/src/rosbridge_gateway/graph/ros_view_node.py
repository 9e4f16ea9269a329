"""What rosapi asks: the master, the services' own nodes, the parameter server, the types."""

from __future__ import annotations

import threading
import time
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import rosgraph
import roslib.message
import rospy
from scara_ros.services.service_client_node import service_type
from scara_ros.services.service_connection_io import ServiceError
from scara_ros.starting.master_io import UNREACHABLE, MasterClient, MasterError

from rosbridge_gateway.graph.graph_io import GraphError
from rosbridge_gateway.rosapi.answers import SystemState
from rosbridge_gateway.rosapi.parameters import ParameterServer
from rosbridge_gateway.rosapi.typedefs import FindClass

_PROBE_TIMEOUT = 2.0
_PROBES = 8  # our choice: services that are asked for their type at once


class RosView:
    """Implements :class:`rosbridge_gateway.rosapi.answers.GraphView`.

    Each question goes over a line of its own: a hanging roscore costs a client its answer, not the
    others theirs.
    """

    def __init__(self) -> None:
        self.parameters: ParameterServer = RosParameters()
        self.find_message: FindClass = roslib.message.get_message_class
        self.find_service: FindClass = roslib.message.get_service_class
        # By calling thread, what others have computed for it since it asked last.
        self._others = threading.local()

    def topic_types(self) -> dict[str, str]:
        """Return the types of all topics, also of those that nobody uses any longer."""
        return dict(ask_master("getTopicTypes"))

    def system_state(self) -> SystemState:
        """Return who publishes, subscribes and offers what now."""
        publishers, subscribers, services = ask_master("getSystemState")
        return SystemState(dict(publishers), dict(subscribers), dict(services))

    def service_types(self, services: list[str]) -> dict[str, str]:
        """Return the types of services: each is asked, empty for one that does not tell."""
        with ThreadPoolExecutor(_PROBES, "gateway_probe") as threads:
            found = dict(zip(services, threads.map(_type_of, services)))
        self._others.seconds = self.helped() + sum(seconds for _, seconds in found.values())
        return {service: kind for service, (kind, _) in found.items()}

    def helped(self) -> float:
        """Return the processor time [s] of other threads for this one since it asked last."""
        seconds: float = getattr(self._others, "seconds", 0.0)
        self._others.seconds = 0.0
        return seconds

    def service_address(self, service: str) -> str:
        """Return where a service is, as rosrpc://host:port, empty if there is none."""
        try:
            return str(ask_master("lookupService", service))
        except _NothingThereError:
            return ""


class RosParameters:
    """Implements :class:`rosbridge_gateway.rosapi.parameters.ParameterServer`."""

    def get(self, name: str) -> Any:
        """Return a value, or a tree of values; raises KeyError if there is none."""
        try:
            return ask_master("getParam", _absolute(name))
        except _NothingThereError as error:
            raise KeyError(name) from error

    def set(self, name: str, value: Any) -> None:
        """Set it; raises ValueError for what the parameter server cannot hold."""
        try:
            ask_master("setParam", _absolute(name), value)
        except (TypeError, OverflowError) as error:  # XML-RPC has no null, and 32 bit integers
            raise ValueError(str(error)) from error

    def has(self, name: str) -> bool:
        """Return whether it is set."""
        return bool(ask_master("hasParam", _absolute(name)))

    def search(self, name: str) -> str:
        """Return its name in the nearest namespace above, empty if there is none."""
        try:
            return str(ask_master("searchParam", name))
        except _NothingThereError:
            return ""

    def delete(self, name: str) -> None:
        """Forget it, if it is set."""
        if self.has(name):
            ask_master("deleteParam", _absolute(name))

    def names(self) -> list[str]:
        """Return the names of all that are set."""
        return list(ask_master("getParamNames"))


class _NothingThereError(GraphError):
    """The master does not know what was asked for."""


def ask_master(method: str, *args: Any) -> Any:
    """Ask the master.

    Raises:
        GraphError: It does not answer, or refuses.
    """
    try:
        return MasterClient(rosgraph.get_master_uri(), rospy.get_caller_id()).ask(method, *args)
    except MasterError as error:
        raise _NothingThereError(str(error)) from error
    except UNREACHABLE as error:
        raise GraphError(f"roscore does not answer: {error}") from error


def _type_of(service: str) -> tuple[str, float]:
    """Return the type of a service, and the processor time [s] that this thread took to ask."""
    begun = time.thread_time()
    try:
        kind = service_type(service, _PROBE_TIMEOUT)
    except ServiceError:
        kind = ""
    return kind, time.thread_time() - begun


def _absolute(name: str) -> str:
    return str(rospy.resolve_name(name))
