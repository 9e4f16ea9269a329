"""RosbridgeLink against a small web-socket server in the test."""

from __future__ import annotations

import json
import queue
import socket
import threading
import time
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from harness.processes import free_port, wait_until
from twin_controller.twin import rosbridge_socket_io
from twin_controller.twin.rosbridge_access_io import Access
from twin_controller.twin.rosbridge_link_io import RosbridgeLink
from twin_controller.twin.rosbridge_socket_io import LinkSettings
from typing_extensions import Self
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

DEADLINE = 5.0
QUICK = LinkSettings(silent_timeout=3.0, retry_first=0.02, retry_last=0.05)


class Server:
    """Collects what clients send; a test answers by ``send``."""

    def __init__(self, port: int = 0) -> None:
        self.packets: queue.Queue[dict[str, Any]] = queue.Queue()
        self.lines: queue.Queue[ServerConnection] = queue.Queue()
        self.headers: list[dict[str, str]] = []
        self._server = serve(self._attend, "127.0.0.1", port, compression=None, ping_interval=None)
        self.port = self._server.socket.getsockname()[1]
        self._thread = threading.Thread(target=self._server.serve_forever, daemon=True)
        self._thread.start()

    def _attend(self, line: ServerConnection) -> None:
        assert line.request is not None
        self.headers.append(dict(line.request.headers.raw_items()))
        self.lines.put(line)
        try:
            for data in line:
                self.packets.put(json.loads(data))
        except ConnectionClosed:
            pass

    def next(self, op: str) -> dict[str, Any]:
        """Return the next packet, which must have this op."""
        packet = self.packets.get(timeout=DEADLINE)
        assert packet["op"] == op
        return packet

    def line(self) -> ServerConnection:
        """Return the next client's connection."""
        return self.lines.get(timeout=DEADLINE)

    def say(self, op: str, line: ServerConnection | None = None, **fields: Any) -> None:
        """Send a packet to a client; without one to the next."""
        (line or self.line()).send(json.dumps({"op": op, **fields}))

    def close(self) -> None:
        """End the server and its clients."""
        self._server.shutdown()
        while not self.lines.empty():
            self.lines.get().close()
        self._thread.join(DEADLINE)


class Owner:
    """What the link told."""

    def __init__(self) -> None:
        self.messages: queue.Queue[tuple[str, dict[str, Any], float]] = queue.Queue()
        self.changes: queue.Queue[tuple[bool, str]] = queue.Queue()
        self.statuses: queue.Queue[tuple[str, str]] = queue.Queue()
        self.answers: queue.Queue[tuple[bool, Any, float, float]] = queue.Queue()

    def link(self, port: int, **options: Any) -> RosbridgeLink:
        """Return a link that tells this owner."""
        options.setdefault("settings", QUICK)
        return RosbridgeLink(
            f"ws://127.0.0.1:{port}",
            lambda *message: self.messages.put(message),
            lambda *change: self.changes.put(change),
            lambda *status: self.statuses.put(status),
            **options,
        )

    def answer(self, *answer: Any) -> None:
        """Take a call's answer."""
        self.answers.put(answer)


@pytest.fixture
def server() -> Iterator[Server]:
    """Run a server."""
    running = Server()
    yield running
    running.close()


@pytest.fixture
def owner() -> Owner:
    """Return an owner that was told nothing yet."""
    return Owner()


@pytest.fixture
def link(server: Server, owner: Owner) -> Iterator[RosbridgeLink]:
    """Run a connected link."""
    with owner.link(server.port) as running:
        assert owner.changes.get(timeout=DEADLINE) == (True, "")
        yield running


class SilentPort:
    """Shakes hands as a web-socket server would, then reads nothing and says nothing."""

    def __init__(self) -> None:
        self._server = Server()
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port = self._listener.getsockname()[1]
        self._thread = threading.Thread(target=self._relay, daemon=True)
        self._lines: list[socket.socket] = []

    def _relay(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            behind = socket.create_connection(("127.0.0.1", self._server.port))
            self._lines += [client, behind]
            behind.sendall(client.recv(4096))
            client.sendall(behind.recv(4096))

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()
        for line in self._lines:
            line.close()
        self._thread.join(DEADLINE)
        self._server.close()


def test_message_comes_with_topic_and_time(
    server: Server, owner: Owner, link: RosbridgeLink
) -> None:
    """on_message gets topic, values and the monotonic time of reception; null stays None."""
    before = time.monotonic()
    server.say("publish", topic="twin/joint_states", msg={"position": [1.5, None]})
    topic, message, received = owner.messages.get(timeout=DEADLINE)
    assert (topic, message) == ("twin/joint_states", {"position": [1.5, None]})
    assert before <= received <= time.monotonic()


def test_publishes_not_a_number_as_null(server: Server, link: RosbridgeLink) -> None:
    """JSON has no NaN: it goes as null."""
    assert link.publish("follow", {"position": [1.0, float("nan")]})
    assert server.next("publish")["msg"] == {"position": [1.0, None]}
    assert link.counters.sent == 1


def test_answer_brings_values_and_both_times(
    server: Server, owner: Owner, link: RosbridgeLink
) -> None:
    """A call's callback gets result, values, received and sent, which frame the round trip."""
    line = server.line()
    before = time.monotonic()
    assert link.call_service("/rosapi/get_time", {}, owner.answer, timeout=1.0)
    packet = server.next("call_service")
    assert packet["service"] == "/rosapi/get_time" and packet["timeout"] == 1.0
    time_ = {"time": {"secs": 7, "nsecs": 8}}
    server.say("service_response", line, id=packet["id"], result=True, values=time_)
    result, values, received, sent = owner.answers.get(timeout=DEADLINE)
    assert result and values == time_
    assert before <= sent <= received <= time.monotonic()


def test_failed_call_brings_the_reason(server: Server, owner: Owner, link: RosbridgeLink) -> None:
    """A service_response with result false carries the reason as its values."""
    link.call_service("/move_to", {"x": 0.9}, owner.answer, timeout=1.0)
    packet = server.next("call_service")
    server.say("service_response", id=packet["id"], result=False, values="too far")
    assert owner.answers.get(timeout=DEADLINE)[:2] == (False, "too far")


def test_call_without_an_answer_fails_in_time(
    server: Server, owner: Owner, link: RosbridgeLink
) -> None:
    """Each call gets one answer, if need be our own."""
    link.call_service("/move_to", {}, owner.answer, timeout=0.05)
    assert owner.answers.get(timeout=DEADLINE)[:2] == (
        False,
        "/move_to: no answer in time, it may still go on",
    )


def test_lost_link_fails_its_calls(server: Server, owner: Owner, link: RosbridgeLink) -> None:
    """An answer cannot come over another connection: the call fails before its time-out."""
    line = server.line()
    link.call_service("/move_to", {}, owner.answer, timeout=60.0)
    server.next("call_service")
    line.close(reason="maintenance")
    result, reason, _, _ = owner.answers.get(timeout=DEADLINE)
    assert not result and reason == "/move_to: link lost: closed by the server: maintenance"


def test_wishes_are_sent_at_each_connect(server: Server, owner: Owner) -> None:
    """Subscriptions and advertisements survive a lost link."""
    link = owner.link(server.port)
    link.subscribe("twin/joint_states", "sensor_msgs/JointState", throttle_ms=10)
    link.advertise("motion_command", "scara_msgs/MotionCommand")
    with link:
        for _ in range(2):
            line = server.line()
            assert server.next("subscribe") == {
                "op": "subscribe",
                "topic": "twin/joint_states",
                "type": "sensor_msgs/JointState",
                "throttle_rate": 10,
                "queue_length": 1,
                "id": "subscribe:twin/joint_states",
            }
            assert server.next("advertise")["topic"] == "motion_command"
            line.close()
        wait_until(lambda: link.counters.connects >= 3)


def test_wish_made_while_connected_is_sent_at_once(server: Server, link: RosbridgeLink) -> None:
    """An owner may subscribe at any time."""
    link.subscribe("joint_pose_controller/state", "scara_msgs/MotionState")
    assert server.next("subscribe")["topic"] == "joint_pose_controller/state"


def test_refused_wish_is_sent_again(server: Server, owner: Owner) -> None:
    """A gateway without a roscore refuses subscriptions; later nobody would ask again."""
    link = owner.link(server.port)
    link.subscribe("twin/joint_states", "sensor_msgs/JointState")
    with link:
        line, first = server.line(), server.next("subscribe")
        server.say("status", line, level="error", id=first["id"], msg="roscore does not answer")
        assert server.next("subscribe") == first
        assert link.counters.connects == 1


def test_server_that_comes_late_is_found(owner: Owner) -> None:
    """Any start order works; an attempt that fails for the same reason is told once."""
    port = free_port()
    with owner.link(port):
        connected, reason = owner.changes.get(timeout=DEADLINE)
        assert not connected and "refused" in reason
        threading.Event().wait(0.2)
        late = Server(port)
        assert owner.changes.get(timeout=DEADLINE) == (True, "")
    late.close()


def test_silent_peer_is_dropped(owner: Owner) -> None:
    """A peer that does not even answer a ping is dead, though its TCP connection stands."""
    with SilentPort() as port, owner.link(port.port, settings=LinkSettings()):
        assert owner.changes.get(timeout=DEADLINE) == (True, "")
        connected, reason = owner.changes.get(timeout=DEADLINE)
        assert not connected and reason.endswith("silent for 0.25 s")


def test_idle_but_living_peer_is_kept(
    server: Server, owner: Owner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A peer without news answers pings and is kept, beyond the silent time.

    The time is the test's own, and goes on once the peer has answered.
    """
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(rosbridge_socket_io, "time", SimpleNamespace(monotonic=lambda: clock.now))
    with owner.link(server.port) as link:
        assert owner.changes.get(timeout=DEADLINE) == (True, "")
        line: Any = link._line
        for _ in range(4):
            clock.now += 0.5 * QUICK.silent_timeout
            wait_until(lambda: line._heard == clock.now, DEADLINE, "an answer to a ping")
        assert link.connected and owner.changes.empty()


def test_full_line_drops_the_link_instead_of_blocking(owner: Owner) -> None:
    """Sending to a peer that reads nothing fails within a bound and drops the link."""
    patient = LinkSettings(
        silent_timeout=60.0, send_timeout=0.05, retry_first=60.0, retry_last=60.0
    )
    with SilentPort() as port, owner.link(port.port, settings=patient) as link:
        assert owner.changes.get(timeout=DEADLINE) == (True, "")
        longest, sent = 0.0, True
        for _ in range(1000):
            before = time.monotonic()
            sent = link.publish("follow", {"data": "x" * 100_000})
            longest = max(longest, time.monotonic() - before)
            if not sent:
                break
        assert not sent and longest < 1.0
        assert owner.changes.get(timeout=DEADLINE)[0] is False
        assert not link.connected and not link.publish("follow", {})


@pytest.mark.parametrize(
    "data",
    [
        "{",
        "[]",
        "\x00",
        '{"op": "publish", "topic": "t", "msg": [1]}',
        '{"op": "dance"}',
        '{"op": "service_response", "id": "x"}',
    ],
)
def test_bad_packet_is_counted_and_survived(
    server: Server, owner: Owner, link: RosbridgeLink, data: str
) -> None:
    """A loop never dies of one bad packet."""
    line = server.line()
    line.send(data)
    server.say("publish", line, topic="t", msg={"data": 1})
    assert owner.messages.get(timeout=DEADLINE)[1] == {"data": 1}
    assert link.counters.rejected == 1 and link.counters.received == 1


def test_remark_of_the_server_reaches_the_owner(
    server: Server, owner: Owner, link: RosbridgeLink
) -> None:
    """A refused packet is not lost in silence."""
    server.say("status", level="error", msg="x: unknown field")
    assert owner.statuses.get(timeout=DEADLINE) == ("error", "x: unknown field")
    assert link.counters.refused == 1


def test_failing_callback_is_counted(server: Server, caplog: pytest.LogCaptureFixture) -> None:
    """An error of the owner is logged and counted, the link goes on."""

    def fail(*_: Any) -> None:
        raise RuntimeError("owner is ill")

    with RosbridgeLink(f"ws://127.0.0.1:{server.port}", fail, lambda *_: None) as link:
        line = server.line()
        for _ in range(2):
            server.say("publish", line, topic="t", msg={})
        wait_until(lambda: link.counters.callback_errors == 2)
        assert link.connected
    assert "owner is ill" in caplog.text


def test_token_is_sent_and_origin_is_not(server: Server, owner: Owner) -> None:
    """A server off this machine asks for a token; an origin would make us look like a web page."""
    with owner.link(server.port, access=Access(token="secret")):
        server.line()
    assert (
        server.headers[0]["Authorization"] == "Bearer secret" and "Origin" not in server.headers[0]
    )


def test_close_ends_the_thread_with_a_close_frame(server: Server, owner: Owner) -> None:
    """No thread is left, and the server hears a proper goodbye."""
    with owner.link(server.port) as link:
        line = server.line()
        assert owner.changes.get(timeout=DEADLINE) == (True, "")
    assert not any(thread.name == "rosbridge_link" for thread in threading.enumerate())
    wait_until(lambda: line.protocol.close_rcvd is not None)
    assert owner.changes.empty() and not link.connected


def test_calls_fail_while_there_is_no_connection(owner: Owner) -> None:
    """A call that cannot be sent says so at once; its callback stays quiet."""
    link = owner.link(1)
    assert not link.call_service("/move_to", {}, owner.answer, timeout=1.0)
    assert owner.answers.empty() and link.counters.sent == 0
