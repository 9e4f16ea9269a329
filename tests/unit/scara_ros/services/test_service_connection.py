"""One TCPROS service call, against a server that speaks literal bytes."""

from __future__ import annotations

import socket
import struct
import threading
from collections.abc import Callable, Iterator

import pytest
from scara_ros.services.service_connection_io import ServiceConnection, ServiceError

DEADLINE = 5.0
Serve = Callable[[socket.socket], None]


def header(**fields: str) -> bytes:
    """Return a TCPROS connection header."""
    parts = [f"{key}={value}".encode() for key, value in fields.items()]
    body = b"".join(struct.pack("<I", len(part)) + part for part in parts)
    return struct.pack("<I", len(body)) + body


def read(line: socket.socket) -> bytes:
    """Read one block with its length before it."""
    size = struct.unpack("<I", line.recv(4, socket.MSG_WAITALL))[0]
    return line.recv(size, socket.MSG_WAITALL) if size else b""


class Node:
    """A node that serves each connection as the test says."""

    def __init__(self, serve: Serve) -> None:
        self.requests: list[bytes] = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.uri = f"rosrpc://127.0.0.1:{self._listener.getsockname()[1]}"
        self._lines: list[socket.socket] = []
        self._thread = threading.Thread(target=self._run, args=(serve,))
        self._thread.start()

    def _run(self, serve: Serve) -> None:
        line, _ = self._listener.accept()
        self._lines.append(line)
        self.requests.append(read(line))
        serve(line)

    def close(self) -> None:
        """End the node."""
        self._thread.join(DEADLINE)
        for line in self._lines:
            line.close()
        self._listener.close()


@pytest.fixture
def make_node() -> Iterator[Callable[[Serve], Node]]:
    """Start nodes."""
    nodes: list[Node] = []

    def make(serve: Serve) -> Node:
        nodes.append(Node(serve))
        return nodes[-1]

    yield make
    for node in nodes:
        node.close()


def accept(line: socket.socket) -> None:
    """Answer the header as a service of type p/S does."""
    line.sendall(header(type="p/S", md5sum="abc", callerid="/node"))


MakeNode = Callable[[Serve], Node]


def test_type_is_asked_for_by_a_probe(make_node: MakeNode) -> None:
    """A probe does not disturb the service's node."""
    node = make_node(accept)
    with ServiceConnection("/s", node.uri, "/gateway", 1.0) as line:
        assert line.type == "p/S"
    assert b"probe=1" in node.requests[0]
    assert b"service=/s" in node.requests[0]
    assert b"callerid=/gateway" in node.requests[0]


def test_call_sends_the_request_and_returns_the_response(make_node: MakeNode) -> None:
    """Length before, one byte for success after; a response in pieces is put together."""

    def serve(line: socket.socket) -> None:
        accept(line)
        answer = bytes(reversed(read(line)))
        line.sendall(b"\x01" + struct.pack("<I", len(answer)))
        for octet in answer:
            line.sendall(bytes([octet]))

    node = make_node(serve)
    with ServiceConnection("/s", node.uri, "/gateway", 1.0, "abc") as line:
        assert line.call(b"request") == b"tseuqer"
    assert b"md5sum=abc" in node.requests[0] and b"probe" not in node.requests[0]


def test_service_that_fails_tells_why(make_node: MakeNode) -> None:
    """The text of the node's own error."""

    def serve(line: socket.socket) -> None:
        accept(line)
        read(line)
        line.sendall(b"\x00" + struct.pack("<I", 3) + b"ill")

    with (
        ServiceConnection("/s", make_node(serve).uri, "/gateway", 1.0, "abc") as line,
        pytest.raises(ServiceError, match="service /s failed: ill"),
    ):
        line.call(b"")


def test_service_that_refuses_tells_why(make_node: MakeNode) -> None:
    """Another type, for one."""
    node = make_node(lambda line: line.sendall(header(error="md5sums do not match")))
    with pytest.raises(ServiceError, match="service /s refuses: md5sums do not match"):
        ServiceConnection("/s", node.uri, "/gateway", 1.0, "abc")


@pytest.mark.parametrize("answers_header", [False, True])
def test_hanging_node_ends_the_call_in_time(make_node: MakeNode, answers_header: bool) -> None:
    """A node that accepts and says nothing, before or after its header."""
    over = threading.Event()

    def serve(line: socket.socket) -> None:
        if answers_header:
            accept(line)
        over.wait(DEADLINE)

    node = make_node(serve)
    with (
        pytest.raises(ServiceError, match=r"service /s did not answer within 0.05 s"),
        ServiceConnection("/s", node.uri, "/gateway", 0.05, "abc") as line,
    ):
        line.call(b"")
    over.set()


@pytest.mark.parametrize("answers_header", [False, True])
def test_node_that_breaks_off_is_noticed(make_node: MakeNode, answers_header: bool) -> None:
    """Its end is no time-out."""

    def serve(line: socket.socket) -> None:
        if answers_header:
            accept(line)
        line.shutdown(socket.SHUT_RDWR)

    node = make_node(serve)
    with (
        pytest.raises(ServiceError, match="service /s broke off: "),
        ServiceConnection("/s", node.uri, "/gateway", 1.0, "abc") as line,
    ):
        line.call(b"")


def test_node_that_is_gone_is_said() -> None:
    """The master still knows it, nobody is there."""
    with socket.create_server(("127.0.0.1", 0)) as free:
        uri = f"rosrpc://127.0.0.1:{free.getsockname()[1]}"
    with pytest.raises(
        ServiceError, match=f"service /s cannot be reached at {uri}: Connection refused"
    ):
        ServiceConnection("/s", uri, "/gateway", 1.0)


def test_close_from_another_thread_ends_a_waiting_call(make_node: MakeNode) -> None:
    """The gateway ends calls whose client has gone."""
    asked, over = threading.Event(), threading.Event()

    def serve(line: socket.socket) -> None:
        accept(line)
        read(line)
        asked.set()
        over.wait(DEADLINE)

    node = make_node(serve)
    line = ServiceConnection("/s", node.uri, "/gateway", 60.0, "abc")
    closing = threading.Thread(target=lambda: asked.wait(DEADLINE) and line.close())
    closing.start()
    with pytest.raises(ServiceError, match="service /s broke off"):
        line.call(b"")
    closing.join(DEADLINE)
    over.set()
