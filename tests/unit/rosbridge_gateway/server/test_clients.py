"""Clients that stall, fall silent or go, and the end of the gateway."""

from __future__ import annotations

import asyncio
import select
import socket
import threading
import time
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
import websocket
from harness.opponents.graph_and_clients import DEADLINE, SHIPPED, TWIN_CONTROLLER, Cell, MakeCell
from harness.processes import wait_until
from rosbridge_gateway.config import Driving
from rosbridge_gateway.connection.sending_io import Sending
from rosbridge_gateway.protocol.session import Session


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
    assert set(done[3:]) == {
        ("unsubscribe", 1, "/cell/a"),
        ("unadvertise", 1, "/cell/b"),
        ("unadvertise_service", 1, "/cell/s"),
    }
    wait_until(lambda: cell.server.statistics().clients == 0, DEADLINE)
    assert cell.server.listeners == {}


def test_error_that_ends_a_client_is_in_the_log(
    cell: Cell, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The diagnostics say how many there were, and to look there."""

    def fail(*_: object) -> None:
        raise KeyError("a bug")

    client = cell.client()
    monkeypatch.setattr(Session, "read", fail)
    client.say(op="advertise", topic="a", type="T")
    cell.wait_logged("a bug")
    assert cell.server.statistics().errors == 1


def resident_bytes() -> int:
    """Return this process's memory."""
    return int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1]) * 4096


def test_stalled_reader_costs_bounded_memory_and_disturbs_nobody(make_cell: MakeCell) -> None:
    """200 MB for a client that reads nothing: memory stays, the other client misses nothing."""
    cell = make_cell(stall_timeout=60.0)
    stalled = cell.client(sockopt=[(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)])
    reader = cell.client()
    for client in (stalled, reader):
        client.say(op="subscribe", topic="big", type="T")
        client.time()
    reader.say(op="subscribe", topic="small", type="T", queue_length=1000)
    reader.time()
    before = resident_bytes()
    for number in range(2000):
        cell.deliver("/cell/big", b'{"data":"' + b"x" * 100_000 + b'"}', 1)
        cell.deliver("/cell/small", b'{"data":%d}' % number)
        assert reader.hear()["msg"] == {"data": number}
    assert resident_bytes() - before < 30_000_000
    assert cell.server.statistics().dropped > 1900
    assert reader.time()["result"]


def test_stalled_reader_is_dropped(make_cell: MakeCell) -> None:
    """Its connection ends with the reason; the others stay."""
    cell = make_cell(stall_timeout=0.5)
    stalled = cell.client(sockopt=[(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)])
    stalled.say(op="subscribe", topic="big", type="T")
    stalled.time()
    reader = cell.client()
    for _ in range(200):
        cell.deliver("/cell/big", b'{"data":"' + b"x" * 100_000 + b'"}', 1)
    cell.wait_logged("left: took nothing for 0.5 s")
    assert reader.time()["result"]


@pytest.mark.parametrize(
    ("lengths", "looks"),
    [
        ([900_000 - 1000 * look for look in range(50)], None),
        ([900_000] * 50, 11),
        ([900_000 + 100 * look for look in range(50)], 11),
        ([900_000] * 10 + [800_000] * 40, 21),
        ([900_000] * 10 + [0] + [900_000] * 39, 22),
    ],
    ids=("slow", "stalled", "growing", "slow, then stalled", "stalled anew"),
)
def test_only_who_takes_nothing_is_dropped(lengths: list[int], looks: int | None) -> None:
    """A picture over a slow line takes longer than the time-out; answers to pings are no taking."""
    dropped: list[str] = []

    async def look() -> int | None:
        line: Any = SimpleNamespace(transport=SimpleNamespace())
        sending = Sending(line, SHIPPED, dropped.append)
        for number, length in enumerate(lengths):
            line.transport.get_write_buffer_size = lambda length=length: length
            sending._send(100.0 + 0.1001 * SHIPPED.stall_timeout * number)
            if dropped:
                return number + 1
        sending.end()
        return None

    assert asyncio.run(look()) == looks
    assert dropped in ([], ["took nothing for 1 s"])


def test_client_that_takes_no_answers_is_dropped(make_cell: MakeCell) -> None:
    """Answers wait in a bounded queue; only a client that reads nothing can fill it."""
    cell = make_cell(
        limits={"waiting_answers": 100},
        takes={"packets_per_second": 10**6, "cpu_percent": 100.0, "cpu_percent_together": 100.0},
        stall_timeout=60.0,
    )
    client = cell.client(sockopt=[(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)])
    with pytest.raises((OSError, websocket.WebSocketException)):
        for _ in range(20_000):
            client.say(op="dance", id="x" * 1000)
    cell.wait_logged("left: 100 answers wait and are not taken")


def test_silent_client_is_found(make_cell: MakeCell) -> None:
    """A client that answers no ping is dropped after ping_interval + ping_timeout."""
    cell = make_cell(ping_interval=0.1, ping_timeout=0.1)
    cell.client()
    cell.wait_logged("left: no answer to a ping within 0.1 s")


def pinged(milliseconds: float) -> Driving:
    """Return the shipped rules with other times for connections that drive."""
    seconds = milliseconds / 1000.0
    return msgspec.structs.replace(SHIPPED.driving, ping_interval=seconds, ping_timeout=seconds)


def test_client_that_thinks_between_two_calls_stays(make_cell: MakeCell) -> None:
    """Its pings lie unread for many times the interval that drivers have."""
    cell = make_cell(driving=pinged(50))
    client = cell.client()
    assert client.time()["result"]
    assert not select.select([client.line.sock], [], [], 1.0)[0], "nothing is asked for meanwhile"
    assert client.time()["result"]


def test_silent_client_that_drives_is_found_at_once(make_cell: MakeCell) -> None:
    """Who publishes jogs or set points is asked often; the topic is free again."""
    cell = make_cell(driving=pinged(100))
    cell.client().say(op="publish", topic="joint_vel_controller/command", msg={})
    cell.wait_logged("left: no answer to a ping within 0.1 s")
    done = [cell.graph.done.get(timeout=DEADLINE) for _ in range(3)]
    assert ("unadvertise", 1, "/cell/joint_vel_controller/command") in done


def test_twin_controller_is_asked_often_from_the_beginning(make_cell: MakeCell) -> None:
    """Its place is free again before it comes back."""
    cell = make_cell(driving=pinged(100))
    cell.client(header=[f"Authorization: Bearer {TWIN_CONTROLLER}"])
    cell.wait_logged("left: no answer to a ping within 0.1 s")


def test_client_that_drives_no_longer_may_think_again(make_cell: MakeCell) -> None:
    """Its last driving topic is unadvertised; a STOP has never made it a driver."""
    cell = make_cell(driving=pinged(300))
    client = cell.client()
    client.say(op="advertise", topic="motion_command", type="T")
    client.say(op="advertise", topic="joint_vel_controller/command", type="T")
    client.say(op="unadvertise", topic="joint_vel_controller/command")
    client.time()
    assert not select.select([client.line.sock], [], [], 1.0)[0]
    assert client.time()["result"]


def test_client_that_only_sends_is_not_silent(make_cell: MakeCell) -> None:
    """A script that publishes and never reads leaves pings unanswered, but it is alive."""
    cell = make_cell(ping_interval=0.2, ping_timeout=0.4)
    client = cell.client()
    end = time.monotonic() + 1.5
    while time.monotonic() < end:
        client.say(op="publish", topic="t", msg={})
        threading.Event().wait(0.01)
    assert cell.server.statistics().clients == 1


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
