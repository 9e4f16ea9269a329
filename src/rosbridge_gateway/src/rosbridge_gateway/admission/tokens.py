"""Which role a token gives, and how long a wrong one makes the next attempt wait."""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
from collections.abc import Mapping
from dataclasses import dataclass

from rosbridge_gateway.config import GuessLimits

UNGUESSABLE = 32
"""A token of so many characters is found by no guessing; the made ones have 192 bits."""
_SUBSCRIBER_BITS = 64  # RFC 4291: whoever has one IPv6 address has the 2**64 of its network


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


@dataclass(slots=True)
class _Record:
    wrong: int
    at: float
    until: float


class Guesses:
    """The addresses from which wrong tokens came, at most ``addresses`` of them.

    A right token forgives nothing: who knows the viewer's token may be guessing the operator's.
    """

    def __init__(self, limits: GuessLimits) -> None:
        self._limits = limits
        # In the order of their last wrong token: the first is forgotten first.
        self._records: dict[str, _Record] = {}

    def __len__(self) -> int:
        return len(self._records)

    def wait(self, host: str, now: float) -> float:
        """Return for how long [s] no token from ``host`` is judged; 0 if it is judged now."""
        record = self._records.get(_network(host))
        return 0.0 if record is None else max(0.0, record.until - now)

    def wrong(self, host: str, now: float) -> float:
        """Note a wrong token at ``now`` (monotonic, [s]); return the delay [s] that it costs."""
        limits, network = self._limits, _network(host)
        record = self._records.pop(network, None)
        if record is None or now - record.at > limits.forgotten_after:
            record = _Record(0, now, now)
        delay = min(limits.longest_delay, limits.first_delay * 2.0 ** min(record.wrong, 60))
        self._records[network] = _Record(record.wrong + 1, now, now + delay)
        if len(self._records) > limits.addresses:
            del self._records[next(iter(self._records))]
        return delay


def _network(host: str) -> str:
    """Return what counts as one address."""
    address = ipaddress.ip_address(host.partition("%")[0])
    if isinstance(address, ipaddress.IPv4Address):
        return str(address)
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    return str(ipaddress.ip_network((address, _SUBSCRIBER_BITS), strict=False))
