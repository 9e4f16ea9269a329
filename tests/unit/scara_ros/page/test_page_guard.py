"""The guard before a page's server: what it answers itself never reaches the server."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from scara_ros.page.page_door import PageDoor
from scara_ros.page.page_guard_io import KNOWN, PERSON, PageGuard

TOKEN = "token-of-the-tests"
HOST = "127.0.0.1:8090"
DOOR = PageDoor("pendant_page", "127.0.0.1", 8090, TOKEN)


class Server:
    """What stands behind the guard; it counts, for each page it builds costs a megabyte."""

    def __init__(self) -> None:
        self.known: list[bool] = []

    async def __call__(self, scope: Any, receive: Any, send: Any) -> None:
        """Answer with an empty page."""
        self.known.append(scope[KNOWN])
        if scope["type"] == "websocket":
            await send({"type": "websocket.accept"})
            return
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b""})


class Door:
    """A guard and its server."""

    def __init__(self, **options: Any) -> None:
        self.server = Server()
        self.guard = PageGuard(self.server, DOOR, **options)

    def ask(
        self, path: str = "/", query: str = "", kind: str = "http", **headers: str
    ) -> dict[str, Any]:
        """Return the first answer to a request, its headers by name, and its text."""
        sent: list[dict[str, Any]] = []

        async def send(message: dict[str, Any]) -> None:
            sent.append(message)

        async def receive() -> None:
            raise AssertionError("nobody reads the body")

        fields = {"host": HOST} | {key.replace("_", "-"): value for key, value in headers.items()}
        scope = {
            "type": kind,
            "method": "POST" if kind == "post" else "GET",
            "path": path,
            "query_string": query.encode(),
            "headers": [(key.encode(), value.encode()) for key, value in fields.items()],
        }
        if kind == "post":
            scope["type"] = "http"
        asyncio.run(self.guard(scope, receive, send))
        named = {name.decode(): value.decode() for name, value in sent[0].get("headers", ())}
        return {**sent[0], "named": named, "text": sent[-1].get("body", b"").decode()}

    def enter(self) -> str:
        """Come in by the address with the token; return the cookie."""
        answer = self.ask(query=f"token={TOKEN}")
        assert (answer["status"], answer["named"]["location"]) == (303, "/")
        return str(answer["named"]["set-cookie"])


@pytest.mark.parametrize(
    ("kind", "headers"),
    [
        ("http", {"host": "evil.example:8090"}),
        ("http", {"sec_fetch_site": "cross-site", "sec_fetch_dest": "iframe"}),
        ("post", {"origin": "http://127.0.0.1:9999"}),
        ("post", {"origin": "null"}),
    ],
)
def test_page_of_another_site_gets_a_line_of_text(kind: str, headers: dict[str, str]) -> None:
    """Even with the cookie, which browsers send to all ports: nothing is built for it."""
    door = Door()
    answer = door.ask("/start", kind=kind, cookie=door.enter().split(";")[0], **headers)
    assert answer["status"] == 403 and answer["text"] and door.server.known == []


@pytest.mark.parametrize(
    "headers", [{"host": "evil.example"}, {"origin": "http://localhost:9999"}, {}]
)
def test_web_socket_of_a_stranger_is_never_accepted(headers: dict[str, str]) -> None:
    """Another name, another origin, or nobody who has brought the token."""
    door = Door()
    answer = door.ask("/_nicegui_ws/", kind="websocket", **headers)
    assert answer["type"] == "websocket.close" and door.server.known == []


def test_token_becomes_a_cookie_that_no_script_and_no_other_site_gets() -> None:
    """It leaves the address bar, and is not the token."""
    door = Door()
    cookie = door.enter()
    assert cookie.startswith("pendant_page_8090=") and TOKEN not in cookie
    assert {"HttpOnly", "SameSite=Strict", "Path=/"} <= set(cookie.split("; "))
    pair = cookie.split(";")[0]
    assert door.ask(cookie=pair)["status"] == 200
    assert door.ask("/_nicegui_ws/", kind="websocket", cookie=pair)["type"] == "websocket.accept"
    assert door.server.known == [True, True]


@pytest.mark.parametrize("query", ["token=wrong", "token=", "token=%ff"])
def test_wrong_token_builds_nothing(query: str) -> None:
    """A guess costs as little as any other refusal."""
    door = Door()
    answer = door.ask(query=query)
    assert answer["status"] == 403 and "is wrong" in answer["text"] and not door.server.known


def test_nobody_without_the_token_gets_anything_of_a_private_page() -> None:
    """And is told what is missing."""
    door = Door()
    for path in ("/", "/_nicegui/x", "/favicon.ico"):
        answer = door.ask(path)
        assert answer["status"] == 403 and "the one with a token" in answer["text"]
    assert door.server.known == []


def test_page_that_may_be_watched_knows_who_only_watches() -> None:
    """As long as there is room."""
    full = ["", "32 pages watch already"]
    door = Door(stranger=lambda _: full.pop(0))
    assert door.ask()["status"] == 200 and door.server.known == [False]
    answer = door.ask()
    assert (answer["status"], answer["text"]) == (403, "32 pages watch already")
    assert door.server.known == [False]


@pytest.mark.parametrize(
    ("path", "ancestors", "options"),
    [("/", "'none'", "DENY"), ("/runs/one/report.html", "'self'", "SAMEORIGIN")],
)
def test_nobody_frames_the_page(path: str, ancestors: str, options: str) -> None:
    """A frame would let another site move the person's click; the page frames its own reports."""
    named = Door(stranger=lambda _: "", framed="/runs/").ask(path)["named"]
    assert named["content-security-policy"] == f"frame-ancestors {ancestors}"
    assert named["x-frame-options"] == options


def test_start_and_end_of_the_server_pass() -> None:
    """The guard judges requests only."""
    passed = []

    async def server(scope: Any, _: Any, __: Any) -> None:
        passed.append(scope["type"])

    asyncio.run(PageGuard(server, DOOR)({"type": "lifespan"}, None, None))  # type: ignore[arg-type]
    assert passed == ["lifespan"]


def test_each_person_is_known_by_their_own_token() -> None:
    """Whose address it is says who came: the foreman's, the fitter's, or nobody's."""
    server = Server()
    people: list[str] = []

    async def told(scope: Any, receive: Any, send: Any) -> None:
        people.append(scope[PERSON])
        await server(scope, receive, send)

    tokens = {"fitter": "token-of-fitter-0123", "foreman": "token-of-foreman-45678"}
    doors = {name: PageDoor("page", "127.0.0.1", 8090, token) for name, token in tokens.items()}
    door = Door()
    door.guard = PageGuard(told, doors=doors, stranger=lambda _: "")
    door.ask()
    for token in tokens.values():
        cookie = door.ask(query=f"token={token}")["named"]["set-cookie"]
        door.ask(cookie=str(cookie).split(";")[0])
    assert people == ["", "fitter", "foreman"] and server.known == [False, True, True]
    assert door.ask(query="token=wrong")["status"] == 403
