"""What one connection may take of the gateway, and when its packets came."""

from __future__ import annotations

import base64
import contextlib
import io
import json
import time

import pytest
import websocket
from harness.opponents.graph_and_clients import DEADLINE, Cell, MakeCell
from harness.opponents.hostile_pages import knock
from harness.processes import wait_until
from harness.wires.gateway_client import RosbridgeClient
from PIL import Image, PngImagePlugin
from rosbridge_gateway.wire.png_io import pack

PAGE = "http://localhost:8080"
HANDSHAKE_S = 3.0
RUBBISH = b'{"op":"publish","topic":"t","msg":{"data":[' + b"[]," * 5000 + b"1]}}"


def page(cell: Cell) -> RosbridgeClient:
    """Return a page that only looks."""
    return cell.client(origin=PAGE)


def test_page_that_takes_too_much_waits_and_loses_nothing(make_cell: MakeCell) -> None:
    """Each of its packets is answered, later; it is told why once a second."""
    cell = make_cell(page_takes={"packets_per_second": 20})
    greedy = page(cell)
    begun = time.monotonic()
    for number in range(30):
        greedy.say(op="call_service", id=str(number), service="/rosapi/get_time")
    heard = [greedy.hear() for _ in range(30)]
    answers = [packet["id"] for packet in heard if packet["op"] == "service_response"]
    while len(answers) < 30:
        packet = greedy.hear()
        heard.append(packet)
        answers += [packet["id"]] if packet["op"] == "service_response" else []
    assert answers == [str(number) for number in range(30)]
    assert time.monotonic() - begun > (30 - 20 * 0.25) / 20 - 0.1, "a quarter second is free"
    greedy.line.close()
    cell.wait_logged("held back 2")


def test_long_wait_is_told_with_what_to_do(make_cell: MakeCell) -> None:
    """The remark names the key of the file."""
    cell = make_cell(page_takes={"packets_per_second": 1})
    greedy = page(cell)
    greedy.say(op="call_service", service="/rosapi/get_time")
    heard = [greedy.hear(), greedy.hear()]
    (remark,) = [packet["msg"] for packet in heard if packet["op"] == "status"]
    assert remark.startswith("your packets are read ") and "roles.viewer.takes" in remark


def test_processor_time_counts_before_the_next_packet_is_decoded(make_cell: MakeCell) -> None:
    """Packets that are slow to read wait for each other, others do not wait for them."""
    cell = make_cell(page_takes={"cpu_percent": 0.1})
    greedy, other = page(cell), cell.client()
    for _ in range(50):
        greedy.line.send(RUBBISH)
    wait_until(lambda: cell.server.statistics().received >= 1, DEADLINE)
    for _ in range(20):
        assert other.time()["result"]
    received = cell.server.statistics().received - 20
    assert received < 20, "50 packets of 1 ms are 50 s of a thousandth of a core"


def test_pings_without_end_are_paid_for(make_cell: MakeCell) -> None:
    """They never come to the client's own loop: they are charged where they are read."""
    cell = make_cell(page_takes={"cpu_percent": 0.5})
    greedy, other = page(cell), cell.client()
    greedy.line.sock.setblocking(False)
    ping = websocket.ABNF.create_frame("", websocket.ABNF.OPCODE_PING).format() * 1000
    sent, until = 0, time.monotonic() + 1.0
    while time.monotonic() < until:
        try:
            sent += greedy.line.sock.send(ping)
        except BlockingIOError:
            assert other.time()["result"]
        if sent > 20_000_000:
            pytest.fail("20 MB of pings were read in a second")
    assert other.time()["result"]


def test_time_of_threads_that_help_a_call_is_charged(
    cell: Cell, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A page that asks for all services of a type makes as many threads ask."""
    monkeypatch.setattr(cell.graph, "helped", lambda: 1000.0)
    greedy = page(cell)
    assert greedy.ask(op="call_service", service="/rosapi/nodes")["result"]
    (client,) = cell.server._clients.values()
    wait_until(lambda: client._connection.wait() > 1000.0, DEADLINE, "the debt of a page")


def waits_at_the_door(cell: Cell, origin: str) -> bool:
    """Return whether a page of an origin that knocks waits for half a handshake."""
    begun = time.monotonic()
    with contextlib.suppress(OSError):  # turned away, or not heard after 2 s
        knock(cell.server.port, origin).close()
    return time.monotonic() - begun >= 0.5 * HANDSHAKE_S


def test_who_comes_and_goes_without_end_pays_for_it(make_cell: MakeCell) -> None:
    """Both are charged to all that come as that role, who wait; another role comes in at once."""
    cell = make_cell(handshake_timeout=HANDSHAKE_S)
    coming = cell.server._coming["viewer"]
    coming.rate, free = 1e-9, coming.level
    visitor = page(cell)
    wait_until(lambda: cell.server.statistics().clients == 1, DEADLINE)
    came = coming.level
    assert came < free
    visitor.line.close()
    wait_until(lambda: coming.level < came, DEADLINE)
    coming.level = -1.0
    assert waits_at_the_door(cell, PAGE)
    assert cell.client().time()["result"]


def test_however_many_come_and_go_who_is_in_is_heard_at_once(make_cell: MakeCell) -> None:
    """A viewer's packet may be a STOP: it does not pay for those at the door."""
    cell = make_cell(handshake_timeout=HANDSHAKE_S)
    inside = page(cell)
    cell.server._coming["viewer"].spend(100.0, time.monotonic())
    assert waits_at_the_door(cell, PAGE)
    begun = time.monotonic()
    assert inside.time()["result"] and time.monotonic() - begun < 0.5 * HANDSHAKE_S


def test_who_is_turned_away_without_end_pays_for_it(
    make_cell: MakeCell, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Whoever may come in does not wait for that."""
    monkeypatch.setattr("rosbridge_gateway.connection.server_io._REFUSING", 1e-5)
    cell = make_cell(handshake_timeout=HANDSHAKE_S)
    assert waits_at_the_door(cell, "null")
    assert cell.server.statistics().turned_away == 1
    assert not waits_at_the_door(cell, PAGE) and cell.client().time()["result"]


def test_packet_of_a_page_is_short(cell: Cell) -> None:
    """A longer one is refused, a much longer one ends the connection before it is read."""
    longer = page(cell)
    longer.say(op="subscribe", topic="t" * 20_000)
    assert "longer than the allowed 16384" in longer.hear()["msg"]
    assert cell.client().ask(op="subscribe", topic="t" * 20_000)["msg"].endswith("legal ROS name")
    huge = page(cell)
    huge.say(op="publish", topic="t", msg={"data": "x" * 1_000_000})
    cell.wait_logged("left: code 1009 frame with 1000")


def test_pages_have_threads_of_their_own_for_calls(make_cell: MakeCell) -> None:
    """However many calls hang for pages, a program's call runs."""
    cell = make_cell(limits={"calls": 1, "page_calls": 1}, takes={"calls": 2})
    first, program = page(cell), cell.client()
    for _ in range(3):
        first.say(op="call_service", service="forward_kinematics")
    assert "2 of 2 calls of this client" in first.hear()["values"]
    program.say(op="call_service", service="move_to")
    hanging = cell.graph.calls.get(timeout=DEADLINE)
    for _ in range(2):
        call = cell.graph.calls.get(timeout=DEADLINE)
        call.end.put({"success": True})
    assert program.hear()["result"]
    hanging.end.put({})


def with_text(packet: dict[str, object]) -> str:
    """Return a packet as an image with a megabyte of text beside the picture."""
    image = Image.open(io.BytesIO(base64.b64decode(pack(json.dumps(packet).encode()))))
    text = PngImagePlugin.PngInfo()
    for number in range(4):
        text.add_text(f"note{number}", "x" * 250_000, zip=True)
    buffer = io.BytesIO()
    image.save(buffer, "png", pnginfo=text)
    return base64.b64encode(buffer.getvalue()).decode()


def test_image_with_more_than_its_picture_is_refused(cell: Cell) -> None:
    """Texts and profiles unpack to any size, whatever the picture's size is."""
    client = cell.client()
    packet = {"op": "call_service", "id": "c", "service": "/rosapi/get_time"}
    assert client.ask(op="png", data=pack(json.dumps(packet).encode()))["result"]
    answer = client.ask(op="png", id="p", data=with_text(packet))
    assert answer["id"] == "p" and answer["msg"].startswith("an image with a chunk 'zTXt': allowed")
