"""Calls of services that want to know which person asks."""

from __future__ import annotations

from typing import Any

HIDDEN = "***"
TOKEN = "token"


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
    """Return the arguments of a call as the audit may show them."""
    if isinstance(details, dict) and details.get(TOKEN):
        return {**details, TOKEN: HIDDEN}
    return details
