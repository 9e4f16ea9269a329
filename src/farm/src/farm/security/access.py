"""What the router lets through, by the name in the certificate.

A machine's cells show themselves and answer questions to them, and hear nothing of others. Another
desk asks and hears all. Who has no place here, as one whose certificate was revoked, is connected
and gets nothing through.
"""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
from typing import Any

import msgspec


class Role(str, Enum):
    """What somebody who was invited is."""

    MACHINE = "machine"
    DESK = "desk"
    LAB = "lab member"
    """Runs programs on the other members' machines; of the lab's authority, not the farm's."""


class Invited(msgspec.Struct, frozen=True):
    """One who was invited.

    Attributes:
        name: Who; of a machine, the second part of its cells' keys.
        role: What it is.
        number: How often it was invited; only the newest certificate is good.
        until: When that ends [s since 1970].
        revoked: When it was revoked [s since 1970]; None: it is good.
    """

    name: str
    role: Role
    number: int
    until: float
    revoked: float | None = None

    @property
    def shown(self) -> str:
        """The name in the newest certificate."""
        return f"{self.name} {self.number}"


ALL = (
    "put",
    "delete",
    "declare_subscriber",
    "query",
    "reply",
    "declare_queryable",
    "liveliness_token",
    "liveliness_query",
    "declare_liveliness_subscriber",
)
"""All kinds of messages that zenoh tells apart here."""
SHOWS = ("put", "reply", "declare_queryable", "liveliness_token")
"""What a cell sends to the router."""
BOTH, IN, OUT = ("ingress", "egress"), ("ingress",), ("egress",)


def access_control(site: str, invited: Iterable[Invited]) -> dict[str, Any]:
    """Return zenoh's section ``access_control``; it reads it once, when the router opens.

    Args:
        site: First part of all keys.
        invited: Whose certificates are good.
    """
    rules = [_rule("everything", ALL, BOTH, "**")]
    # On this machine nobody needs a certificate: who is here can do worse things.
    subjects: list[dict[str, Any]] = [{"id": "this machine", "link_protocols": ["tcp"]}]
    policies = [{"rules": ["everything"], "subjects": ["this machine"]}]
    for each in invited:
        own = f"{each.role.value} {each.name}"
        names = ["everything"]
        if each.role is Role.MACHINE:
            keys = f"{site}/{each.name}/**"
            made = [
                _rule(f"{own} shows", SHOWS, IN, keys),
                _rule(f"{own} is asked", ("query",), OUT, keys),
                # That somebody looks, so that joints are sent only then; not what is sent.
                _rule(f"{own} is looked at", ("declare_subscriber",), OUT, f"{site}/**"),
            ]
            rules += made
            names = [rule["id"] for rule in made]
        subjects.append({"id": own, "link_protocols": ["tls"], "cert_common_names": [each.shown]})
        policies.append({"rules": names, "subjects": [own]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def _rule(name: str, messages: Iterable[str], flows: Iterable[str], keys: str) -> dict[str, Any]:
    return {
        "id": name,
        "messages": list(messages),
        "flows": list(flows),
        "permission": "allow",
        "key_exprs": [keys],
    }
