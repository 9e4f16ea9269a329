"""Origins of web pages: scheme, host and port, compared part by part."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from typing_extensions import Self

# What a browser sends (RFC 6454, section 6.1), and a pattern's port may be *.
_ORIGIN = re.compile(
    r"(?P<scheme>[a-z][a-z0-9+.-]*)://(?P<host>[a-z0-9._-]+|\[[0-9a-f:.]+\])"
    r"(?::(?P<port>\d{1,5}|\*))?",
    re.ASCII | re.IGNORECASE,
)
_DEFAULT_PORTS = {"http": 80, "https": 443}
_ANY = "*"
_FILE = "file://"
"""How a browser calls a page that was opened from a file, where it tells it from any other.

Some say ``null`` instead. That is also what they say of a frame that any web site has sandboxed, so
it is no origin here.
"""
_LARGEST_PORT = 65535
_LOOPBACK_HOSTS = ("localhost", "127.0.0.1", "[::1]")


class OriginError(ValueError):
    """A pattern that no origin can be compared with."""


@dataclass(frozen=True, slots=True)
class Origin:
    """Where a web page comes from; ``port`` is None for any (patterns only)."""

    scheme: str
    host: str
    port: int | None

    @classmethod
    def pattern(cls, text: str) -> Self:
        """Read a pattern: ``scheme://host``, ``scheme://host:port`` or ``scheme://host:*``.

        A page that was opened from a file is ``file://``.

        Raises:
            OriginError: It is something else.

        Example:
            >>> Origin.pattern("http://localhost:*")
            Origin(scheme='http', host='localhost', port=None)
        """
        found = cls._read(text, any_port=True)
        if found is None:
            raise OriginError(
                f"{text!r}: allowed: scheme://host, scheme://host:port, scheme://host:*, and "
                "file:// for pages that were opened from a file; null is no origin: a frame of any "
                "web site can have it"
            )
        return found

    @classmethod
    def header(cls, text: str) -> Self | None:
        """Read an Origin header; None if it is malformed."""
        return cls._read(text, any_port=False)

    @classmethod
    def _read(cls, text: str, any_port: bool) -> Self | None:
        if text == _FILE:
            return cls("file", "", None)
        match = _ORIGIN.fullmatch(text)
        if match is None:
            return None
        scheme, host, port = match["scheme"].lower(), match["host"].lower(), match["port"]
        if port == _ANY:
            return cls(scheme, host, None) if any_port else None
        number = int(port) if port else _DEFAULT_PORTS.get(scheme, 0)
        return cls(scheme, host, number) if 0 < number <= _LARGEST_PORT else None

    def admits(self, origin: Origin) -> bool:
        """Return whether ``origin`` has the scheme and host of this pattern, and its port."""
        return (self.scheme, self.host) == (origin.scheme, origin.host) and self.port in (
            None,
            origin.port,
        )


def own_origins(port: int, is_tls: bool) -> tuple[Origin, ...]:
    """Return the origins that a page of this server would have in a browser of this machine.

    Example:
        >>> own_origins(9090, is_tls=False)[0]
        Origin(scheme='http', host='localhost', port=9090)
    """
    scheme = "https" if is_tls else "http"
    return tuple(Origin(scheme, host, port) for host in _LOOPBACK_HOSTS)


def is_file(header: str) -> bool:
    """Return whether a browser names so a page that was opened from a file."""
    return header == _FILE


def is_allowed(header: str, patterns: Iterable[Origin]) -> bool:
    """Return whether a page with this Origin header may connect.

    Example:
        >>> is_allowed("http://localhost:80.evil.example", [Origin.pattern("http://localhost:*")])
        False
    """
    origin = Origin.header(header)
    return origin is not None and any(pattern.admits(origin) for pattern in patterns)
