"""A service client against a master and services that come, go and hang; real sockets, no ROS."""

from __future__ import annotations

import contextlib
import io
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any
from xmlrpc.server import SimpleXMLRPCServer

import pytest
import roslib.message
from harness.wires.command_service import read_block
from rosbridge_gateway.graph.graph_io import GraphError
from rosbridge_gateway.graph.ros_service_call_node import RosServiceCall, ServiceTypes
from rosbridge_gateway.protocol.conversion import Arrival, Converters
from scara_ros.services.service_client_node import ServiceClient, is_offered, service_type
from scara_ros.services.service_connection_io import (
    ServiceError,
    ServiceMissingError,
    ServiceTimeoutError,
)
from std_srvs.srv import Trigger, TriggerResponse

DEADLINE = 5.0
NAME = "/s"


class Service:
    """A node that offers a Trigger and answers with the number of the call."""

    def __init__(self) -> None:
        self.calls = self.connections = 0
        self.held = threading.Event()
        """Answers wait while it is set."""
        self.dead = False
        """No header is answered."""
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.uri = f"rosrpc://127.0.0.1:{self._listener.getsockname()[1]}"
        self._lines: list[socket.socket] = []
        threading.Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        with contextlib.suppress(OSError):
            while True:
                line, _ = self._listener.accept()
                self._lines.append(line)
                threading.Thread(target=self._serve, args=(line,), daemon=True).start()

    def _serve(self, line: socket.socket) -> None:
        with contextlib.suppress(OSError):
            header = read_block(line)
            if self.dead:
                return
            fields = {"type": "std_srvs/Trigger", "md5sum": Trigger._md5sum, "callerid": "/n"}
            parts = [f"{key}={value}".encode() for key, value in fields.items()]
            body = b"".join(struct.pack("<I", len(part)) + part for part in parts)
            line.sendall(struct.pack("<I", len(body)) + body)
            if b"probe=1" in header:
                return
            self.connections += 1
            while True:
                read_block(line)
                self.calls += 1
                number = self.calls
                while self.held.is_set():
                    time.sleep(0.005)
                buffer = io.BytesIO()
                TriggerResponse(True, str(number)).serialize(buffer)
                answer = buffer.getvalue()
                line.sendall(b"\x01" + struct.pack("<I", len(answer)) + answer)
                if b"persistent=1" not in header:
                    return

    def close(self) -> None:
        """End the node and its connections."""
        self.held.clear()
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for line in self._lines:
            with contextlib.suppress(OSError):
                line.shutdown(socket.SHUT_RDWR)
            line.close()


class FakeMaster:
    """A master that knows one service, or hangs."""

    def __init__(self) -> None:
        self.known = ""
        self.asked = 0
        self.silent = threading.Event()
        self._server = SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False)
        self._server.register_function(self._look_up, "lookupService")
        self.uri = f"http://127.0.0.1:{self._server.server_address[1]}"
        threading.Thread(target=self._server.serve_forever, args=(0.01,), daemon=True).start()

    def _look_up(self, _: str, __: str) -> tuple[int, str, str]:
        self.asked += 1
        while self.silent.is_set():
            time.sleep(0.005)
        return (1, "", self.known) if self.known else (-1, "no provider", "")

    def close(self) -> None:
        """End it."""
        self.silent.clear()
        self._server.shutdown()
        self._server.server_close()


@pytest.fixture
def master(monkeypatch: pytest.MonkeyPatch) -> Iterator[FakeMaster]:
    """Start a master and make it this process's."""
    started = FakeMaster()
    monkeypatch.setenv("ROS_MASTER_URI", started.uri)
    yield started
    started.close()


@pytest.fixture
def start(master: FakeMaster) -> Iterator[Callable[[], Service]]:
    """Start services; the last one is what the master knows."""
    services: list[Service] = []

    def begin() -> Service:
        services.append(Service())
        master.known = services[-1].uri
        return services[-1]

    yield begin
    for service in services:
        service.close()


Start = Callable[[], Service]


def test_fields_go_and_the_response_comes(start: Start) -> None:
    """As with rospy's proxy."""
    start()
    answer = ServiceClient(NAME, Trigger, 1.0)()
    assert (answer.success, answer.message) == (True, "1")


def test_a_request_says_when_it_was_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """By the clock of this machine, where its type can say it and the caller has not."""
    from scara_msgs.srv import ForwardKinematics, MoveTo

    sent: list[Any] = []
    monkeypatch.setattr(ServiceClient, "call", lambda self, request: sent.append(request))
    before = time.monotonic()
    ServiceClient(NAME, MoveTo, DEADLINE)(x=0.5)
    ServiceClient(NAME, MoveTo, DEADLINE)(x=0.5, asked=1.5)
    ServiceClient(NAME, ForwardKinematics, DEADLINE)(joint_positions=[0.0])
    assert before <= sent[0].asked <= time.monotonic()
    assert sent[1].asked == 1.5
    assert not hasattr(sent[2], "asked")


def test_a_kept_connection_is_used_again(start: Start) -> None:
    """One connection for many calls, one for each without `keep`."""
    service = start()
    kept, plain = ServiceClient(NAME, Trigger, 1.0, keep=True), ServiceClient(NAME, Trigger, 1.0)
    assert [kept().message for _ in range(3)] == ["1", "2", "3"]
    assert service.connections == 1
    plain(), plain()
    assert service.connections == 3
    kept.close()


def test_a_service_that_was_started_anew_is_found(start: Start) -> None:
    """The old connection is seen to be closed before a request is sent: no call is doubled."""
    client = ServiceClient(NAME, Trigger, 1.0, keep=True)
    first = start()
    client()
    first.close()
    second = start()
    assert client().message == "1"
    assert (first.calls, second.calls) == (1, 1)
    client.close()


def test_a_kept_connection_needs_no_master(start: Start, master: FakeMaster) -> None:
    """A master that hangs does not hold up what is connected."""
    start()
    client = ServiceClient(NAME, Trigger, 1.0, keep=True)
    client()
    master.silent.set()
    begun = time.monotonic()
    assert client().message == "2"
    assert time.monotonic() - begun < 0.5 and master.asked == 1
    client.close()


def test_without_a_master_the_last_known_address_is_tried(start: Start, master: FakeMaster) -> None:
    """After the time of a look-up."""
    start()
    client = ServiceClient(NAME, Trigger, 0.2)
    client()
    master.silent.set()
    assert client().message == "2"


def test_without_a_master_a_web_sockets_client_reaches_what_was_called_before(
    start: Start, master: FakeMaster
) -> None:
    """The gateway makes a client for each call; a call that failed meanwhile changes nothing."""
    types = ServiceTypes(Converters(roslib.message.get_message_class, None))

    def call() -> dict[str, Any]:
        arrival = Arrival(0.0, (0, 0))
        return RosServiceCall(types, NAME, {}, 0.2, "/gateway/anna", arrival).run(lambda: None)

    service = start()
    assert call()["message"] == "1"
    master.silent.set()
    assert call()["message"] == "2"
    service.held.set()
    with pytest.raises(GraphError, match=r"did not answer within 0\.2 s"):
        call()
    service.held.clear()
    assert call()["message"] == "4"


def test_a_master_that_hangs_ends_the_call_in_time(start: Start, master: FakeMaster) -> None:
    """With its reason."""
    start()
    master.silent.set()
    begun = time.monotonic()
    with pytest.raises(ServiceError, match="service /s: roscore does not answer: timed out"):
        ServiceClient(NAME, Trigger, 0.2)()
    assert time.monotonic() - begun < DEADLINE


@pytest.mark.parametrize("keep", [False, True])
def test_a_service_that_hangs_ends_the_call_in_time(start: Start, keep: bool) -> None:
    """And the next call is a new one, over a new connection."""
    service = start()
    client = ServiceClient(NAME, Trigger, 0.1, keep=keep)
    service.held.set()
    with pytest.raises(ServiceTimeoutError, match=r"service /s did not answer within 0\.1 s"):
        client()
    service.held.clear()
    assert client().message == "2"
    client.close()


def test_a_call_lasts_no_longer_than_its_time_where_both_hang(
    start: Start, master: FakeMaster
) -> None:
    """The look-up is part of it: what is sent later than its time may move something."""
    service = start()
    client = ServiceClient(NAME, Trigger, 1.0)
    client()
    master.silent.set()
    service.held.set()
    for call in (client, lambda: service_type(NAME, 1.0, service.uri)):
        begun = time.monotonic()
        with pytest.raises(ServiceTimeoutError, match=r"did not answer within 1 s"):
            call()
        assert time.monotonic() - begun < 1.5
        service.dead = True


def test_a_missing_service_is_said_at_once(master: FakeMaster) -> None:
    """Unless the client was told to wait."""
    with pytest.raises(ServiceMissingError, match="service /s does not exist"):
        ServiceClient(NAME, Trigger, 1.0)()
    assert master.asked == 1


def test_a_client_waits_for_a_service_if_told_so(start: Start, master: FakeMaster) -> None:
    """For as long as it was told; then it says what is missing."""
    with pytest.raises(ServiceMissingError):
        ServiceClient(NAME, Trigger, 1.0, wait=0.15)()
    assert master.asked > 1
    later = threading.Timer(0.2, start)
    later.start()
    assert ServiceClient(NAME, Trigger, 1.0, wait=DEADLINE)().message == "1"
    later.join()


def test_a_lasting_call_goes_on_while_the_node_answers(start: Start) -> None:
    """A move takes as long as it takes; a node that hangs ends it."""
    service = start()
    client = ServiceClient(NAME, Trigger, 0.1, lasting=True)
    service.held.set()
    call = client.start()
    assert not call.ended.wait(0.5)
    service.held.clear()
    assert call.ended.wait(DEADLINE) and call.result().message == "1"
    service.held.set()
    call = client.start()
    assert not call.ended.wait(0.3)
    service.dead = True
    assert call.ended.wait(DEADLINE)
    with pytest.raises(ServiceTimeoutError):
        call.result()


def test_close_ends_a_running_call_and_refuses_others(start: Start) -> None:
    """For a caller that has gone."""
    service = start()
    client = ServiceClient(NAME, Trigger, 60.0)
    service.held.set()
    call = client.start()
    while not service.calls:
        time.sleep(0.005)
    client.close()
    assert call.ended.wait(DEADLINE)
    with pytest.raises(ServiceError, match="broke off"):
        call.result()
    with pytest.raises(ServiceError, match="the caller has gone"):
        client()


def test_the_type_of_a_service_is_asked_for(start: Start, master: FakeMaster) -> None:
    """By a probe, which disturbs nobody."""
    assert not is_offered(NAME, 0.2)
    service = start()
    assert is_offered(NAME, 0.2) and service_type(NAME, 1.0) == "std_srvs/Trigger"
    assert service.connections == 0
    service.close()
    assert not is_offered(NAME, 0.2)
    master.known = ""
