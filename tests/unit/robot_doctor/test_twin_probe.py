"""The doctor's questions to a twin end, whatever the other side does."""

from __future__ import annotations

import threading

import pytest
from robot_doctor.finding import Level
from robot_doctor.twin_probe_io import ask_twin
from twin_controller.twin.rosbridge_access_io import Access
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import ServerConnection, serve

from robot_doctor import twin_probe_io


def ping_only(line: ServerConnection) -> None:
    """Ping until the other side goes, and answer nothing."""
    try:
        while True:
            line.ping()
            try:
                line.recv(timeout=0.05)
            except TimeoutError:
                continue
    except ConnectionClosed:
        return


def test_a_twin_that_pings_and_never_answers_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """Within the time that it has to answer, not for ever."""
    monkeypatch.setattr(twin_probe_io, "TIMEOUT_S", 0.5)
    with serve(ping_only, "127.0.0.1", 0, compression=None) as server:
        serving = threading.Thread(target=server.serve_forever)
        serving.start()
        port = server.socket.getsockname()[1]
        (finding,) = ask_twin(f"ws://127.0.0.1:{port}", Access())
        server.shutdown()
        serving.join(10.0)
    assert finding.level is Level.WRONG
    assert "does not tell its time" in finding.what and "no answer within 0.5 s" in finding.what
