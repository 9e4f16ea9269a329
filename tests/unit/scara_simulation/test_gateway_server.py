"""The web-socket server with a stand-in for the ROS graph."""

from __future__ import annotations

import json
import queue
import socket
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import msgspec
import pytest
import websocket
from harness.opponents.secured_gateway import write_certificate
from scara_simulation.gateway_config import GatewayConfig, load_gateway_config
from scara_simulation.io.gateway_door import GatewayError
from scara_simulation.io.gateway_graph import Ask, GraphError
from scara_simulation.io.gateway_server import GatewayServer
from scara_simulation.rosbridge.audit import Entry

DEADLINE = 5.0
SHIPPED = load_gateway_config(Path(__file__).parents[3] / "config")
PATIENT = {"port": 0, "ping_interval": 60.0, "ping_timeout": 60.0}
TOKENS = {"look": "viewer", "drive": "operator"}


class Call:
    """A service call that ends when the test says so."""

    def __init__(self, args: Any, timeout: float, caller: str) -> None:
        self.args = args
        self.timeout = timeout
        self.caller = caller
        self.end: queue.Queue[dict[str, Any] | Exception] = queue.Queue()
        self.cancelled = threading.Event()

    def run(self) -> dict[str, Any]:
        """Wait for the test."""
        outcome = self.end.get(timeout=DEADLINE)
        if isinstance(outcome, Exception):
            raise outcome
        return outcome

    def cancel(self) -> None:
        """End as a broken connection would."""
        self.cancelled.set()
        self.end.put(GraphError("cancelled"))


class Graph:
    """Notes what the gateway asks of ROS."""

    def __init__(self) -> None:
        self.done: queue.Queue[tuple[Any, ...]] = queue.Queue()
        self.calls: queue.Queue[Call] = queue.Queue()
        self.asks: dict[str, Ask] = {}
        self.audited: queue.Queue[tuple[str, Entry]] = queue.Queue()

    def advertise(self, owner: int, topic: str, type_name: str | None, latch: bool, queue_size: int) -> None:
        """Know all types."""
        self.done.put(("advertise", owner, topic, type_name, latch, queue_size))

    def unadvertise(self, owner: int, topic: str) -> None:
        """Note it."""
        self.done.put(("unadvertise", owner, topic))

    def publish(self, owner: int, topic: str, values: dict[str, Any]) -> None:
        """Refuse one value, break at another."""
        if values.get("data") == "refuse":
            raise GraphError("data = 'refuse': allowed: anything else")
        if values.get("data") == "break":
            raise KeyError("a bug")
        self.done.put(("publish", owner, topic, values))

    def subscribe(self, owner: int, topic: str, type_name: str | None) -> None:
        """Know no topic called unknown."""
        if topic.endswith("/unknown"):
            raise GraphError(f"the type of {topic} is not known")
        self.done.put(("subscribe", owner, topic, type_name))

    def unsubscribe(self, owner: int, topic: str) -> None:
        """Note it."""
        self.done.put(("unsubscribe", owner, topic))

    def service_call(self, service: str, args: Any, timeout: float, caller: str) -> Call:
        """Hand the call to the test."""
        call = Call(args, timeout, caller)
        self.calls.put(call)
        return call

    def advertise_service(self, owner: int, service: str, type_name: str, ask: Ask, timeout: float) -> None:
        """Keep the way to the client."""
        self.asks[service] = ask
        self.done.put(("advertise_service", owner, service, type_name))

    def unadvertise_service(self, owner: int, service: str) -> None:
        """Note it."""
        self.done.put(("unadvertise_service", owner, service))

    def audit(self, caller: str, entry: Entry) -> None:
        """Note it."""
        self.audited.put((caller, entry))

    def now(self) -> tuple[int, int]:
        """Return a time."""
        return 12, 34

    def topics(self) -> dict[str, str]:
        """Return one topic."""
        return {"/clock": "rosgraph_msgs/Clock"}

    def services(self) -> list[str]:
        """Return none."""
        return []

    def service_type(self, service: str) -> str:
        """Know none."""
        return ""


class Cell:
    """A running gateway, its graph, its log and its clients."""

    def __init__(self, config: GatewayConfig) -> None:
        self.graph = Graph()
        self.log: list[str] = []
        self.server = GatewayServer(config, self.graph, "/cell", TOKENS, self.log.append)
        self._clients: list[websocket.WebSocket] = []

    def client(self, path: str = "", **options: Any) -> Client:
        """Connect."""
        url = f"ws://127.0.0.1:{self.server.port}/{path}"
        line = websocket.create_connection(url, timeout=DEADLINE, **options)
        self._clients.append(line)
        return Client(line)

    def close(self) -> None:
        """End clients and gateway."""
        for line in self._clients:
            line.close(timeout=0.1)
        self.server.stop()


class Client:
    """A rosbridge client."""

    def __init__(self, line: websocket.WebSocket) -> None:
        self.line = line

    def say(self, **packet: Any) -> None:
        """Send a packet."""
        self.line.send(json.dumps(packet))

    def hear(self) -> dict[str, Any]:
        """Return the next packet."""
        packet: dict[str, Any] = json.loads(self.line.recv())
        return packet

    def ask(self, **packet: Any) -> dict[str, Any]:
        """Send a packet and return the next that comes."""
        self.say(**packet)
        return self.hear()

    def time(self) -> dict[str, Any]:
        """Ask for the time: proves that the session lives and that all before has been performed."""
        return self.ask(op="call_service", id="time", service="/rosapi/get_time")


MakeCell = Callable[..., Cell]


@pytest.fixture
def make_cell() -> Iterator[MakeCell]:
    """Start gateways with changed settings."""
    cells: list[Cell] = []

    def make(limits: dict[str, Any] | None = None, **changes: Any) -> Cell:
        config = msgspec.structs.replace(SHIPPED, **{**PATIENT, **changes})
        config = msgspec.structs.replace(config, limits=msgspec.structs.replace(config.limits, **(limits or {})))
        cells.append(Cell(config))
        cells[-1].server.start()
        return cells[-1]

    yield make
    for cell in cells:
        cell.close()


@pytest.fixture
def cell(make_cell: MakeCell) -> Cell:
    """Return a running gateway."""
    return make_cell()


def wait_until(condition: Callable[[], bool]) -> None:
    """Wait for a condition, with a deadline."""
    deadline = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        threading.Event().wait(0.005)


def test_time_is_answered_at_once(cell: Cell) -> None:
    """The clock probe takes no way through the ROS graph."""
    answer = cell.client().ask(op="call_service", id="1", service="/rosapi/get_time")
    assert answer == {
        "op": "service_response",
        "id": "1",
        "service": "/rosapi/get_time",
        "result": True,
        "values": {"time": {"secs": 12, "nsecs": 34}},
    }


def test_other_rosapi_services_answer_or_say_that_they_are_not_offered(cell: Cell) -> None:
    """What is missing is said, not left unanswered."""
    client = cell.client()
    answer = client.ask(op="call_service", service="rosapi/topic_type", args={"topic": "/clock"})
    assert answer["values"] == {"type": "rosgraph_msgs/Clock"}
    answer = client.ask(op="call_service", service="/rosapi/get_param", args={})
    assert (answer["result"], answer["values"]) == (False, "/rosapi/get_param is not offered by this gateway")


def test_message_goes_to_each_subscriber_under_the_name_it_used(cell: Cell) -> None:
    """One delivery, several clients, relative and absolute names."""
    relative, absolute, other = cell.client(), cell.client(), cell.client()
    for client, topic in ((relative, "t"), (absolute, "/cell/t"), (other, "u")):
        client.say(op="subscribe", topic=topic, type="std_msgs/String")
        client.time()
    cell.server.deliver("/cell/t", b'{"data":"x"}')
    assert relative.hear() == {"op": "publish", "topic": "t", "msg": {"data": "x"}}
    assert absolute.hear() == {"op": "publish", "topic": "/cell/t", "msg": {"data": "x"}}
    assert other.time()["op"] == "service_response"


def test_publish_reaches_the_graph_in_order(cell: Cell) -> None:
    """An unadvertised topic is advertised first, with the type that the graph knows."""
    client = cell.client()
    for number in range(3):
        client.say(op="publish", topic="t", msg={"data": number})
    assert cell.graph.done.get(timeout=DEADLINE) == ("advertise", 1, "/cell/t", None, False, 100)
    for number in range(3):
        assert cell.graph.done.get(timeout=DEADLINE) == ("publish", 1, "/cell/t", {"data": number})


def test_options_of_advertise_reach_the_graph(cell: Cell) -> None:
    """Latch and queue_size are the client's to choose."""
    cell.client().say(op="advertise", topic="t", type="std_msgs/String", latch=True, queue_size=5)
    assert cell.graph.done.get(timeout=DEADLINE) == ("advertise", 1, "/cell/t", "std_msgs/String", True, 5)


def test_what_the_graph_refuses_is_answered(cell: Cell) -> None:
    """The reason comes as a status with the packet's id."""
    client = cell.client()
    answer = client.ask(op="publish", id="p", topic="t", msg={"data": "refuse"})
    assert answer == {"op": "status", "id": "p", "level": "error", "msg": "data = 'refuse': allowed: anything else"}
    answer = client.ask(op="subscribe", id="s", topic="unknown")
    assert answer["msg"] == "the type of /cell/unknown is not known"
    assert client.ask(op="unsubscribe", id="u", topic="unknown")["msg"] == "/cell/unknown is not subscribed"


def test_error_in_the_gateway_is_answered_counted_and_logged(cell: Cell) -> None:
    """A bug costs one packet, not the client, and is not hidden."""
    client = cell.client()
    assert "error in the gateway: KeyError('a bug')" in client.ask(op="publish", topic="t", msg={"data": "break"})["msg"]
    assert client.time()["result"]
    assert cell.server.statistics().errors == 1 and any("a bug" in line for line in cell.log)


@pytest.mark.parametrize(
    "data", ["{", "\x00", "[" * 100 + "]" * 100, '{"op":"dance"}', '{"op":"publish","topic":5}', "x" * 2_000_000]
)
def test_bad_packet_is_answered_and_the_session_lives_on(cell: Cell, data: str) -> None:
    """Bad JSON, wrong types, too deep, too long."""
    client = cell.client()
    client.line.send(data)
    answer = client.hear()
    assert (answer["op"], answer["level"]) == ("status", "error")
    assert client.time()["result"]
    assert cell.server.statistics().refused == 1


def test_binary_frame_with_json_is_understood(cell: Cell) -> None:
    """Some clients send text as binary; broken UTF-8 is a bad packet."""
    client = cell.client()
    client.line.send_binary(b'{"op":"call_service","service":"/rosapi/get_time"}')
    assert client.hear()["result"]
    client.line.send_binary(b'{"op":"status","level":"info","msg":"\xff"}')
    assert client.hear()["level"] == "error"


def test_running_call_holds_up_nobody(cell: Cell) -> None:
    """A move_to of seconds: its caller and all others are served meanwhile."""
    mover, other = cell.client(), cell.client()
    mover.say(op="call_service", id="m", service="move_to", args={"x": 0.5}, timeout=7)
    call = cell.graph.calls.get(timeout=DEADLINE)
    assert (call.args, call.timeout) == ({"x": 0.5}, 7.0)
    assert mover.time()["result"] and other.time()["result"]
    call.end.put({"success": True})
    assert mover.hear() == {
        "op": "service_response",
        "id": "m",
        "service": "move_to",
        "result": True,
        "values": {"success": True},
    }


def test_call_is_made_in_the_name_of_role_and_address(cell: Cell) -> None:
    """Who is called can tell one client from another, in an audit too."""
    client = cell.client("?token=drive")
    client.say(op="call_service", service="s")
    call = cell.graph.calls.get(timeout=DEADLINE)
    address, port = client.line.sock.getsockname()
    assert call.caller == f"operator@{address}:{port}"


def test_what_a_client_does_is_audited_once_with_role_and_address(cell: Cell) -> None:
    """A hundred messages of a topic are one entry; hearing and rosapi are none; a call is told with its answer."""
    client = cell.client("?token=drive")
    client.say(op="subscribe", topic="t", type="T")
    for _ in range(100):
        client.say(op="publish", topic="motion_command", msg={"command": 3})
    client.time()
    client.say(op="call_service", service="move_to", args={"x": 1})
    cell.graph.calls.get(timeout=DEADLINE).end.put({"success": False})
    client.hear()
    address, port = client.line.sock.getsockname()
    assert [cell.graph.audited.get(timeout=DEADLINE) for _ in range(2)] == [
        (f"operator@{address}:{port}", Entry('publish /cell/motion_command {"command":3}', True, "done")),
        (f"operator@{address}:{port}", Entry('call_service /cell/move_to {"x":1}', True, '{"success":false}')),
    ]
    client.time()
    assert cell.graph.audited.empty()


@pytest.mark.parametrize(
    ("token", "packet", "entry"),
    [
        (
            "look",
            {"op": "publish", "topic": "motion_command", "msg": {}},
            Entry("publish motion_command {}", False, "role viewer may not publish /cell/motion_command"),
        ),
        (
            "look",
            {"op": "call_service", "service": "move_to", "args": {"x": 1}},
            Entry('call_service move_to {"x":1}', False, "role viewer may not call_service /cell/move_to"),
        ),
        (
            "drive",
            {"op": "publish", "topic": "t", "msg": {"data": "refuse"}},
            Entry('publish t {"data":"refuse"}', False, "data = 'refuse': allowed: anything else"),
        ),
    ],
)
def test_what_is_refused_is_audited_once(cell: Cell, token: str, packet: dict[str, Any], entry: Entry) -> None:
    """By role or by the graph; who tries it again and again is one entry."""
    client = cell.client(f"?token={token}")
    for _ in range(3):
        client.ask(**packet)
    caller, told = cell.graph.audited.get(timeout=DEADLINE)
    assert (caller.split("@")[0], told) == ({"look": "viewer", "drive": "operator"}[token], entry)
    client.time()
    assert cell.graph.audited.empty()


def test_client_that_is_turned_away_is_audited(cell: Cell) -> None:
    """The token is not repeated."""
    for _ in range(2):
        with pytest.raises(websocket.WebSocketBadStatusException):
            cell.client("?token=guess")
    caller, entry = cell.graph.audited.get(timeout=DEADLINE)
    assert caller.startswith("nobody@127.0.0.1:") and entry == Entry("connect from 127.0.0.1", False, "unknown token")
    assert cell.graph.audited.empty()


@pytest.mark.parametrize(
    ("outcome", "text"),
    [(GraphError("service /cell/s does not exist"), "service /cell/s does not exist"), (KeyError("bug"), "KeyError('bug')")],
)
def test_failed_call_is_answered_with_its_reason(cell: Cell, outcome: Exception, text: str) -> None:
    """The answer has result false and the reason as values."""
    client = cell.client()
    client.say(op="call_service", id="c", service="s")
    cell.graph.calls.get(timeout=DEADLINE).end.put(outcome)
    answer = client.hear()
    assert (answer["id"], answer["result"]) == ("c", False) and text in answer["values"]


@pytest.mark.parametrize(("asked", "given"), [(None, 60.0), (0, 60.0), (5.0, 5.0), (10_000, 600.0)])
def test_time_out_of_a_call_is_bounded(cell: Cell, asked: float | None, given: float) -> None:
    """The caller may choose within service_timeout_max."""
    cell.client().say(op="call_service", service="s", timeout=asked)
    assert cell.graph.calls.get(timeout=DEADLINE).timeout == given


def test_calls_are_limited_per_client_and_together(make_cell: MakeCell) -> None:
    """More is refused at once, with the numbers; a finished call makes room."""
    cell = make_cell(limits={"calls_per_client": 2, "calls": 3})
    first, second = cell.client(), cell.client()
    first.say(op="call_service", service="s")
    first.say(op="call_service", service="s")
    answer = first.ask(op="call_service", service="s")
    assert not answer["result"] and answer["values"].startswith("2 of 2 calls of this client and 2 of 3 calls of all run")
    second.say(op="call_service", service="s")
    assert "3 of 3 calls of all" in second.ask(op="call_service", service="s")["values"]
    calls = [cell.graph.calls.get(timeout=DEADLINE) for _ in range(3)]
    calls[0].end.put({})
    assert first.hear()["result"]
    wait_until(lambda: cell.server.statistics().calls == 2)
    first.say(op="call_service", id="again", service="s")
    cell.graph.calls.get(timeout=DEADLINE).end.put({})
    assert first.hear()["id"] == "again"


def ask_client(cell: Cell, args: dict[str, Any]) -> Future[dict[str, Any]]:
    """Ask as a ROS node would that calls the client's service."""
    return cell.graph.asks["/cell/s"](args)


def test_client_answers_a_service_that_it_advertised(cell: Cell) -> None:
    """call_service goes to the client, service_response back; without an id the oldest question is meant."""
    client = cell.client()
    client.say(op="advertise_service", service="s", type="std_srvs/SetBool")
    client.time()
    for with_id in (True, False):
        future = ask_client(cell, {"data": True})
        question = client.hear()
        assert question["op"] == "call_service" and question["service"] == "s" and question["args"] == {"data": True}
        identity = {"id": question["id"]} if with_id else {}
        client.say(op="service_response", service="s", result=True, values={"success": True}, **identity)
        assert future.result(DEADLINE) == {"success": True}


def test_failure_of_a_client_service_is_handed_on(cell: Cell) -> None:
    """Its reason reaches the ROS caller."""
    client = cell.client()
    client.say(op="advertise_service", service="s", type="std_srvs/SetBool")
    client.time()
    future = ask_client(cell, {})
    client.say(op="service_response", id=client.hear()["id"], service="s", result=False, values="no mood")
    with pytest.raises(GraphError, match="s failed: 'no mood'"):
        future.result(DEADLINE)


def test_response_that_nobody_waits_for_is_refused(cell: Cell) -> None:
    """Counted and said."""
    answer = cell.client().ask(op="service_response", id="x", service="s", result=True, values={})
    assert answer["msg"] == "no call of s waits for a response with id 'x'"


def test_question_to_a_client_that_goes_fails(cell: Cell) -> None:
    """A ROS caller does not wait for a client that has gone."""
    client = cell.client()
    client.say(op="advertise_service", service="s", type="std_srvs/SetBool")
    client.time()
    future = ask_client(cell, {})
    client.hear()
    client.line.close()
    with pytest.raises(GraphError, match="the client that answers s has gone"):
        future.result(DEADLINE)
    with pytest.raises(GraphError, match="the client that answers s has gone"):
        ask_client(cell, {}).result(DEADLINE)


def test_client_that_goes_leaves_nothing_in_the_graph(cell: Cell) -> None:
    """Subscriptions, publishers, services and running calls end with it."""
    client = cell.client()
    client.say(op="subscribe", topic="a", type="T")
    client.say(op="advertise", topic="b", type="T")
    client.say(op="advertise_service", service="s", type="T")
    client.say(op="call_service", service="slow")
    call = cell.graph.calls.get(timeout=DEADLINE)
    client.line.close()
    assert call.cancelled.wait(DEADLINE)
    done = [cell.graph.done.get(timeout=DEADLINE) for _ in range(6)]
    assert set(done[3:]) == {("unsubscribe", 1, "/cell/a"), ("unadvertise", 1, "/cell/b"), ("unadvertise_service", 1, "/cell/s")}
    wait_until(lambda: cell.server.statistics().clients == 0)
    assert cell.server.listeners == {}


def resident_bytes() -> int:
    """Return this process's memory."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * 4096


def test_stalled_reader_costs_bounded_memory_and_disturbs_nobody(make_cell: MakeCell) -> None:
    """200 MB for a client that reads nothing: memory stays, the other client misses nothing, the stalled one is dropped."""
    cell = make_cell(stall_timeout=0.5)
    stalled = cell.client(sockopt=[(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)])
    reader = cell.client()
    for client in (stalled, reader):
        client.say(op="subscribe", topic="big", type="T")
        client.time()
    reader.say(op="subscribe", topic="small", type="T", queue_length=1000)
    reader.time()
    before = resident_bytes()
    for number in range(2000):
        cell.server.deliver("/cell/big", b'{"data":"' + b"x" * 100_000 + b'"}', 1)
        cell.server.deliver("/cell/small", b'{"data":%d}' % number)
        assert reader.hear()["msg"] == {"data": number}
    assert resident_bytes() - before < 30_000_000
    wait_until(lambda: any("left: took nothing for 0.5 s" in line for line in cell.log))
    assert cell.server.statistics().dropped > 1900
    assert reader.time()["result"]


def test_client_that_takes_no_answers_is_dropped(make_cell: MakeCell) -> None:
    """Answers wait in a bounded queue; only a client that reads nothing can fill it."""
    cell = make_cell(limits={"waiting_answers": 100, "packets_per_second": 10**6, "packets_burst": 10**6}, stall_timeout=60.0)
    client = cell.client(sockopt=[(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)])
    with pytest.raises((OSError, websocket.WebSocketException)):
        for _ in range(20_000):
            client.say(op="dance", id="x" * 1000)
    wait_until(lambda: any("left: 100 answers wait and are not taken" in line for line in cell.log))


def test_silent_client_is_found(make_cell: MakeCell) -> None:
    """A client that answers no ping is dropped after ping_interval + ping_timeout."""
    cell = make_cell(ping_interval=0.1, ping_timeout=0.1)
    cell.client()
    wait_until(lambda: any("left: no answer to a ping within 0.1 s" in line for line in cell.log))


def test_client_that_only_sends_is_not_silent(make_cell: MakeCell) -> None:
    """A script that publishes and never reads leaves pings unanswered, but it is alive."""
    cell = make_cell(ping_interval=0.2, ping_timeout=0.4)
    client = cell.client()
    end = time.monotonic() + 1.5
    while time.monotonic() < end:
        client.say(op="publish", topic="t", msg={})
        threading.Event().wait(0.01)
    assert cell.server.statistics().clients == 1


@pytest.mark.parametrize(
    ("path", "header", "role"),
    [
        ("", [], "operator"),
        ("?token=look", [], "viewer"),
        ("?token=drive", [], "operator"),
        ("", ["Authorization: Bearer look"], "viewer"),
        ("?token=drive", ["Authorization: Bearer look"], "viewer"),
    ],
)
def test_token_decides_the_role(cell: Cell, path: str, header: list[str], role: str) -> None:
    """Header before query; without a token the role of local clients."""
    client = cell.client(path, header=header)
    answer = client.ask(op="call_service", id="1", service="move_to") if role == "viewer" else client.time()
    assert answer["result"] == (role == "operator")
    assert any(line.endswith(f"came as {role}") for line in cell.log)


@pytest.mark.parametrize(
    ("path", "loopback_role", "reason"), [("?token=guess", "operator", "unknown token"), ("", "", "a token is needed")]
)
def test_client_without_a_right_to_come_is_turned_away(make_cell: MakeCell, path: str, loopback_role: str, reason: str) -> None:
    """HTTP 401 with the reason, before any packet."""
    cell = make_cell(loopback_role=loopback_role)
    with pytest.raises(websocket.WebSocketBadStatusException, match="401") as caught:
        cell.client(path)
    assert caught.value.resp_body == f"{reason}\n".encode()
    assert cell.server.statistics().turned_away == 1


def test_foreign_web_page_is_turned_away(cell: Cell) -> None:
    """A page of another origin in the operator's browser must not drive the robot."""
    with pytest.raises(websocket.WebSocketBadStatusException, match="403"):
        cell.client(origin="http://example.org")
    assert cell.client(origin="http://localhost:8080").time()["result"]
    assert cell.client(suppress_origin=True).time()["result"]


def test_too_many_clients_are_turned_away(make_cell: MakeCell) -> None:
    """HTTP 503 with the number; one that leaves makes room."""
    cell = make_cell(limits={"clients": 1})
    first = cell.client()
    with pytest.raises(websocket.WebSocketBadStatusException, match="503"):
        cell.client()
    first.line.close()
    wait_until(lambda: cell.server.statistics().clients == 0)
    assert cell.client().time()["result"]


def test_taken_port_is_said_with_what_to_do(cell: Cell) -> None:
    """The node ends with this text."""
    config = msgspec.structs.replace(SHIPPED, port=cell.server.port)
    with pytest.raises(
        GatewayError, match=f"port 127.0.0.1:{cell.server.port} cannot be opened: Address already in use; end the program"
    ):
        GatewayServer(config, Graph(), "/", {}, print)


def test_missing_tls_file_is_said(tmp_path: Path) -> None:
    """The node ends with this text."""
    missing = str(tmp_path / "missing.pem")
    config = msgspec.structs.replace(SHIPPED, port=0, tls_certificate=missing, tls_key=missing)
    with pytest.raises(GatewayError, match=r"TLS files .*missing.pem.*No such file"):
        GatewayServer(config, Graph(), "/", {}, print)


def test_tls_files_make_the_door_secure(make_cell: MakeCell, tmp_path: Path) -> None:
    """With them only wss:// is understood."""
    certificate, key = write_certificate(tmp_path)
    cell = make_cell(tls_certificate=certificate, tls_key=key)
    url = f"wss://127.0.0.1:{cell.server.port}/"
    client = Client(websocket.create_connection(url, timeout=DEADLINE, sslopt={"ca_certs": certificate}))
    assert client.time()["result"]
    client.line.close()
    with pytest.raises((OSError, websocket.WebSocketException)):
        cell.client()


def test_end_sends_close_frames_and_leaves_no_thread(make_cell: MakeCell) -> None:
    """Clients hear a proper goodbye, a running call does not keep the gateway."""
    before = set(threading.enumerate())
    cell = make_cell()
    client = cell.client()
    client.say(op="call_service", service="slow")
    cell.graph.calls.get(timeout=DEADLINE)
    stopping = threading.Thread(target=cell.server.stop)
    stopping.start()
    opcode, data = client.line.recv_data()
    assert opcode == websocket.ABNF.OPCODE_CLOSE and data == b"\x03\xe9the gateway ends"
    stopping.join(DEADLINE)
    assert set(threading.enumerate()) <= before
