"""Topics and packets: what reaches the graph, what the clients, and what is refused."""

from __future__ import annotations

import json

import pytest
from harness.opponents.graph_and_clients import DEADLINE, TWIN_CONTROLLER, Cell, JsonMessage
from rosbridge_gateway.graph.graph_io import GraphError
from rosbridge_gateway.wire.outgoing import Form, Frames
from websocket import ABNF


def test_message_goes_to_each_subscriber_under_the_name_it_used(cell: Cell) -> None:
    """One delivery, several clients, relative and absolute names."""
    relative, absolute, other = cell.client(), cell.client(), cell.client()
    for client, topic in ((relative, "t"), (absolute, "/cell/t"), (other, "u")):
        client.say(op="subscribe", topic=topic, type="std_msgs/String")
        client.time()
    cell.deliver("/cell/t", b'{"data":"x"}')
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
    assert cell.graph.done.get(timeout=DEADLINE) == (
        "advertise",
        1,
        "/cell/t",
        "std_msgs/String",
        True,
        5,
    )


def test_what_the_graph_refuses_is_answered(cell: Cell) -> None:
    """The reason comes as a status with the packet's id."""
    client = cell.client()
    answer = client.ask(op="publish", id="p", topic="t", msg={"data": "refuse"})
    assert answer == {
        "op": "status",
        "id": "p",
        "level": "error",
        "msg": "data = 'refuse': allowed: anything else",
    }
    answer = client.ask(op="subscribe", id="s", topic="unknown")
    assert answer["msg"] == "the type of /cell/unknown is not known"
    assert (
        client.ask(op="unsubscribe", id="u", topic="unknown")["msg"]
        == "/cell/unknown is not subscribed"
    )


def test_error_in_the_gateway_is_answered_counted_and_logged(cell: Cell) -> None:
    """A bug costs one packet, not the client, and is not hidden."""
    client = cell.client()
    assert (
        "error in the gateway: KeyError('a bug')"
        in client.ask(op="publish", topic="t", msg={"data": "break"})["msg"]
    )
    assert client.time()["result"]
    assert cell.server.statistics().errors == 1 and any("a bug" in line for line in cell.log)


@pytest.mark.parametrize(
    "data",
    [
        '{"op":"dance"}',
        "x" * 2_000_000,
    ],
)
def test_bad_packet_is_answered_and_the_session_lives_on(cell: Cell, data: str) -> None:
    """One that is none, and one that is too long to be read; all others are in test_packets.py."""
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


def test_form_that_a_client_wants_reaches_the_graph(cell: Cell) -> None:
    """Of several ids together; what the last one wanted goes with it."""
    client = cell.client()
    client.say(op="subscribe", id="a", topic="t", type="T", compression="cbor")
    client.say(op="subscribe", id="b", topic="t", type="T", fragment_size=100)
    client.time()
    assert cell.graph.forms[1, "/cell/t"] == Form("t", "cbor", 100)
    client.say(op="unsubscribe", id="a", topic="t")
    client.time()
    assert cell.graph.forms[1, "/cell/t"] == Form("t", "none", 100)
    cell.deliver("/cell/t", b'{"data":"x"}')
    assert client.hear()["msg"] == {"data": "x"}


def test_each_subscription_of_a_client_is_one_to_the_graph(
    cell: Cell, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It gets the latched message, under the name that it used; the end of another gives none."""

    def deliver(owner: int, topic: str, *_: object) -> None:
        cell.server.deliver(topic, JsonMessage(b'{"data":"kept"}'), owner)

    monkeypatch.setattr(cell.graph, "subscribe", deliver)
    client = cell.client()
    for name in ("t", "/cell/t"):
        packet = client.ask(op="subscribe", id=name, topic=name, type="T")
        assert (packet["topic"], packet["msg"]) == (name, {"data": "kept"})
    client.say(op="unsubscribe", id="t", topic="t")
    assert client.time()["op"] == "service_response"


def test_refused_subscription_leaves_the_others_as_they_were(
    cell: Cell, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their form, too."""

    def refuse(*_: object) -> None:
        raise GraphError("roscore does not answer")

    client = cell.client()
    client.say(op="subscribe", id="a", topic="t", type="T")
    client.time()
    monkeypatch.setattr(cell.graph, "subscribe", refuse)
    answer = client.ask(op="subscribe", id="b", topic="/cell/t", type="T")
    assert answer["msg"] == "roscore does not answer"
    cell.deliver("/cell/t", b'{"data":"x"}')
    assert client.hear() == {"op": "publish", "topic": "t", "msg": {"data": "x"}}


def test_shorter_throttle_rate_frees_what_waits(cell: Cell) -> None:
    """Of one id it is enough; the old interval does not count to its end."""
    client = cell.client()
    client.say(op="subscribe", id="a", topic="t", type="T", throttle_rate=3_600_000)
    client.time()
    for number in (1, 2):
        cell.deliver("/cell/t", b'{"data":%d}' % number)
    assert client.hear()["msg"] == {"data": 1}
    client.say(op="subscribe", id="b", topic="t", type="T")
    assert client.hear()["msg"] == {"data": 2}


def test_binary_packets_are_binary_frames(cell: Cell) -> None:
    """A client tells CBOR from JSON by the frame."""

    class Both:
        def frames(self, form: Form) -> Frames:
            return Frames((b"\xa0", b"\xa1"), is_text=form.compression == "none")

    client = cell.client()
    client.say(op="subscribe", topic="t", type="T", compression="cbor")
    client.time()
    cell.server.deliver("/cell/t", Both())
    received = [client.line.recv_data() for _ in range(2)]
    assert received == [(ABNF.OPCODE_BINARY, b"\xa0"), (ABNF.OPCODE_BINARY, b"\xa1")]


def test_long_answer_comes_in_pieces_if_the_call_asks_for_it(cell: Cell) -> None:
    """Put together they are the answer."""
    client = cell.client()
    client.say(op="call_service", id="c", service="/s", fragment_size=64)
    cell.graph.calls.get(timeout=DEADLINE).end.put({"text": "\u00e4" * 300})
    pieces = [client.hear()]
    while len(pieces) < pieces[0]["total"]:
        pieces.append(client.hear())
    assert {(piece["op"], len(piece["data"]) <= 64) for piece in pieces} == {("fragment", True)}
    answer = json.loads("".join(piece["data"] for piece in pieces))
    assert answer["id"] == "c" and answer["values"] == {"text": "\u00e4" * 300}


def test_remark_on_what_was_published_reaches_who_cannot_see_it_himself(cell: Cell) -> None:
    """The audit tells it too; the twin controller sends again by itself what is not obeyed."""
    client = cell.client()
    packet = {"op": "publish", "id": "p", "topic": "t", "msg": {"data": "too early"}}
    told = {"op": "status", "id": "p", "level": "error", "msg": "nobody was connected yet"}
    assert client.ask(**packet) == told
    entry = cell.graph.audited.get(timeout=DEADLINE)[1]
    assert (entry.success, entry.outcome) == (True, "nobody was connected yet")
    controller = cell.client(header=[f"Authorization: Bearer {TWIN_CONTROLLER}"])
    controller.say(**packet)
    assert controller.time()["op"] == "service_response"
    assert cell.server.statistics().refused == 0
