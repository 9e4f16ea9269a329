"""The few services of rosapi that the gateway answers itself, with rosapi's field names."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol


class GraphNames(Protocol):
    """What the ROS graph knows by name."""

    def topics(self) -> dict[str, str]:
        """Return topics and their types."""

    def services(self) -> list[str]:
        """Return services."""

    def service_type(self, service: str) -> str:
        """Return the type of a service, empty if there is none."""


GET_TIME = "get_time"


def service_of(name: str, namespace: str) -> str | None:
    """Return which of rosapi's services an absolute name means, or None."""
    for prefix in ("/rosapi/", f"{namespace.rstrip('/')}/rosapi/"):
        if name.startswith(prefix):
            return name[len(prefix) :]
    return None


def time_values(secs: int, nsecs: int) -> dict[str, Any]:
    """Return the answer of get_time."""
    return {"time": {"secs": secs, "nsecs": nsecs}}


def answer(service: str, args: Any, graph: GraphNames) -> dict[str, Any] | None:
    """Return the answer of one of rosapi's services, or None when it is not offered.

    Args:
        service: Name below ``/rosapi``.
        args: The call's arguments, a dict or a list.
        graph: Where to look it up.
    """
    answers: dict[str, Callable[[str], dict[str, Any]]] = {
        "topics": lambda _: _topics(graph.topics()),
        "services": lambda _: {"services": graph.services()},
        "topic_type": lambda name: {"type": graph.topics().get(name, "")},
        "service_type": lambda name: {"type": graph.service_type(name)},
    }
    found = answers.get(service)
    return None if found is None else found(_first_argument(args))


def _topics(types: dict[str, str]) -> dict[str, Any]:
    return {"topics": list(types), "types": list(types.values())}


def _first_argument(args: Any) -> str:
    values = list(args.values()) if isinstance(args, dict) else list(args or ())
    return str(values[0]) if values else ""
