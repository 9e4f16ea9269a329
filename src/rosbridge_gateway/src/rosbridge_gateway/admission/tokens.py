"""Which role a token gives, compared without telling by the time it takes how much fits."""

from __future__ import annotations

import hashlib
import hmac
from collections.abc import Mapping

UNGUESSABLE = 32
"""A token of so many characters is found by no guessing; the made ones have 192 bits."""


class Tokens:
    """Roles by token; only digests are compared, so that lengths do not show either."""

    def __init__(self, roles: Mapping[str, str]) -> None:
        """Take the role by token."""
        self._known = [
            (_digest(token), role, len(token) >= UNGUESSABLE) for token, role in roles.items()
        ]

    def role(self, offered: str, only_unguessable: bool = False) -> str | None:
        """Return the role that ``offered`` gives, or None.

        Args:
            offered: What a client brought.
            only_unguessable: Compare with the tokens of ``UNGUESSABLE`` characters only.
        """
        found, digest = None, _digest(offered)
        for known, role, long in self._known:
            # Each is compared, also after one has fitted.
            if hmac.compare_digest(known, digest) and (long or not only_unguessable):
                found = role
        return found


def _digest(token: str) -> bytes:
    return hashlib.sha256(token.encode("utf-8", "surrogateescape")).digest()
