"""Who may load a page of ours, and who is known there: the rules of its door.

A page on loopback is reached by every web site that the person's browser shows. So the browser's
own words about a request are judged before anything is built for it.
"""

from __future__ import annotations

import hashlib
import hmac
import ipaddress
import re
from dataclasses import dataclass

SESSION_S = 12 * 3600  # our choice: a shift; then the address with the token is opened again
EARLY_S = 60  # our choice: a clock may be set back by so much before a cookie is of the future
HOST = re.compile(r"(\[[0-9a-f:.]+\]|[a-z0-9._-]+)(?::\d{1,5})?")
OWN = ("", "same-origin", "none")


@dataclass(frozen=True)
class Visit:
    """What a request says of itself; an empty text for a header that is not there.

    Attributes:
        hosts: All Host headers.
        origin: Who sends it, as a browser tells it.
        site: Sec-Fetch-Site.
        mode: Sec-Fetch-Mode.
        destination: Sec-Fetch-Dest.
        cookies: Cookie headers, joined.
        token: What the address gives; None: it gives none.
    """

    hosts: tuple[str, ...]
    origin: str = ""
    site: str = ""
    mode: str = ""
    destination: str = ""
    cookies: str = ""
    token: str | None = None


@dataclass(frozen=True)
class PageDoor:
    """The door of one page.

    Attributes:
        page: Name of its node.
        host: Address that it was told to listen on.
        port: The port.
        token: Whoever brings it is known from then on.
    """

    page: str
    host: str
    port: int
    token: str

    @property
    def cookie(self) -> str:
        """The cookie's name; browsers send a cookie to all ports, so the port is in it."""
        return f"{self.page}_{self.port}"

    def refusal(self, visit: Visit) -> str:
        """Return why nobody is answered, or an empty text.

        A request without the headers of a browser is none of a web site: a program of this machine.
        """
        if not self.is_asked(visit):
            return "this page is not served under that name"
        if visit.origin and visit.origin.lower() != f"http://{visit.hosts[0].lower()}":
            return "another site may not use this page"
        opened = (visit.mode, visit.destination) == ("navigate", "document")
        if visit.site.lower() not in OWN and not opened:
            return "another site may not use this page"
        return ""

    def is_asked(self, visit: Visit) -> bool:
        """Return whether a request means this page: it has one Host, and that is ours."""
        return len(visit.hosts) == 1 and is_known_host(visit.hosts[0], self.host)

    def brings_token(self, visit: Visit) -> bool:
        """Return whether the address has the right token."""
        return visit.token is not None and hmac.compare_digest(
            visit.token.encode(), self.token.encode()
        )

    def session(self, nonce: str, now: int) -> str:
        """Return the cookie of somebody who has brought the token.

        Args:
            nonce: Drawn at random, letters and digits.
            now: Time of day [s since 1970].
        """
        return f"{now}.{nonce}.{self._mark(str(now), nonce)}"

    def knows(self, visit: Visit, now: int) -> bool:
        """Return whether a cookie was made here from this token, not too long ago."""
        return any(
            self._is_session(value, now) for value in cookie_values(visit.cookies, self.cookie)
        )

    def _is_session(self, value: str, now: int) -> bool:
        parts = value.split(".")
        if len(parts) != 3 or not re.fullmatch(r"[0-9]{1,12}", parts[0]):
            return False
        made, nonce, mark = parts
        # In constant time: how long it takes tells nothing of the right mark.
        fits = hmac.compare_digest(mark.encode(), self._mark(made, nonce).encode())
        return fits and -EARLY_S <= now - int(made) <= SESSION_S

    def _mark(self, made: str, nonce: str) -> str:
        text = f"{self.cookie}.{made}.{nonce}"
        return hmac.new(self.token.encode(), text.encode(), hashlib.sha256).hexdigest()


def is_known_host(header: str, told: str) -> bool:
    """Return whether a Host header is one of loopback, or of the address to listen on.

    A name that somebody else's name server points at this machine is neither. Where the page
    listens on all addresses any number is good: numbers need no name server.

    Example:
        >>> is_known_host("localhost:8080", "127.0.0.1"), is_known_host("evil.example", "0.0.0.0")
        (True, False)
    """
    found = HOST.fullmatch(header.lower())
    if found is None:
        return False
    name = found[1].strip("[]")
    if name in ("localhost", told.lower()):
        return True
    number = _number(name)
    everywhere = _number(told)
    return number is not None and (
        number.is_loopback or (everywhere is not None and everywhere.is_unspecified)
    )


def cookie_values(header: str, name: str) -> list[str]:
    """Return the values of the cookies of a name; there may be several, for several paths."""
    pairs = (part.strip().partition("=") for part in header.split(";"))
    return [value for key, _, value in pairs if key == name]


def _number(name: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    try:
        return ipaddress.ip_address(name)
    except ValueError:
        return None
