"""The relay of the tests: what it cuts is cut, whenever that is."""

from __future__ import annotations

import contextlib
import socket
import threading
from collections.abc import Iterator

import pytest
from harness.wires.proxy import Proxy, _Line

DEADLINE = 5.0


@pytest.fixture
def greeter() -> Iterator[int]:
    """Give the port of a server that greets each client and listens to it until its end."""
    server = socket.create_server(("127.0.0.1", 0))

    def listen(line: socket.socket) -> None:
        with contextlib.suppress(OSError), line:
            line.sendall(b"!")
            while line.recv(1024):
                pass

    def accept() -> None:
        with contextlib.suppress(OSError):
            while True:
                threading.Thread(target=listen, args=server.accept()[:1], daemon=True).start()

    threading.Thread(target=accept, daemon=True).start()
    yield server.getsockname()[1]
    server.shutdown(socket.SHUT_RDWR)
    server.close()


def test_a_client_that_was_served_is_cut(greeter: int) -> None:
    """However soon after its first byte."""
    for _ in range(100):
        with (
            Proxy(greeter) as proxy,
            socket.create_connection(("127.0.0.1", proxy.port), DEADLINE) as client,
        ):
            assert client.recv(1) == b"!"
            proxy.refuse(True)
            assert client.recv(1) == b""


@pytest.mark.parametrize("refused", [False, True])
def test_a_connection_that_is_being_made_is_cut(
    greeter: int, refused: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The relay stands between its own two connections when it happens."""
    with Proxy(greeter) as proxy:
        made = _Line.__init__

        def cut_before(line: _Line, *of: object) -> None:
            (proxy.refuse if refused else proxy.cut)(True)
            made(line, *of)  # type: ignore[arg-type]

        monkeypatch.setattr(_Line, "__init__", cut_before)
        with socket.create_connection(("127.0.0.1", proxy.port), DEADLINE) as client:
            assert client.recv(1) == b""


def test_it_listens_again_on_the_same_port(greeter: int) -> None:
    """And what stands before is gone."""
    with Proxy(greeter) as proxy:
        port = proxy.port
        proxy.refuse(True)
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(("127.0.0.1", port), DEADLINE)
        proxy.refuse(False)
        with socket.create_connection(("127.0.0.1", port), DEADLINE) as client:
            assert client.recv(1) == b"!"
