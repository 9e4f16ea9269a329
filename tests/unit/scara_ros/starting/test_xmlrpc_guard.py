"""The XML-RPC servers of master and nodes obey no web page."""

from __future__ import annotations

import http.client
import threading
import xmlrpc.client
from collections.abc import Iterator

import pytest
from rosgraph.xmlrpc import SilenceableXMLRPCRequestHandler, ThreadingXMLRPCServer
from scara_ros.starting.xmlrpc_guard_io import refusal, refuse_pages

OWN = frozenset({"cell-7", "10.0.0.7"})


@pytest.mark.parametrize(
    "host", ["localhost:11311", "127.0.0.1:4242", "127.0.1.1", "[::1]:9", "Cell-7:1", "10.0.0.7:80"]
)
def test_the_hosts_of_this_machine_are_taken(host: str) -> None:
    """ROS clients ask for the host that is in the URI."""
    assert refusal({"Host": host}, OWN) == ""


@pytest.mark.parametrize(
    ("headers", "text"),
    [
        ({"Host": "localhost:1", "Origin": "http://localhost:8080"}, "comes from a web page"),
        ({"Host": "localhost:1", "Origin": "null"}, "comes from a web page"),
        ({"Host": "localhost:1", "Origin": ""}, "comes from a web page"),
        ({"Host": "evil.example:11311"}, "evil.example"),
        ({"Host": "127.0.0.1.evil.example"}, "127.0.0.1.evil.example"),
        ({"Host": "127.evil.example.x"}, "127.evil.example.x"),
        ({"Host": "user@evil.example"}, "not this machine's name"),
        ({"Host": "[half"}, "not this machine's name"),
        ({"Host": ""}, "not this machine's name"),
        ({}, "not this machine's name"),
    ],
)
def test_pages_and_foreign_hosts_are_refused(headers: dict[str, str], text: str) -> None:
    """A page says so itself; a rebound name shows in Host."""
    assert text in refusal(headers, OWN)


@pytest.fixture
def server(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[int, list[str]]]:
    """Run the server that rospy and rosmaster run; give its port and the calls it obeyed."""
    monkeypatch.setattr(SilenceableXMLRPCRequestHandler, "do_POST", post)
    monkeypatch.setattr(SilenceableXMLRPCRequestHandler, "refuses_pages", False, raising=False)
    refuse_pages()
    obeyed: list[str] = []

    def shutdown(reason: str) -> int:
        obeyed.append(reason)
        return 1

    with ThreadingXMLRPCServer(("127.0.0.1", 0), 0) as running:
        running.register_function(shutdown, "shutdown")
        thread = threading.Thread(target=running.serve_forever, args=(0.01,))
        thread.start()
        yield running.server_address[1], obeyed
        running.shutdown()
        thread.join()


post = SilenceableXMLRPCRequestHandler.do_POST


def send(port: int, headers: dict[str, str]) -> int:
    """Send a shutdown as a browser would; return the status."""
    body = xmlrpc.client.dumps(("from a page",), "shutdown")
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=5.0)
    connection.request("POST", "/", body, {"Content-Type": "text/plain", **headers})
    status = connection.getresponse().status
    connection.close()
    return status


def test_a_page_shuts_no_node_down(server: tuple[int, list[str]]) -> None:
    """Neither with its Origin nor under a name that points here."""
    port, obeyed = server
    assert send(port, {"Origin": "http://localhost:3000"}) == 403
    assert send(port, {"Host": f"evil.example:{port}"}) == 403
    assert obeyed == []


def test_a_ros_client_is_served_after_a_page_was_refused(server: tuple[int, list[str]]) -> None:
    """The guard costs no client anything."""
    port, obeyed = server
    send(port, {"Origin": "http://localhost:3000"})
    xmlrpc.client.ServerProxy(f"http://localhost:{port}/").shutdown("from a node")
    assert obeyed == ["from a node"]


def test_a_second_call_changes_nothing(server: tuple[int, list[str]]) -> None:
    """A node that is hardened twice checks once."""
    guarded = SilenceableXMLRPCRequestHandler.do_POST
    refuse_pages()
    assert SilenceableXMLRPCRequestHandler.do_POST is guarded
