"""Who did what, and who was refused, is told once."""

from __future__ import annotations

from typing import Any

import pytest
import websocket
from harness.opponents.graph_and_clients import DEADLINE, Cell
from rosbridge_gateway.protocol.audit import Entry


def test_what_a_client_does_is_audited_once_with_role_and_address(cell: Cell) -> None:
    """A hundred messages of a topic are one entry, a call has its answer, rosapi is in none."""
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
        (
            f"operator@{address}:{port}",
            Entry('publish /cell/motion_command {"command":3}', True, "done"),
        ),
        (
            f"operator@{address}:{port}",
            Entry('call_service /cell/move_to {"x":1}', True, '{"success":false}'),
        ),
    ]
    client.time()
    assert cell.graph.audited.empty()


@pytest.mark.parametrize(
    ("token", "packet", "entry"),
    [
        (
            "look",
            {"op": "publish", "topic": "motion_command", "msg": {}},
            Entry(
                "publish motion_command {}",
                False,
                "role viewer may not publish /cell/motion_command",
            ),
        ),
        (
            "look",
            {"op": "call_service", "service": "move_to", "args": {"x": 1}},
            Entry(
                'call_service move_to {"x":1}',
                False,
                "role viewer may not call_service /cell/move_to",
            ),
        ),
        (
            "drive",
            {"op": "publish", "topic": "t", "msg": {"data": "refuse"}},
            Entry('publish t {"data":"refuse"}', False, "data = 'refuse': allowed: anything else"),
        ),
    ],
)
def test_what_is_refused_is_audited_once(
    cell: Cell, token: str, packet: dict[str, Any], entry: Entry
) -> None:
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
    assert caller.startswith("nobody@127.0.0.1:")
    assert entry == Entry("connect from 127.0.0.1", False, "unknown token")
    assert cell.graph.audited.empty()
