"""Who is let in: tokens, origins, numbers, port, TLS."""

from __future__ import annotations

import time
from pathlib import Path

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
from harness.processes import free_port, wait_until
from harness.wires.gateway_client import RosbridgeClient
from rosbridge_gateway.admission.door_io import GatewayError
from rosbridge_gateway.connection.server_io import GatewayServer


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
    answer = (
        client.ask(op="call_service", id="1", service="move_to")
        if role == "viewer"
        else client.time()
    )
    assert answer["result"] == (role == "operator")
    assert any(line.endswith(f"came as {role}") for line in cell.log)


@pytest.mark.parametrize(
    ("path", "loopback_role", "reason"),
    [("?token=guess", "operator", "unknown token"), ("", "", "a token is needed")],
)
def test_client_without_a_right_to_come_is_turned_away(
    make_cell: MakeCell, path: str, loopback_role: str, reason: str
) -> None:
    """HTTP 401 with the reason, before any packet."""
    cell = make_cell(loopback_role=loopback_role)
    with pytest.raises(websocket.WebSocketBadStatusException, match="401") as caught:
        cell.client(path)
    assert caught.value.resp_body == f"{reason}\n".encode()
    assert cell.server.statistics().turned_away == 1


@pytest.mark.parametrize(
    "origin", ["http://example.org", "http://localhost:80.evil.example", "file://example.org"]
)
@pytest.mark.parametrize("path", ["", "?token=drive"])
def test_foreign_web_page_is_turned_away(cell: Cell, origin: str, path: str) -> None:
    """A page of another origin must not drive the robot, even by its user.s token."""
    with pytest.raises(websocket.WebSocketBadStatusException, match="403"):
        cell.client(path, origin=origin)
    _, entry = cell.graph.audited.get(timeout=DEADLINE)
    assert entry.outcome == f"a page of {origin!r} may not connect"


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


@pytest.mark.parametrize("host", ["localhost", "127.0.0.1", "[::1]"])
def test_origin_of_the_gateways_own_address_is_a_programs(make_cell: MakeCell, host: str) -> None:
    """websocket-client says so by itself; the gateway serves no page that could."""
    cell = make_cell(port=free_port())
    client = cell.client(origin=f"http://{host}:{cell.server.port}")
    client.say(op="call_service", service="twin_controller/command")
    assert cell.graph.calls.get(timeout=DEADLINE).caller.startswith("operator@")


@pytest.mark.parametrize("origin", ["https://127.0.0.1:{port}", "http://127.0.0.1:{other}"])
def test_origin_beside_the_gateways_own_is_a_pages(make_cell: MakeCell, origin: str) -> None:
    """Another scheme or port may have a page, whoever made it."""
    cell = make_cell(port=free_port())
    port = cell.server.port
    page = cell.client(origin=origin.format(port=port, other=port + 1))
    answer = page.ask(op="call_service", id="1", service="twin_controller/command")
    assert "role viewer may not" in answer["values"]


@pytest.mark.parametrize("path", ["", "?token=drive"])
def test_page_opened_from_a_file_reads_and_no_more(cell: Cell, path: str) -> None:
    """A token does not help it: any file that was downloaded can ask its reader for one."""
    page = cell.client(path, origin="file://")
    assert page.time()["result"]
    page.say(op="subscribe", topic="twin/joint_states")
    assert (
        "role viewer may not" in page.ask(op="advertise", topic="motion_command", type="T")["msg"]
    )
    answer = page.ask(op="call_service", id="1", service="twin_controller/command")
    assert not answer["result"]
    with pytest.raises(websocket.WebSocketBadStatusException, match="401"):
        cell.client("?token=guess", origin="file://")


@pytest.mark.parametrize("path", ["", "?token=drive"])
def test_null_is_no_origin(cell: Cell, path: str) -> None:
    """A frame that any web site has sandboxed says it, so it proves nothing."""
    with pytest.raises(websocket.WebSocketBadStatusException, match="403"):
        cell.client(path, origin="null")
    cell.wait_logged("a page of 'null' may not connect: a frame of any web site can say that")


def test_page_opened_from_a_file_has_no_role_where_pages_have_none(make_cell: MakeCell) -> None:
    """The file's own word counts, with a token too."""
    cell = make_cell(page_role="")
    with pytest.raises(websocket.WebSocketBadStatusException, match="403"):
        cell.client("?token=drive", origin="file://")


def test_page_with_a_token_has_its_role(cell: Cell) -> None:
    """A browser's page can give it in the address only."""
    cell.client("?token=drive", origin="http://localhost:8080").time()
    assert cell.log[-1].endswith("came as operator")


def test_page_needs_a_token_if_the_file_says_so(make_cell: MakeCell) -> None:
    """Programs of this machine do not."""
    cell = make_cell(page_role="")
    with pytest.raises(websocket.WebSocketBadStatusException, match="401"):
        cell.client(origin="http://localhost:8080")
    assert cell.client().time()["result"]


def test_token_guesses_are_slowed(cell: Cell) -> None:
    """One guess in 0.4 s is judged, the right one waits too; who needs none is let in meanwhile."""
    statuses, end = [], time.monotonic() + 0.4
    while time.monotonic() < end:
        with pytest.raises(websocket.WebSocketBadStatusException) as caught:
            cell.client(f"?token=guess-{len(statuses)}")
        statuses.append(caught.value.status_code)
    assert statuses == [401] + [429] * (len(statuses) - 1) and len(statuses) > 2
    with pytest.raises(websocket.WebSocketBadStatusException, match="429") as caught:
        cell.client("?token=drive")
    headers = caught.value.resp_headers
    assert headers is not None and headers["retry-after"] == "1"
    assert cell.client(f"?token={TWIN_CONTROLLER}").time()["result"]
    assert cell.client().time()["result"]
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
