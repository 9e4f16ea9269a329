"""A client that came with a person's token asks in that person's name."""

from __future__ import annotations

from typing import Any

import pytest
from harness.opponents.graph_and_clients import DEADLINE, Cell

COMMAND = "twin_controller/command"
PROOF = {"person": "fitter", "token": "fitters-own"}


def called(cell: Cell, path: str, service: str = COMMAND, **packet: Any) -> Any:
    """Return the arguments with which a client's call is made."""
    cell.client(path).say(op="call_service", service=service, **packet)
    return cell.graph.calls.get(timeout=DEADLINE).args


def test_command_of_a_person_carries_name_proof_and_client(cell: Cell) -> None:
    """The client says what it wants, the gateway who wants it."""
    args = called(cell, "?token=fitters-own", args={"command": "HOME"})
    assert args == {"command": "HOME", **PROOF, "session": "gateway 1"}
    again = called(cell, "?token=fitters-own", "/cell/twin_controller/control")
    assert again["session"] == "gateway 2", "two clients of one person are two"


@pytest.mark.parametrize(
    ("path", "service"),
    [("", COMMAND), ("?token=drive", COMMAND), ("?token=fitters-own", "move_to")],
)
def test_nobody_else_is_told_of_a_person(cell: Cell, path: str, service: str) -> None:
    """Without a person's token, and for other services, a call is what the client says."""
    assert called(cell, path, service, args={"x": 0.5}) == {"x": 0.5}


def test_person_is_in_the_caller_and_in_the_log(cell: Cell) -> None:
    """Who reads the audit of the gateway sees the name."""
    cell.client("?token=fitters-own").say(op="call_service", service=COMMAND)
    caller = cell.graph.calls.get(timeout=DEADLINE).caller
    assert caller.startswith("operator:fitter@127.0.0.1:")
    assert any(line.endswith("came as operator, fitter") for line in cell.log)


def test_token_that_a_client_gives_itself_is_in_no_audit(cell: Cell) -> None:
    """The audit is published and recorded."""
    client = cell.client()
    client.say(op="call_service", service=COMMAND, args={"command": "HOME", **PROOF})
    call = cell.graph.calls.get(timeout=DEADLINE)
    assert call.args == {"command": "HOME", **PROOF}
    call.end.put({"success": True})
    client.hear()
    _, entry = cell.graph.audited.get(timeout=DEADLINE)
    assert "fitters-own" not in entry.what and '"token":"***"' in entry.what
