"""The door without a socket: who comes in by the address alone."""

from __future__ import annotations

import socket

import pytest
from harness.opponents.graph_and_clients import SHIPPED
from msgspec.structs import replace
from rosbridge_gateway.admission.door_io import Door, NotAdmittedError, bind
from rosbridge_gateway.admission.places import Visitor
from websockets.datastructures import Headers

TOKENS = {"look": "viewer", "drive": "operator"}
BEARER = {"Authorization": "Bearer look"}
OPERATOR, VIEWER, PAGE = (
    Visitor("operator", False),
    Visitor("viewer", False),
    Visitor("viewer", True),
)
HERE = ("127.0.0.1", "127.3.4.5", "::1", "::1%lo")
ELSEWHERE = ("192.0.2.7", "10.0.0.1", "128.0.0.1", "2001:db8::7", "fe80::1%eth0", "0.0.0.0")


def come(
    path: str = "/", host: str = "127.0.0.1", more: dict[str, str] | None = None, **changes: str
) -> Visitor:
    """Come to the door of the shipped file, with changes."""
    return Door(replace(SHIPPED, **changes), TOKENS).admit(host, Headers(more or {}), path, 0.0)


def page(origin: str = "http://localhost:8080") -> dict[str, str]:
    """Return what a browser says for a page."""
    return {"Origin": origin}


@pytest.mark.parametrize("host", HERE)
def test_a_client_of_this_machine_comes_in_without_a_token(host: str) -> None:
    """A program in the role of loopback clients, a page in the role of pages."""
    assert come(host=host) == OPERATOR
    assert come(host=host, more=page()) == PAGE


@pytest.mark.parametrize(
    ("path", "more", "visitor"),
    [
        *[("/?token=look", {}, VIEWER), ("/?token=drive", {}, OPERATOR), ("/", BEARER, VIEWER)],
        ("/?token=drive", BEARER, VIEWER),
        ("/?token=drive", page(), OPERATOR),  # a browser can give it in the address only
        *[("/", page("file://"), PAGE), ("/?token=drive", page("file://"), PAGE)],
        # websocket-client names the address it connects to; the gateway serves no page that could.
        *[("/", page(f"http://{host}:9090"), OPERATOR) for host in ("localhost", "[::1]")],
        *[("/", page("https://127.0.0.1:9090"), PAGE), ("/", page("http://127.0.0.1:9091"), PAGE)],
    ],
)
def test_token_and_origin_decide_the_role(
    path: str, more: dict[str, str], visitor: Visitor
) -> None:
    """Header before query; a page from a file reads only, as any can ask its reader for a token."""
    assert come(path, more=more) == visitor


@pytest.mark.parametrize(
    ("path", "more", "changes", "status", "reason"),
    [
        *[("/?token=guess", more, {}, 401, "unknown token") for more in ({}, page("file://"))],
        ("/", {}, {"loopback_role": ""}, 401, "a token is needed"),
        ("/", page(), {"page_role": ""}, 401, "a token is needed"),
        ("/?token=drive", page("file://"), {"page_role": ""}, 403, "pages need a page_role"),
        *[
            (path, page(origin), {}, 403, f"a page of '{origin}' may not connect")
            for path in ("/", "/?token=drive")
            for origin in ("http://localhost:80.evil.example", "file://example.org", "null")
        ],
    ],
)
def test_whoever_may_not_come_in_is_told_why(
    path: str, more: dict[str, str], changes: dict[str, str], status: int, reason: str
) -> None:
    """A page of another origin, or of none, does not drive the robot even by its user's token."""
    with pytest.raises(NotAdmittedError, match=reason) as caught:
        come(path, more=more, **changes)
    assert caught.value.status == status
    assert ("a frame of any web site" in str(caught.value)) == ("null" in reason)


@pytest.mark.parametrize("more", [{}, page()])
@pytest.mark.parametrize("host", ELSEWHERE)
def test_a_client_of_another_machine_needs_a_token(host: str, more: dict[str, str]) -> None:
    """Whoever reaches the port from elsewhere is nobody, whatever page it names."""
    with pytest.raises(NotAdmittedError, match="a token is needed"):
        come(host=host, more=more)
    assert come("/?token=look", host) == VIEWER


@pytest.mark.parametrize(("tls", "own", "pages"), [(None, "http", "https"), ("x", "https", "http")])
def test_the_gateways_own_origin_has_the_scheme_that_it_speaks(
    tls: str, own: str, pages: str
) -> None:
    """By the other scheme there may be a page on that port, whoever made it."""
    files = {"tls_certificate": tls, "tls_key": tls}
    assert come(more=page(f"{own}://127.0.0.1:9090"), **files) == OPERATOR
    assert come(more=page(f"{pages}://127.0.0.1:9090"), **files) == PAGE


def test_the_port_is_free_again_at_once_after_the_gateways_end() -> None:
    """The system keeps what it has closed for a minute; a restart does not wait for that."""
    first = bind(replace(SHIPPED, port=0))
    port = first.getsockname()[1]
    with socket.create_connection(("127.0.0.1", port)):
        first.setblocking(True)
        first.accept()[0].close()  # whoever closes first is kept
        first.close()
    bind(replace(SHIPPED, port=port)).close()
