"""Places: idle clients keep nobody out, and nothing keeps the twin controller out."""

from __future__ import annotations

import pytest
import websocket
from harness.opponents.graph_and_clients import DEADLINE, TWIN_CONTROLLER, Cell, MakeCell
from harness.processes import wait_until
from rosbridge_gateway.connection.server_io import Statistics

AS_TWIN_CONTROLLER = [f"Authorization: Bearer {TWIN_CONTROLLER}"]


def has_gone(line: websocket.WebSocket) -> bool:
    """Return whether the gateway has ended a connection."""
    try:
        return not line.recv()
    except websocket.WebSocketTimeoutException:
        return False
    except (OSError, websocket.WebSocketException):
        return True


def test_idle_sockets_do_not_lock_the_twin_controller_out_after_a_lost_line(cell: Cell) -> None:
    """Half of 32 are pages, all listen; a line lost without a word counts until its ping fails."""
    first = cell.client(header=AS_TWIN_CONTROLLER)
    first.say(op="subscribe", topic="twin/joint_states", type="T")
    assert first.time()["result"]
    for number in range(cell.server.config.limits.clients):
        client = cell.client(origin="http://localhost:8080") if number % 2 else cell.client()
        client.say(op="subscribe", topic="t", type="T")
        client.time()
    for _ in range(10):  # none of its connections is ended by it
        again = cell.client(header=AS_TWIN_CONTROLLER)
        again.say(op="subscribe", topic="twin/joint_states", type="T")
        assert again.time()["result"]
    assert has_gone(first.line)
    cell.wait_logged("left: made room for another twin_controller")
    own = cell.server.config.roles["twin_controller"].places

    def all_places_taken() -> bool:
        statistics: Statistics = cell.server.statistics()
        return statistics.clients == cell.server.config.limits.clients + own

    wait_until(all_places_taken, DEADLINE)


def test_idle_sockets_keep_no_program_out(make_cell: MakeCell) -> None:
    """The one that has done nothing for longest goes; who does something stays."""
    cell = make_cell(limits={"clients": 3})
    listener = cell.client()
    listener.say(op="subscribe", topic="t", type="T")
    listener.time()
    oldest, other = cell.client(), cell.client()
    oldest.time()
    other.time()
    fresh = cell.client()
    assert fresh.time()["result"] and listener.time()["result"] and other.time()["result"]
    assert has_gone(oldest.line)
    cell.wait_logged("left: made room for another operator")


def test_many_idle_sockets_cost_a_newcomer_nothing(cell: Cell) -> None:
    """200 of them, one after the other: never more than the limit, all others are gone."""
    worker = cell.client()
    worker.say(op="advertise", topic="t", type="T")
    for _ in range(200):
        cell.client()
    assert worker.time()["result"] and cell.client().time()["result"]
    wait_until(lambda: cell.server.statistics().clients <= 32, DEADLINE)
    assert cell.server.statistics().errors == 0


@pytest.mark.parametrize("header", [[], ["Authorization: Bearer drive"]])
def test_place_of_the_twin_controller_is_for_its_token_only(
    make_cell: MakeCell, header: list[str]
) -> None:
    """An address, a name, or the operator's token do not make a twin controller."""
    cell = make_cell(limits={"clients": 1})
    busy = cell.client()
    busy.say(op="subscribe", topic="t", type="T")
    busy.time()
    with pytest.raises(websocket.WebSocketBadStatusException, match="503"):
        cell.client("?role=twin_controller", header=[*header, "User-Agent: twin_controller"])
    assert cell.client(header=AS_TWIN_CONTROLLER).time()["result"]
