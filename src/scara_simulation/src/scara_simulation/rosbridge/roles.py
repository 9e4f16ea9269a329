"""Who may do what: patterns of topic and service names per role."""

from __future__ import annotations

from collections.abc import Mapping
from fnmatch import fnmatchcase

from scara_simulation.gateway_config import Role

# Which right an operation needs; one that is not listed is denied.
_RIGHTS = {
    "advertise": "publish",
    "unadvertise": "publish",
    "publish": "publish",
    "subscribe": "subscribe",
    "unsubscribe": "subscribe",
    "call_service": "call_service",
    "advertise_service": "advertise_service",
    "unadvertise_service": "advertise_service",
    "service_response": "advertise_service",
}


class Roles:
    """The roles of gateway.yaml in one namespace."""

    def __init__(self, roles: Mapping[str, Role], namespace: str) -> None:
        base = namespace.rstrip("/")
        self._patterns = {
            (name, right): tuple(p if p.startswith("/") else f"{base}/{p}" for p in getattr(role, right))
            for name, role in roles.items()
            for right in set(_RIGHTS.values())
        }

    def authorise(self, role: str, op: str, name: str) -> str | None:
        """Tell why ``role`` may not do ``op`` with ``name``, or None if it may.

        Args:
            role: Role of the client; an unknown one may do nothing.
            op: rosbridge's op.
            name: Absolute name of a topic or service.
        """
        right = _RIGHTS.get(op)
        if right is not None and any(fnmatchcase(name, pattern) for pattern in self._patterns.get((role, right), ())):
            return None
        return f"role {role or 'none'} may not {op} {name}"
