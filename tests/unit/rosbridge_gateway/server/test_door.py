"""Who is let in: tokens, origins, numbers, port, TLS."""

from __future__ import annotations

import math
import time
from pathlib import Path
from types import SimpleNamespace

import msgspec
import pytest
import websocket
from harness.opponents.graph_and_clients import (
    DEADLINE,
    SHIPPED,
    TWIN_CONTROLLER,
    Cell,
    Graph,
    MakeCell,
)
from harness.opponents.secured_gateway import write_certificate
from harness.processes import wait_until
from harness.wires.gateway_client import RosbridgeClient
from rosbridge_gateway.admission.door_io import Door, GatewayError
from rosbridge_gateway.connection.server_io import GatewayServer


def test_token_decides_the_role(cell: Cell) -> None:
    """What each handshake gives is tried without a socket, in admission/test_door.py."""
    client = cell.client("?token=drive", header=["Authorization: Bearer look"])
    assert not client.ask(op="call_service", id="1", service="move_to")["result"]
    assert any(line.endswith("came as viewer") for line in cell.log)


def test_client_without_a_right_to_come_is_turned_away(cell: Cell) -> None:
    """HTTP 401 with the reason, before any packet."""
    with pytest.raises(websocket.WebSocketBadStatusException, match="401") as caught:
        cell.client("?token=guess")
    assert caught.value.resp_body == b"unknown token\n"
    assert cell.server.statistics().turned_away == 1


def test_foreign_web_page_is_turned_away(cell: Cell) -> None:
    """HTTP 403, even by its user's token, and the audit tells of it."""
    with pytest.raises(websocket.WebSocketBadStatusException, match="403"):
        cell.client("?token=drive", origin="http://example.org")
    _, entry = cell.graph.audited.get(timeout=DEADLINE)
    assert entry.outcome == "a page of 'http://example.org' may not connect"


def test_page_of_this_machine_is_a_viewer_without_a_token(cell: Cell) -> None:
    """Any page of http://localhost:* may be anybody's; a program is not asked."""
    page = cell.client(origin="http://localhost:8080")
    answer = page.ask(op="call_service", id="1", service="twin_controller/command")
    assert (answer["result"], answer["values"]) == (
        False,
        "role viewer may not call_service /cell/twin_controller/command",
    )
    for packet in ({"op": "advertise", "type": "T"}, {"op": "publish", "msg": {}}):
        assert "role viewer may not" in page.ask(topic="motion_command", **packet)["msg"]
    assert page.time()["result"]
    program = cell.client()
    program.say(op="call_service", service="twin_controller/command")
    assert cell.graph.calls.get(timeout=DEADLINE).caller.startswith("operator@")


def test_token_guesses_are_slowed(cell: Cell, monkeypatch: pytest.MonkeyPatch) -> None:
    """One guess in 0.5 s is judged, the right one waits too; who needs none is let in meanwhile.

    The door's clock stands still until all have come: then it goes on as it does for the server.
    """
    admit, stands = Door.admit, SimpleNamespace(at=time.monotonic())
    monkeypatch.setattr(Door, "admit", lambda *visit: admit(*visit[:-1], min(visit[-1], stands.at)))
    statuses = []
    for number in range(4):
        with pytest.raises(websocket.WebSocketBadStatusException) as caught:
            cell.client(f"?token=guess-{number}")
        statuses.append(caught.value.status_code)
    assert statuses == [401, 429, 429, 429]
    with pytest.raises(websocket.WebSocketBadStatusException, match="429") as caught:
        cell.client("?token=drive")
    headers = caught.value.resp_headers
    assert headers is not None and headers["retry-after"] == "1"
    assert cell.client(f"?token={TWIN_CONTROLLER}").time()["result"]
    assert cell.client().time()["result"]
    stands.at = math.inf
    wait_until(lambda: comes_in(cell, "?token=drive"), DEADLINE)


def comes_in(cell: Cell, path: str) -> bool:
    """Return whether a client is let in."""
    try:
        return bool(cell.client(path).time()["result"])
    except websocket.WebSocketBadStatusException:
        return False


def test_too_many_busy_clients_are_turned_away(make_cell: MakeCell) -> None:
    """HTTP 503 with the number; one that leaves makes room."""
    cell = make_cell(limits={"clients": 1})
    first = cell.client()
    first.say(op="subscribe", topic="t", type="T")
    first.time()
    with pytest.raises(websocket.WebSocketBadStatusException, match="503"):
        cell.client()
    first.line.close()
    wait_until(lambda: cell.server.statistics().clients == 0, DEADLINE)
    assert cell.client().time()["result"]


def test_taken_port_is_said_with_what_to_do(cell: Cell) -> None:
    """The node ends with this text."""
    config = msgspec.structs.replace(SHIPPED, port=cell.server.port)
    with pytest.raises(
        GatewayError,
        match=f"port 127.0.0.1:{cell.server.port} cannot be opened: Address already in use; end "
        "the program",
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
    client = RosbridgeClient(
        websocket.create_connection(url, timeout=DEADLINE, sslopt={"ca_certs": certificate})
    )
    assert client.time()["result"]
    client.line.close()
    with pytest.raises((OSError, websocket.WebSocketException)):
        cell.client()
