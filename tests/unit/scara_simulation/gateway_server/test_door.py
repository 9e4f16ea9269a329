"""Who is let in: tokens, origins, numbers, port, TLS."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest
import websocket
from harness.opponents.graph_and_clients import DEADLINE, SHIPPED, Cell, Client, Graph, MakeCell
from harness.opponents.secured_gateway import write_certificate
from harness.processes import wait_until
from scara_simulation.io.gateway_door import GatewayError
from scara_simulation.io.gateway_server import GatewayServer


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
    wait_until(lambda: cell.server.statistics().clients == 0, DEADLINE)
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
