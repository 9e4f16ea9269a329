"""rosapi's 25 services, answered from the graph, the types' definitions and the parameter server.

Names and fields are those of rosapi's own .srv files, so that its clients work unchanged.

Source:
    RobotWebTools/rosbridge_suite 0.11.17, rosapi/srv (the fields) and ros.org/wiki/rosapi.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from rosbridge_gateway.rosapi import parameters
from rosbridge_gateway.rosapi.errors import RequestError
from rosbridge_gateway.rosapi.parameters import ParameterServer
from rosbridge_gateway.rosapi.typedefs import FindClass, typedefs

Nodes = Mapping[str, list[str]]
"""Nodes by topic or service."""
Values = dict[str, Any]

GET_TIME = "get_time"
WRITES = frozenset({"set_param", "delete_param"})
"""What changes something, so that the audit tells it."""

_SCHEME = "rosrpc://"
_ACTION_TOPICS = frozenset({"cancel", "feedback", "goal", "result", "status"})


@dataclass(frozen=True, slots=True)
class SystemState:
    """Who publishes, subscribes and offers what, by absolute name."""

    publishers: Nodes
    subscribers: Nodes
    services: Nodes

    def topics(self) -> set[str]:
        """Return topics that somebody publishes or subscribes."""
        return {*self.publishers, *self.subscribers}


class GraphView(Protocol):
    """What can be asked of a ROS graph; a question that nobody answers raises the graph's error."""

    parameters: ParameterServer
    find_message: FindClass
    """Class of a message type, None if it is unknown here; ValueError for what is no type."""
    find_service: FindClass
    """The same for a service type; the class has _request_class and _response_class."""

    def topic_types(self) -> dict[str, str]:
        """Return the types of all topics, also of those that nobody uses any longer."""

    def system_state(self) -> SystemState:
        """Return who does what now."""

    def service_types(self, services: list[str]) -> dict[str, str]:
        """Return the types of services, empty for one that does not tell."""

    def service_address(self, service: str) -> str:
        """Return where a service is, as rosrpc://host:port, empty if there is none."""


def service_of(name: str, namespace: str) -> str | None:
    """Return which of rosapi's services an absolute name means, or None if none of them."""
    for prefix in ("/rosapi/", f"{namespace.rstrip('/')}/rosapi/"):
        service = name.removeprefix(prefix)
        if service != name and service in SERVICES:
            return service
    return None


def time_values(secs: int, nsecs: int) -> Values:
    """Return the answer of get_time."""
    return {"time": {"secs": secs, "nsecs": nsecs}}


def answer(service: str, args: Any, graph: GraphView) -> Values:
    """Return the answer of one of rosapi's services.

    Args:
        service: Its name below ``/rosapi``; not ``get_time``.
        args: The call's arguments, by name or in order; a missing one is empty.
        graph: Where to look it up.

    Raises:
        RequestError: The arguments do not fit, or there is no such type.
    """
    fields, respond = _ANSWERS[service]
    return respond(graph, *_arguments(args, fields))


def _arguments(args: Any, fields: tuple[str, ...]) -> list[str]:
    allowed = ", ".join(fields) or "none"
    if isinstance(args, list):
        if len(args) > len(fields):
            raise RequestError(f"{len(args)} values for the fields {allowed}")
        args = dict(zip(fields, args))
    values: dict[str, Any] = args or {}
    for name, value in values.items():
        if name not in fields:
            raise RequestError(f"{name}: unknown field: allowed: {allowed}")
        if not isinstance(value, str):
            raise RequestError(f"{name} = {value!r}: allowed: a text")
    return [values.get(name, "") for name in fields]


def _topics_and_types(graph: GraphView) -> dict[str, str]:
    """Return topics in use, with an empty type where it is not known."""
    types = graph.topic_types()
    return {topic: types.get(topic, "") for topic in sorted(graph.system_state().topics())}


def _topics(graph: GraphView) -> Values:
    found = _topics_and_types(graph)
    return {"topics": list(found), "types": list(found.values())}


def _topics_and_raw_types(graph: GraphView) -> Values:
    found = _topics_and_types(graph)
    texts = {kind: _full_text(graph, kind) for kind in set(found.values())}
    return {
        "topics": list(found),
        "types": list(found.values()),
        "typedefs_full_text": [texts[kind] for kind in found.values()],
    }


def _full_text(graph: GraphView, type_name: str) -> str:
    """Return the definition of a type with all that it contains, empty if it is unknown here."""
    try:
        return str(getattr(graph.find_message(type_name), "_full_text", ""))
    except ValueError:  # no type's name, such as "*" of a topic that only a recorder hears
        return ""


def _topics_for_type(graph: GraphView, type_name: str) -> Values:
    """Tell all topics that ever had the type, also those that nobody uses any longer."""
    found = graph.topic_types()
    return {"topics": sorted(topic for topic, kind in found.items() if kind == type_name)}


def _topic_type(graph: GraphView, topic: str) -> Values:
    return {"type": graph.topic_types().get(topic, "")}


def _services(graph: GraphView) -> Values:
    return {"services": sorted(graph.system_state().services)}


def _services_for_type(graph: GraphView, type_name: str) -> Values:
    types = graph.service_types(sorted(graph.system_state().services))
    return {"services": [name for name, kind in types.items() if kind == type_name]}


def _service_providers(graph: GraphView, type_name: str) -> Values:
    """Tell the nodes that offer services of a type: rosapi calls the type ``service``."""
    services = graph.system_state().services
    types = graph.service_types(sorted(services))
    of_type = [name for name, kind in types.items() if kind == type_name]
    return {"providers": [node for name in of_type for node in services[name]]}


def _service_type(graph: GraphView, service: str) -> Values:
    return {"type": graph.service_types([service]).get(service, "")}


def _service_node(graph: GraphView, service: str) -> Values:
    return {"node": next(iter(graph.system_state().services.get(service, [])), "")}


def _service_host(graph: GraphView, service: str) -> Values:
    return {"host": graph.service_address(service).removeprefix(_SCHEME).rpartition(":")[0]}


def _nodes(graph: GraphView) -> Values:
    state = graph.system_state()
    groups = (state.publishers, state.subscribers, state.services)
    return {
        "nodes": sorted({node for group in groups for found in group.values() for node in found})
    }


def _node_details(graph: GraphView, node: str) -> Values:
    state = graph.system_state()

    def of_node(group: Nodes) -> list[str]:
        return sorted(name for name, nodes in group.items() if node in nodes)

    return {
        "subscribing": of_node(state.subscribers),
        "publishing": of_node(state.publishers),
        "services": of_node(state.services),
    }


def _action_servers(graph: GraphView) -> Values:
    """Tell which names have all five topics of an action."""
    parts: dict[str, set[str]] = {}
    for topic in graph.system_state().topics():
        name, _, last = topic.rpartition("/")
        parts.setdefault(name, set()).add(last)
    found = (name for name, lasts in parts.items() if name and lasts >= _ACTION_TOPICS)
    return {"action_servers": sorted(found)}


def _message_details(graph: GraphView, type_name: str) -> Values:
    return {"typedefs": typedefs(_found(graph.find_message, type_name), graph.find_message)}


def _service_details(part: str) -> Callable[[GraphView, str], Values]:
    def respond(graph: GraphView, type_name: str) -> Values:
        kind = getattr(_found(graph.find_service, type_name), part)
        return {"typedefs": typedefs(kind, graph.find_message)}

    return respond


def _found(find: FindClass, type_name: str) -> type[Any]:
    try:
        found = find(type_name)
    except ValueError as error:
        raise RequestError(f"unknown type {type_name!r}: {error}") from error
    if found is None:
        raise RequestError(f"unknown type {type_name!r}: no package on this machine has it")
    return found


def _of_parameters(respond: Callable[..., Values]) -> Callable[..., Values]:
    return lambda graph, *texts: respond(graph.parameters, *texts)


_ANSWERS: dict[str, tuple[tuple[str, ...], Callable[..., Values]]] = {
    "action_servers": ((), _action_servers),
    "delete_param": (("name",), _of_parameters(parameters.delete_param)),
    "get_param": (("name", "default"), _of_parameters(parameters.get_param)),
    "get_param_names": ((), _of_parameters(parameters.get_param_names)),
    "has_param": (("name",), _of_parameters(parameters.has_param)),
    "message_details": (("type",), _message_details),
    "node_details": (("node",), _node_details),
    "nodes": ((), _nodes),
    "publishers": (
        ("topic",),
        lambda graph, topic: {"publishers": graph.system_state().publishers.get(topic, [])},
    ),
    "search_param": (("name",), _of_parameters(parameters.search_param)),
    "service_host": (("service",), _service_host),
    "service_node": (("service",), _service_node),
    "service_providers": (("service",), _service_providers),
    "service_request_details": (("type",), _service_details("_request_class")),
    "service_response_details": (("type",), _service_details("_response_class")),
    "service_type": (("service",), _service_type),
    "services": ((), _services),
    "services_for_type": (("type",), _services_for_type),
    "set_param": (("name", "value"), _of_parameters(parameters.set_param)),
    "subscribers": (
        ("topic",),
        lambda graph, topic: {"subscribers": graph.system_state().subscribers.get(topic, [])},
    ),
    "topic_type": (("topic",), _topic_type),
    "topics": ((), _topics),
    "topics_and_raw_types": ((), _topics_and_raw_types),
    "topics_for_type": (("type",), _topics_for_type),
}
SERVICES = frozenset({*_ANSWERS, GET_TIME})
