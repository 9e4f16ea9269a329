"""The line to a master: kept between questions, so that the master's end is seen without asking."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from socketserver import ThreadingMixIn
from typing import Any
from xmlrpc.server import SimpleXMLRPCRequestHandler, SimpleXMLRPCServer

import pytest
from scara_ros.starting.master_io import UNREACHABLE, MasterClient, MasterError


class KeepingHandler(SimpleXMLRPCRequestHandler):
    """Keeps lines, as the handler of rosmaster does."""

    protocol_version = "HTTP/1.1"


class Server(ThreadingMixIn, SimpleXMLRPCServer):
    """A master that answers ``getPid`` and can be ended like a process: all its lines close."""

    daemon_threads = True

    def __init__(self, handler: type[SimpleXMLRPCRequestHandler]) -> None:
        """Listen."""
        super().__init__(("127.0.0.1", 0), handler, logRequests=False)
        self.lines: list[socket.socket] = []
        self.register_function(lambda caller: (1, "", 42), "getPid")
        self.register_function(lambda caller: (-1, "no such thing", 0), "getUri")

    def process_request(self, request: Any, client_address: Any) -> None:
        """Remember the line."""
        self.lines.append(request)
        super().process_request(request, client_address)

    def close_lines(self) -> None:
        """Close what is open, as the kernel does for a process that ends."""
        for line in self.lines:
            line.shutdown(socket.SHUT_RDWR)


@contextmanager
def served(handler: type[SimpleXMLRPCRequestHandler]) -> Iterator[tuple[Server, MasterClient]]:
    """Run a master, and give a client of it."""
    with ExitStack() as stack:
        server = stack.enter_context(Server(handler))
        thread = threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True)
        thread.start()
        stack.callback(thread.join)
        stack.callback(server.shutdown)
        yield server, MasterClient(f"http://127.0.0.1:{server.server_address[1]}", "/tests")


def seconds(action: Callable[[], object]) -> float:
    """Return how long ``action`` takes."""
    begun = time.monotonic()
    action()
    return time.monotonic() - begun


def test_the_end_of_a_master_ends_the_waiting() -> None:
    """Nobody has to ask for it; the longest wait would fail the test."""
    with served(KeepingHandler) as (server, client):
        assert client.ask("getPid") == 42
        assert client.is_open()
        threading.Timer(0.05, server.close_lines).start()
        assert seconds(lambda: client.wait_for_end(60.0)) < 30.0


def test_a_master_that_lives_is_asked_again_after_the_time() -> None:
    """A line on which nothing comes is waited for to the end, and goes on to serve."""
    with served(KeepingHandler) as (server, client):
        client.ask("getPid")
        assert seconds(lambda: client.wait_for_end(0.1)) >= 0.1
        assert client.ask("getPid") == 42
        assert len(server.lines) == 1


def test_a_refused_question_keeps_the_line() -> None:
    """The answer came whole."""
    with served(KeepingHandler) as (_, client):
        with pytest.raises(MasterError, match="getUri: no such thing"):
            client.ask("getUri")
        assert client.is_open()


def test_without_a_line_the_time_is_waited() -> None:
    """Before the first question, and at a master that closes each line after its answer."""
    with served(SimpleXMLRPCRequestHandler) as (_, client):
        assert not client.is_open()
        assert seconds(lambda: client.wait_for_end(0.05)) >= 0.05
        client.ask("getPid")
        assert not client.is_open()
        assert seconds(lambda: client.wait_for_end(0.05)) >= 0.05


def test_a_line_that_has_ended_is_opened_anew() -> None:
    """The question after the end of one master goes to the next at the same address."""
    with served(KeepingHandler) as (server, client):
        client.ask("getPid")
        server.close_lines()
        client.wait_for_end(60.0)
        assert client.ask("getPid") == 42
        assert len(server.lines) == 2


def test_a_master_that_is_gone_is_said() -> None:
    """After the line's end the next question fails; the line is not open then."""
    with served(KeepingHandler) as (server, client):
        client.ask("getPid")
        server.close_lines()
    with pytest.raises(UNREACHABLE):
        client.ask("getPid")
    assert not client.is_open()
