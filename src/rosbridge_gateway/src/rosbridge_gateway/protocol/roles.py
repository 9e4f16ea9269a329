"""Who may do what, by patterns of names per role; names that are taken; which person asks."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from rosbridge_gateway.config import Reserved, RoleRules
from rosbridge_gateway.protocol.names import any_of, patterns_in

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


_WILD = re.compile(r"[*?\[]")
HIDDEN = "***"
TOKEN = "token"
_TELL = 3  # our choice: so many nodes are named in a reason


class Roles:
    """The roles of gateway.yaml in one namespace."""

    def __init__(self, roles: Mapping[str, RoleRules], reserved: Reserved, namespace: str) -> None:
        """Take roles, the names of the cell's own nodes, and where relative patterns stand."""

        def absolute(patterns: Iterable[str]) -> list[str]:
            return patterns_in(patterns, namespace)

        self._rights = {
            (name, right): any_of(absolute(getattr(role, right)))
            for name, role in roles.items()
            for right in set(_RIGHTS.values())
        }
        self._outright = {
            (name, right): frozenset(
                p for p in absolute(getattr(role, right)) if not _WILD.search(p)
            )
            for name, role in roles.items()
            for right in ("publish", "advertise_service")
        }
        self._shared = any_of(absolute(reserved.shared))
        self._reserved = {
            "publish": any_of(absolute(reserved.publish)),
            "advertise_service": any_of(absolute(reserved.advertise_service)),
        }

    def authorise(self, role: str, op: str, name: str) -> str | None:
        """Tell why ``role`` may not do ``op`` with ``name``, or None if it may.

        Args:
            role: RoleRules of the client; an unknown one may do nothing.
            op: rosbridge's op.
            name: Absolute name of a topic or service.
        """
        right = _RIGHTS.get(op)
        pattern = self._rights.get((role, right)) if right is not None else None
        if right is None or pattern is None or not pattern.match(name):
            return f"role {role or 'none'} may not {op} {name}"
        reserved = self._reserved.get(right)
        if reserved is None or not reserved.match(name) or self.is_exempt(role, right, name):
            return None
        what = "published" if right == "publish" else "offered"
        return f"{name} is {what} by the cell's own nodes only"

    def is_exempt(self, role: str, right: str, name: str) -> bool:
        """Return whether ``name`` may be used though it is reserved, or another node has it.

        Args:
            role: RoleRules of the client.
            right: ``publish`` or ``advertise_service``.
            name: Absolute name of a topic or service.
        """
        if name in self._outright.get((role, right), ()):
            return True
        return right == "publish" and self._shared.match(name) is not None


def taken(name: str, what: str, nodes: Iterable[str]) -> str | None:
    """Tell that other nodes have ``name`` at this moment, or None if there are none.

    Args:
        name: Absolute name of a topic or service.
        what: What they do with it: ``published`` or ``offered``.
        nodes: Names of these nodes, the gateway left out.

    Example:
        >>> taken("/lamp", "offered", ["/cabinet"])
        '/lamp is offered by /cabinet already'
    """
    names = sorted(nodes)
    if not names:
        return None
    more = f" and {len(names) - _TELL} more" if len(names) > _TELL else ""
    return f"{name} is {what} by {', '.join(names[:_TELL])}{more} already"


def with_person(args: Any, person: str, token: str, owner: int) -> Any:
    """Return the arguments of a call with the client's person in them.

    A client that names a person itself proves it itself; so does one that gives its arguments as a
    list, where no field has a name.

    Args:
        args: As the client gave them.
        person: Whose token it came with; empty for nobody's.
        token: That token, the proof.
        owner: The client's number: two clients of one person are not the same.
    """
    if not person or not isinstance(args, dict | None) or (args or {}).get("person"):
        return args
    return {**(args or {}), "person": person, TOKEN: token, "session": f"gateway {owner}"}


def without_token(details: Any) -> Any:
    """Return the arguments of a call as the audit may show them.

    In a list the first is the command; any other text may be the token.
    """
    if isinstance(details, list):
        return [
            HIDDEN if place and each and isinstance(each, str) else each
            for place, each in enumerate(details)
        ]
    if isinstance(details, dict) and details.get(TOKEN):
        return {**details, TOKEN: HIDDEN}
    return details
