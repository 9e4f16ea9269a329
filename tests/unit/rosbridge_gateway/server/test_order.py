"""The packets of one client: in order, each with the time at which it came; a stop overtakes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
import websocket
from harness.opponents.graph_and_clients import DEADLINE, Call, Cell, MakeCell
from harness.processes import free_port, wait_until
from harness.workspace import ROOT
from rosbridge_gateway.config import Stops
from rosbridge_gateway.connection.line_io import Poll

PATIENT = {"begin_timeout": 5.0}
STOP = {"op": "call_service", "service": "twin_controller/command", "args": {"command": "STOP"}}


def next_call(cell: Cell) -> Call:
    """Return the next call that the gateway has made."""
    return cell.graph.calls.get(timeout=DEADLINE)


def done(cell: Cell) -> tuple[Any, ...]:
    """Return the next thing that was done in the graph, without the client's number."""
    what, _, *more = cell.graph.done.get(timeout=DEADLINE)
    return (what, *more)


def test_what_comes_after_a_call_waits_until_it_has_begun(make_cell: MakeCell) -> None:
    """A message, and a call of another service; the answers come as the services give them."""
    cell = make_cell(**PATIENT)
    client = cell.client()
    client.say(op="advertise", topic="a", type="T")
    client.say(op="call_service", id="1", service="slow_to_begin")
    client.say(op="publish", topic="a", msg={"data": 1})
    client.say(op="call_service", id="2", service="other")
    first = next_call(cell)
    assert done(cell)[0] == "advertise"
    assert cell.client().time()["result"], "others are served meanwhile"
    assert cell.graph.done.empty() and cell.graph.calls.empty()
    first.may_begin.set()
    assert done(cell) == ("publish", "/cell/a", {"data": 1})
    other = next_call(cell)
    other.end.put({})
    assert client.hear()["id"] == "2", "the first runs on"
    first.end.put({})
    assert client.hear()["id"] == "1"


def test_call_that_never_begins_holds_the_rest_up_for_a_moment(make_cell: MakeCell) -> None:
    """A service whose node hangs costs its own caller a tenth of a second."""
    cell = make_cell(begin_timeout=0.1)
    client = cell.client()
    client.say(op="call_service", service="slow_to_begin")
    next_call(cell)
    client.say(op="publish", topic="a", msg={"data": 1})
    assert done(cell)[0] == "advertise" and done(cell)[0] == "publish"


def test_calls_of_one_service_never_pass_each_other(make_cell: MakeCell) -> None:
    """However long the first takes to begin, the second is sent behind it."""
    cell = make_cell(begin_timeout=0.01)
    client = cell.client()
    for number in range(3):
        client.say(op="call_service", id=str(number), service="slow_to_begin")
    first, second, third = (next_call(cell) for _ in range(3))
    assert first.started.wait(DEADLINE)
    second.may_begin.set()
    third.may_begin.set()
    assert not second.started.is_set() and not third.started.is_set()
    first.may_begin.set()
    assert second.started.wait(DEADLINE) and third.started.wait(DEADLINE)
    for call in (first, second, third):
        call.end.put({})
        client.hear()


@pytest.mark.parametrize("how", ["call", "topic"])
def test_stop_passes_what_has_not_begun_and_what_comes_later_waits_for_it(
    make_cell: MakeCell, how: str
) -> None:
    """A STOP never stands behind a call; a RESET behind it does not pass it either."""
    cell = make_cell(**PATIENT)
    client = cell.client()
    client.say(op="advertise", topic="motion_command", type="T")
    assert done(cell)[0] == "advertise"
    client.say(op="call_service", id="slow", service="slow_to_begin")
    slow = next_call(cell)
    client.say(op="publish", topic="motion_command", msg={"command": 5})
    if how == "call":
        client.say(**STOP, id="stop")
        stop = next_call(cell)
        assert stop.args == {"command": "STOP"} and slow.came < stop.came
        stop.end.put({"success": True})
        assert client.hear()["id"] == "stop"
        assert cell.graph.done.empty()
    else:
        client.say(op="publish", topic="motion_command", msg={"command": 1})
        assert done(cell) == ("publish", "/cell/motion_command", {"command": 1})
    assert len(cell.graph.stops) == 1 and cell.graph.stops[0] > slow.came
    slow.may_begin.set()
    assert done(cell) == ("publish", "/cell/motion_command", {"command": 5})
    slow.end.put({})


@pytest.mark.parametrize(
    "stop",
    [
        STOP,
        STOP | {"args": {"command": " stop"}},
        {"op": "call_service", "service": "twin_controller/stop"},
        {"op": "call_service", "service": "twin_controller/pause", "args": {}},
    ],
)
def test_stop_needs_no_room_among_running_calls(make_cell: MakeCell, stop: dict[str, Any]) -> None:
    """Neither the client's limit nor that of all keeps it out; nor does a full pool of threads."""
    cell = make_cell(limits={"calls": 1}, takes={"calls": 1})
    client = cell.client()
    client.say(op="call_service", service="move_to")
    hanging = next_call(cell)
    assert "refused" in client.ask(op="call_service", service="move_to")["values"]
    client.say(**stop, id="stop")
    next_call(cell).end.put({"success": True})
    assert client.hear()["id"] == "stop"
    assert len(cell.graph.stops) == 1
    hanging.end.put({})


@pytest.mark.parametrize("whose", ["its own", "another's"])
def test_estop_waits_for_no_stop_that_waits_for_its_answer(cell: Cell, whose: str) -> None:
    """Somebody repeats a STOP that does not work; then an ESTOP comes, from whomever."""
    client, other = cell.client(), cell.client()
    for number in range(20):
        client.say(**STOP, id=str(number))
    stops = [next_call(cell) for _ in range(20)]
    assert all(call.started.wait(DEADLINE) for call in stops), "each has gone to its service"
    (client if whose == "its own" else other).say(**{**STOP, "args": {"command": "ESTOP"}})
    estop = next_call(cell)
    assert estop.started.wait(1.0)
    assert not stops[-1].cancelled.is_set(), "only the oldest are answered with an error"
    for call in (*stops, estop):
        call.end.put({"success": True})


def test_stop_of_a_client_that_goes_at_once_is_sent(make_cell: MakeCell) -> None:
    """A page sends STOP and closes; the answer alone is given up, once the request has gone."""
    stops = Stops(publish={}, call_service={"slow_to_begin": ["STOP"]})
    cell = make_cell(begin_timeout=0.01, stops=stops)
    client = cell.client()
    client.say(op="call_service", service="slow_to_begin", args={"command": "STOP"})
    stop = next_call(cell)
    client.line.close()
    cell.wait_logged("left")
    assert not stop.cancelled.is_set()
    stop.may_begin.set()
    assert stop.cancelled.wait(DEADLINE)


def test_stop_is_the_one_command_of_who_only_watches(cell: Cell) -> None:
    """Called, it goes as anybody's; whoever may not publish commands publishes none to stop."""
    viewer = cell.client("?token=look")
    resume = STOP | {"args": {"command": "RESUME"}}
    assert "role viewer may not" in viewer.ask(**resume, id="r")["values"]
    viewer.say(op="publish", topic="motion_command", msg={"command": 1})
    assert "role viewer may not" in viewer.hear()["msg"]
    assert cell.graph.stops == [] and cell.graph.calls.empty()
    viewer.say(**STOP, id="s")
    next_call(cell).end.put({"success": True})
    assert viewer.hear()["id"] == "s"
    assert len(cell.graph.stops) == 1


def test_what_a_client_sent_before_it_left_is_performed(cell: Cell) -> None:
    """A script publishes and ends."""
    client = cell.client()
    for number in range(50):
        client.say(op="publish", topic=f"t{number % 5}", msg={"data": number})
    client.line.close()
    published: list[int] = []
    while len(published) < 50:
        what = done(cell)
        published += [what[2]["data"]] if what[0] == "publish" else []
    assert published == list(range(50))


def test_packet_has_the_time_at_which_it_came(cell: Cell) -> None:
    """By the monotonic clock, which all processes of a machine share."""
    client = cell.client()
    for _ in range(5):
        sent = time.monotonic()
        client.say(op="call_service", service="s")
        call = next_call(cell)
        heard = time.monotonic()
        assert sent - 0.03 <= call.came <= heard
        call.end.put({})
        client.hear()


GATEWAY = """
import sys
import msgspec
from harness.opponents.graph_and_clients import SHIPPED, Cell

cell = Cell(msgspec.structs.replace(SHIPPED, port=int(sys.argv[1])))
cell.server.start()
print("ready", flush=True)
while True:
    call = cell.graph.calls.get()
    print(call.service, call.came, flush=True)
    call.end.put({})
"""


def test_packet_that_the_look_of_a_standstill_missed_is_as_old_as_the_standstill(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A look that had its answer when the process stopped reports it after; the next one, more."""
    looks = iter([(0.0, []), (0.15, ["a thread's word"]), (0.0, ["what waited"]), (0.0, [])])
    clock = {"now": 100.0}

    def look(_: object, __: float | None) -> list[str]:
        took, ready = next(looks)
        clock["now"] += took
        return ready

    monkeypatch.setattr("rosbridge_gateway.connection.line_io.time.monotonic", lambda: clock["now"])
    monkeypatch.setattr("selectors.DefaultSelector.select", look)
    poll = Poll()
    try:
        assert poll.select(1.0) == ["a thread's word"] and poll.since == 100.0
        assert poll.select(0.0) == ["what waited"] and poll.since == 100.0
        poll.select(0.0)
        assert poll.since == pytest.approx(100.15), "it runs again"
    finally:
        poll.close()


def test_packet_that_waited_in_a_stopped_gateway_is_as_old_as_the_standstill(
    tmp_path: Path,
) -> None:
    """It is as old as the standstill; a STOP beside it is as new as its reading and refuses it."""
    script, port = tmp_path / "gateway.py", free_port()
    script.write_text(GATEWAY, encoding="utf-8")
    gateway = subprocess.Popen(
        [sys.executable, str(script), str(port)],
        stdout=subprocess.PIPE,
        text=True,
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
    )
    assert gateway.stdout is not None
    try:
        assert gateway.stdout.readline() == "ready\n"
        line = websocket.create_connection(
            f"ws://127.0.0.1:{port}", timeout=DEADLINE, suppress_origin=True
        )
        state = Path(f"/proc/{gateway.pid}/stat")
        for _ in range(4):
            gateway.send_signal(signal.SIGSTOP)
            wait_until(lambda: state.read_text().rpartition(")")[2].split()[0] == "T", DEADLINE)
            stopped = time.monotonic()
            line.send('{"op": "call_service", "service": "s"}')
            time.sleep(0.15)  # what is measured: the standstill
            line.send(json.dumps(STOP))
            gateway.send_signal(signal.SIGCONT)
            came = dict(gateway.stdout.readline().split() for _ in range(2))
            assert float(came["/cell/s"]) <= stopped, (came, stopped)
            assert float(came["/cell/twin_controller/command"]) > stopped + 0.15, "a STOP is newer"
        sent = time.monotonic()
        line.send('{"op": "call_service", "service": "s"}')
        assert float(gateway.stdout.readline().split()[1]) >= sent - 0.03, "it runs again"
    finally:
        gateway.kill()
        gateway.wait()
