"""The door without a socket: who comes in by the address alone."""

from __future__ import annotations

import socket

import pytest
from harness.opponents.graph_and_clients import SHIPPED
from msgspec.structs import replace
from rosbridge_gateway.admission.door_io import Door, NotAdmittedError, bind
from rosbridge_gateway.admission.places import Visitor
from websockets.datastructures import Headers

PROGRAM, PAGE = Headers(), Headers({"Origin": "http://localhost:8080"})
HERE = ("127.0.0.1", "127.3.4.5", "::1", "::1%lo")
ELSEWHERE = ("192.0.2.7", "10.0.0.1", "128.0.0.1", "2001:db8::7", "fe80::1%eth0", "0.0.0.0")


@pytest.mark.parametrize("host", HERE)
def test_a_client_of_this_machine_comes_in_without_a_token(host: str) -> None:
    """A program in the role of loopback clients, a page in the role of pages."""
    door = Door(SHIPPED, {})
    assert door.admit(host, PROGRAM, "/", 0.0) == Visitor("operator", is_page=False)
    assert door.admit(host, PAGE, "/", 0.0) == Visitor("viewer", is_page=True)


@pytest.mark.parametrize("headers", [PROGRAM, PAGE])
@pytest.mark.parametrize("host", ELSEWHERE)
def test_a_client_of_another_machine_needs_a_token(host: str, headers: Headers) -> None:
    """Whoever reaches the port from elsewhere is nobody, whatever page it names."""
    with pytest.raises(NotAdmittedError, match="a token is needed"):
        Door(SHIPPED, {}).admit(host, headers, "/", 0.0)


@pytest.mark.parametrize(("tls", "own", "pages"), [(None, "http", "https"), ("x", "https", "http")])
def test_the_gateways_own_origin_has_the_scheme_that_it_speaks(
    tls: str | None, own: str, pages: str
) -> None:
    """By the other scheme there may be a page on that port, whoever made it."""
    door = Door(replace(SHIPPED, tls_certificate=tls, tls_key=tls), {})

    def comes_as(scheme: str) -> Visitor:
        origin = Headers({"Origin": f"{scheme}://127.0.0.1:{SHIPPED.port}"})
        return door.admit("127.0.0.1", origin, "/", 0.0)

    assert comes_as(own) == Visitor("operator", is_page=False)
    assert comes_as(pages) == Visitor("viewer", is_page=True)


def test_the_port_is_free_again_at_once_after_the_gateways_end() -> None:
    """The system keeps what it has closed for a minute; a restart does not wait for that."""
    first = bind(replace(SHIPPED, port=0))
    port = first.getsockname()[1]
    with socket.create_connection(("127.0.0.1", port)):
        first.setblocking(True)
        first.accept()[0].close()  # whoever closes first is kept
        first.close()
    bind(replace(SHIPPED, port=port)).close()


def test_a_client_of_another_machine_has_the_role_of_its_token() -> None:
    """No address gives or takes a right."""
    door = Door(SHIPPED, {"look": "viewer"})
    assert door.admit("192.0.2.7", PROGRAM, "/?token=look", 0.0) == Visitor("viewer", False)
