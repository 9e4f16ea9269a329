"""A request has left when the storm says so, and not before."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import closing
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from harness.wires.command_service import CommandService
from harness.wires.service_line import ServiceLine
from scara_ros.services.service_connection_io import ServiceMissingError, ServiceTimeoutError


@pytest.fixture
def master() -> Iterator[tuple[str, CommandService]]:
    """Give a master's address, and the one service that it knows as ``/command``."""
    with (
        closing(CommandService()) as service,
        SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False) as server,
    ):

        def lookup(caller: str, name: str) -> list[object]:
            return [1, "", service.uri] if name == "/command" else [-1, f"no {name}", ""]

        server.register_function(lookup, "lookupService")
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_address[1]}", service
        server.shutdown()


def test_nothing_is_heard_before_it_is_sent(master: tuple[str, CommandService]) -> None:
    """The connection is greeted first; then the answer belongs to what was sent."""
    from scara_msgs.srv import TwinCommand

    uri, service = master
    with ServiceLine(uri, "/command", TwinCommand, "/storm") as line:
        assert service.heard == []
        answer = line.call(5.0, command="STOP")
    assert answer.success and answer.message == "STOP was heard" and service.heard == ["STOP"]


def test_service_that_is_not_there_or_does_not_answer_is_said(
    master: tuple[str, CommandService],
) -> None:
    """Neither is a finding of a storm."""
    from scara_msgs.srv import TwinCommand

    uri, service = master
    with pytest.raises(ServiceMissingError, match="no /other"):
        ServiceLine(uri, "/other", TwinCommand, "/storm")
    service.answers.clear()
    line = ServiceLine(uri, "/command", TwinCommand, "/storm")
    with line, pytest.raises(ServiceTimeoutError):
        line.call(0.05, command="STOP")
