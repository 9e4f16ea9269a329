"""Stands before a page's server: who is not let in gets one line of text, and nothing is built."""

from __future__ import annotations

import secrets
import time
from collections.abc import Awaitable, Callable, Mapping, MutableMapping, Sequence
from typing import Any
from urllib.parse import parse_qs

from scara_ros.page.page_door import PageDoor, Visit

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Any]]
Send = Callable[[Any], Awaitable[None]]
Server = Callable[[Scope, Receive, Send], Awaitable[None]]
Answer = tuple[int, str, list[tuple[bytes, bytes]]]

READING = ("GET", "HEAD", "OPTIONS")
KNOWN = "scara.known"
"""Key of a request's scope: whether the visitor has brought a token."""
PERSON = "scara.person"
"""Key of a request's scope: whose token that was; empty for nobody's."""
PRIVATE = "This page needs the address that was printed when it was started, the one with a token."
WRONG = "The token in the address is wrong. The right one was printed when the page was started."


class PageGuard:
    """An ASGI middleware; it sets ``KNOWN`` and ``PERSON`` in the scope of those it lets in."""

    def __init__(
        self,
        server: Server,
        door: PageDoor | None = None,
        stranger: Callable[[str], str] = lambda _: PRIVATE,
        framed: str = "",
        doors: Mapping[str, PageDoor] | None = None,
        readable: str = "",
        readers: frozenset[str] = frozenset(),
    ) -> None:
        """Guard a server.

        Args:
            server: The next in line.
            door: The rules of a page with one token.
            stranger: Says why somebody without the token does not get a path, or an empty text.
            framed: Paths that start so may stand in a frame of the page itself.
            doors: The rules of a page with a token for each person, by name; they differ by that.
            readable: Paths that start so may be read (GET, HEAD) by pages of other sites,
            readers: whose origins are these.
        """
        self._readable, self._readers = readable, readers
        self._server, self._stranger, self._framed = server, stranger, framed
        self._doors = dict(doors or {})
        if door is not None:
            self._doors[""] = door
        self._door = next(iter(self._doors.values()))

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a request, or refuse it."""
        if scope["type"] not in ("http", "websocket"):
            await self._server(scope, receive, send)
            return
        visit = _visit(scope)
        if self._is_reader(scope, visit):
            await self._lend(scope, visit.origin, receive, send)
            return
        refused = self._answer(scope, visit)
        if refused is not None and scope["type"] == "http":
            await _say(send, *refused)
        elif refused is not None:
            await send({"type": "websocket.close", "code": 1008, "reason": refused[1]})
        else:
            await self._server(scope, receive, self._marked(scope["path"], send))

    def _is_reader(self, scope: Scope, visit: Visit) -> bool:
        """Return whether a page of another site reads what it may; it is nobody we know."""
        return (
            bool(self._readable)
            and scope["type"] == "http"
            and scope["path"].startswith(self._readable)
            and scope["method"] in READING
            and visit.origin in self._readers
            and self._door.is_asked(visit)
        )

    async def _lend(self, scope: Scope, origin: str, receive: Receive, send: Send) -> None:
        """Serve a page of another site; its browser lets it see the answer by these marks."""
        marks = [
            (b"access-control-allow-origin", origin.encode()),
            (b"access-control-allow-methods", b"GET, HEAD"),
            # A cache must not hand the permission of one site to another.
            (b"vary", b"Origin"),
        ]
        if scope["method"] == "OPTIONS":
            await _say(send, 204, "", marks)
            return
        # Who reads from another site is nobody here, whatever cookies its browser sends.
        scope[KNOWN], scope[PERSON] = False, ""
        await self._server(scope, receive, self._marked(scope["path"], _with(marks, send)))

    def _answer(self, scope: Scope, visit: Visit) -> Answer | None:
        """Return what is answered here; None: the visitor is let in."""
        if why := self._door.refusal(visit):
            return 403, why, []
        if visit.token is not None and (scope["type"], scope["path"]) == ("http", "/"):
            # Put a cookie in the token's place, off the screen
            brought = [door for door in self._doors.values() if door.brings_token(visit)]
            if not brought:
                return 403, WRONG, []
            session = brought[0].session(secrets.token_hex(16), int(time.time()))
            # No script of a page can read it, and no other site sends it along.
            cookie = f"{self._door.cookie}={session}; Path=/; HttpOnly; SameSite=Strict"
            return 303, "", [(b"location", b"/"), (b"set-cookie", cookie.encode())]
        now = int(time.time())
        known = [name for name, door in self._doors.items() if door.knows(visit, now)]
        scope[KNOWN], scope[PERSON] = bool(known), known[0] if known else ""
        if not scope[KNOWN] and (why := self._stranger(scope["path"])):
            return 403, why, []
        return None

    def _marked(self, path: str, send: Send) -> Send:
        """Return ``send`` that forbids frames of others."""
        own = bool(self._framed) and path.startswith(self._framed)
        return _with(_marks(own), send)


def _with(marks: Sequence[tuple[bytes, bytes]], send: Send) -> Send:
    """Return ``send`` that puts lines into the head of each answer."""

    async def marked(message: Any) -> None:
        if message["type"] == "http.response.start":
            message = {**message, "headers": [*message.get("headers", ()), *marks]}
        await send(message)

    return marked


def _marks(own: bool) -> list[tuple[bytes, bytes]]:
    ancestors, options = (b"'self'", b"SAMEORIGIN") if own else (b"'none'", b"DENY")
    return [
        (b"content-security-policy", b"frame-ancestors " + ancestors),
        (b"x-frame-options", options),
        (b"x-content-type-options", b"nosniff"),
        (b"referrer-policy", b"same-origin"),
    ]


async def _say(send: Send, status: int, text: str, headers: list[tuple[bytes, bytes]]) -> None:
    body = text.encode()
    head = [
        (b"content-type", b"text/plain; charset=utf-8"),
        (b"content-length", str(len(body)).encode()),
        (b"cache-control", b"no-store"),
        *headers,
        *_marks(False),
    ]
    await send({"type": "http.response.start", "status": status, "headers": head})
    await send({"type": "http.response.body", "body": body})


def _visit(scope: Scope) -> Visit:
    """Read what a request says of itself."""
    found: dict[str, list[str]] = {}
    for name, value in scope["headers"]:
        found.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))

    def header(name: str) -> str:
        return ", ".join(found.get(name, ()))

    tokens = parse_qs(scope["query_string"].decode("latin-1"), keep_blank_values=True).get("token")
    return Visit(
        hosts=tuple(found.get("host", ())),
        origin=header("origin"),
        site=header("sec-fetch-site"),
        mode=header("sec-fetch-mode"),
        destination=header("sec-fetch-dest"),
        cookies="; ".join(found.get("cookie", ())),
        token=tokens[0] if tokens else None,
    )
