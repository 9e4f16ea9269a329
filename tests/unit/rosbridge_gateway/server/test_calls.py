"""Service calls, from a client and to one."""

from __future__ import annotations

from concurrent.futures import Future
from typing import Any

import pytest
from harness.opponents.graph_and_clients import DEADLINE, TWIN_CONTROLLER, Cell, MakeCell
from harness.processes import wait_until
from rosbridge_gateway.graph.graph_io import GraphError
from rosbridge_gateway.rosapi import answers


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


def test_rosapi_is_answered_and_what_it_has_not_goes_on_to_the_graph(cell: Cell) -> None:
    """A real rosapi beside the gateway, or a newer one, may offer more."""
    client = cell.client()
    answer = client.ask(op="call_service", service="rosapi/topic_type", args={"topic": "/clock"})
    assert answer["values"] == {"type": "rosgraph_msgs/Clock"}
    answer = client.ask(op="call_service", id="x", service="/rosapi/nodes", args={"y": 1})
    assert answer["values"] == "y: unknown field: allowed: none"
    assert (answer["id"], answer["result"]) == ("x", False)
    client.say(op="call_service", service="/rosapi/get_ros_version")
    cell.graph.calls.get(timeout=DEADLINE).end.put({"version": 1})
    assert client.hear()["values"] == {"version": 1}


def test_viewer_reads_all_of_rosapi_and_changes_nothing(cell: Cell) -> None:
    """Parameters are for operators to change, and the audit tells who did."""
    viewer, operator = cell.client("?token=look"), cell.client("?token=drive")
    for service in sorted(answers.SERVICES - answers.WRITES):
        for prefix in ("/rosapi", "rosapi"):
            answer = viewer.ask(op="call_service", service=f"{prefix}/{service}")
            assert "may not" not in str(answer["values"]), answer
    args = {"name": "/a", "value": "5"}
    for service in sorted(answers.WRITES):
        for name in (f"/rosapi/{service}", f"rosapi/{service}"):
            answer = viewer.ask(op="call_service", service=name, args=args)
            assert answer["values"].startswith("role viewer may not call_service /"), answer
    assert not cell.graph.parameters.has("/a")
    assert operator.ask(op="call_service", service="/rosapi/set_param", args=args)["result"]
    assert cell.graph.parameters.get("/a") == 5
    told = []
    while not told or not told[-1][0].startswith("operator"):
        told.append(cell.graph.audited.get(timeout=DEADLINE))
    assert told[-1][1].what == 'call_service /rosapi/set_param {"name":"/a","value":"5"}'
    refused = [entry for _, entry in told if entry.outcome.startswith("role viewer may not")]
    assert len(refused) == 4 and not any(entry.success for entry in refused)


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


@pytest.mark.parametrize(
    ("outcome", "text"),
    [
        (GraphError("service /cell/s does not exist"), "service /cell/s does not exist"),
        (KeyError("bug"), "KeyError('bug')"),
    ],
)
def test_failed_call_is_answered_with_its_reason(cell: Cell, outcome: Exception, text: str) -> None:
    """The answer has result false and the reason as values."""
    client = cell.client()
    client.say(op="call_service", id="c", service="s")
    cell.graph.calls.get(timeout=DEADLINE).end.put(outcome)
    answer = client.hear()
    assert (answer["id"], answer["result"]) == ("c", False) and text in answer["values"]


def test_time_out_of_a_call_is_bounded(cell: Cell) -> None:
    """The caller may choose within service_timeout_max."""
    client = cell.client()
    for asked, given in ((None, 60.0), (0, 60.0), (5.0, 5.0), (10_000, 600.0)):
        client.say(op="call_service", service="s", timeout=asked)
        call = cell.graph.calls.get(timeout=DEADLINE)
        call.end.put({})
        assert call.timeout == given and client.hear()["result"]


def test_calls_are_limited_per_client_and_together(make_cell: MakeCell) -> None:
    """More is refused at once, with the numbers; a finished call makes room."""
    cell = make_cell(limits={"calls": 3}, takes={"calls": 2})
    first, second = cell.client(), cell.client()
    first.say(op="call_service", service="s")
    first.say(op="call_service", service="s")
    answer = first.ask(op="call_service", service="s")
    assert not answer["result"]
    assert answer["values"].startswith("2 of 2 calls of this client and 2 of 3 calls of all run")
    second.say(op="call_service", service="s")
    assert "3 of 3 calls of all" in second.ask(op="call_service", service="s")["values"]
    calls = [cell.graph.calls.get(timeout=DEADLINE) for _ in range(3)]
    calls[0].end.put({})
    assert first.hear()["result"]
    wait_until(lambda: cell.server.statistics().calls == 2, DEADLINE)
    first.say(op="call_service", id="again", service="s")
    cell.graph.calls.get(timeout=DEADLINE).end.put({})
    assert first.hear()["id"] == "again"


def test_hanging_calls_of_programs_leave_the_twin_controller_its_own(make_cell: MakeCell) -> None:
    """Else the real robot grips and the twin does not."""
    cell = make_cell(limits={"calls": 2})
    program = cell.client()
    for _ in range(2):
        program.say(op="call_service", service="s")
    hanging = [cell.graph.calls.get(timeout=DEADLINE) for _ in range(2)]
    own = cell.client(header=[f"Authorization: Bearer {TWIN_CONTROLLER}"])
    own.say(op="call_service", service="s")
    cell.graph.calls.get(timeout=DEADLINE).end.put({"success": True})
    assert own.hear()["result"]
    assert "2 of 2 calls of all" in program.ask(op="call_service", service="s")["values"]
    for call in hanging:
        call.end.put({})


def ask_client(cell: Cell, args: dict[str, Any]) -> Future[dict[str, Any]]:
    """Ask as a ROS node would that calls the client's service."""
    return cell.graph.asks["/cell/s"](args)


def test_client_answers_a_service_that_it_advertised(cell: Cell) -> None:
    """The call goes to the client and its answer back; without an id it is the oldest's."""
    client = cell.client()
    client.say(op="advertise_service", service="s", type="std_srvs/SetBool")
    client.time()
    for with_id in (True, False):
        future = ask_client(cell, {"data": True})
        question = client.hear()
        assert question["op"] == "call_service"
        assert question["service"] == "s"
        assert question["args"] == {"data": True}
        identity = {"id": question["id"]} if with_id else {}
        client.say(
            op="service_response", service="s", result=True, values={"success": True}, **identity
        )
        assert future.result(DEADLINE) == {"success": True}


def test_failure_of_a_client_service_is_handed_on(cell: Cell) -> None:
    """Its reason reaches the ROS caller."""
    client = cell.client()
    client.say(op="advertise_service", service="s", type="std_srvs/SetBool")
    client.time()
    future = ask_client(cell, {})
    client.say(
        op="service_response", id=client.hear()["id"], service="s", result=False, values="no mood"
    )
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
