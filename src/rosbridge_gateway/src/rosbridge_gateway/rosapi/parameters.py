"""rosapi's services of the parameter server: values travel as JSON text."""

from __future__ import annotations

import contextlib
import json
from base64 import b64encode
from typing import Any, Protocol

from rosbridge_gateway.rosapi.errors import RequestError


class ParameterServer(Protocol):
    """The parameter server; names without a leading slash stand in the gateway's namespace."""

    def get(self, name: str) -> Any:
        """Return a value, or a tree of values; raises KeyError if there is none."""

    def set(self, name: str, value: Any) -> None:
        """Set it; raises ValueError for what the parameter server cannot hold."""

    def has(self, name: str) -> bool:
        """Return whether it is set."""

    def search(self, name: str) -> str:
        """Return its name in the nearest namespace above, empty if there is none."""

    def delete(self, name: str) -> None:
        """Forget it, if it is set."""

    def names(self) -> list[str]:
        """Return the names of all that are set."""


def get_param(server: ParameterServer, name: str, default: str) -> dict[str, Any]:
    """Return a value as JSON.

    Without one it is ``default``, JSON or any other text, or ``null`` if that is empty.
    """
    try:
        value = server.get(name)
    except KeyError:
        # What is nested too deep is a text, too.
        with contextlib.suppress(ValueError, RecursionError):
            return {"value": json.dumps(json.loads(default))}
        value = default or None
    return {"value": json.dumps(value, default=_unusual)}


def set_param(server: ParameterServer, name: str, value: str) -> dict[str, Any]:
    """Set a value, given as JSON.

    Raises:
        RequestError: It is no JSON, or nothing that the parameter server can hold.
    """
    try:
        content = json.loads(value)
    except (ValueError, RecursionError) as error:
        raise RequestError(
            f"value = {value[:60]!r} is no JSON ({error}): write a text as '\"text\"'"
        ) from error
    _check_name(name)
    try:
        server.set(name, content)
    except (ValueError, RecursionError) as error:
        raise RequestError(f"value = {value[:60]!r}: {error}") from error
    return {}


def has_param(server: ParameterServer, name: str) -> dict[str, Any]:
    """Tell whether a parameter is set."""
    return {"exists": server.has(name)}


def search_param(server: ParameterServer, name: str) -> dict[str, Any]:
    """Tell where a parameter is set, in the gateway's namespace or above."""
    return {"global_name": server.search(name)}


def delete_param(server: ParameterServer, name: str) -> dict[str, Any]:
    """Forget a parameter; one that is not set is no error.

    Raises:
        RequestError: It would be all of them.
    """
    _check_name(name)
    server.delete(name)
    return {}


def get_param_names(server: ParameterServer) -> dict[str, Any]:
    """List all that are set."""
    return {"names": sorted(server.names())}


def _check_name(name: str) -> None:
    """Refuse a name of the whole tree, which belongs to all nodes: ROS reads ``//`` as ``/``, too.

    Raises:
        RequestError: It is one.
    """
    if not name.strip().strip("/"):
        raise RequestError(f"name = {name!r}: allowed: the name of one parameter")


def _unusual(value: Any) -> str:
    """Write what XML-RPC has and JSON has not: bytes as base64, a date as text."""
    content = getattr(value, "data", None)
    return b64encode(content).decode("ascii") if isinstance(content, bytes) else str(value)
