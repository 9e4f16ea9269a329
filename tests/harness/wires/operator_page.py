"""The operator's page without a browser: its HTTP and its live connection."""

from __future__ import annotations

import contextlib
import http.client
import json
import re
import threading
import time
from collections.abc import Iterator
from typing import Any

from websockets.exceptions import ConnectionClosed
from websockets.sync.client import ClientConnection, connect

from harness.processes import Process, free_port, wait_until
from harness.ros import Ros

TOKEN = "token-of-the-tests"
VARIABLE = "OPERATOR_PANEL_TOKEN"
CLOSE_S = 0.1
"""A page that is closed waits for nobody; the library's client would wait 10 s for an answer that
stands behind frames that the test does not read."""
SIGN_S = 1.0
"""So often a page says that it is there."""


class Panel:
    """A running panel and what a browser would do with it."""

    def __init__(self, ros: Ros, *args: str, env: dict[str, str] | None = None) -> None:
        """Start it and wait until it serves."""
        self.port = free_port()
        words = (
            f"_port:={self.port}",
            f"_runs_dir:={ros.folder / 'runs'}",
            *args,
        )
        env = {VARIABLE: TOKEN, **(env or {})}
        self.process: Process = ros.run("operator_panel", "operator_panel", *words, env=env)
        wait_until_served(self.process)

    def get(self, path: str, cookie: str = "") -> http.client.HTTPResponse:
        """Ask for a page."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20.0)
        connection.request("GET", path, headers={"Cookie": cookie} if cookie else {})
        return connection.getresponse()

    def enter(self, token: str = TOKEN) -> str:
        """Come in by the operator's address; return the cookie."""
        header = self.get(f"/?token={token}").getheader("Set-Cookie") or ""
        return header.split(";")[0]

    def told(self, cookie: str = "") -> dict[str, Any]:
        """Return what a new page is told."""
        found = re.search(
            r"window\.PANEL = (\{.*?\})</script>", self.get("/", cookie).read().decode()
        )
        assert found
        told = json.loads(found[1])
        assert isinstance(told, dict)
        return told

    @contextlib.contextmanager
    def live(
        self, cookie: str = "", page: str = "", signs: bool = True
    ) -> Iterator[ClientConnection]:
        """Open the live connection of a page, of a new one unless ``page`` says which.

        Without ``signs`` it does not say that it is there, as one whose network is gone.
        """
        url = f"ws://127.0.0.1:{self.port}/live?page={page or self.told(cookie)['page']}&tab=t"
        with connect(url, close_timeout=CLOSE_S) as made:
            if signs:
                threading.Thread(target=_give_signs, args=(made,), daemon=True).start()
            yield made


def _give_signs(live: ClientConnection) -> None:
    """Say that a page is there, until its connection is closed."""
    with contextlib.suppress(ConnectionClosed, OSError):
        while True:
            live.send('{"alive": 1}')
            time.sleep(SIGN_S)


def wait_until_served(panel: Process) -> None:
    """Wait until a panel serves its page."""

    def serves() -> bool:
        assert panel.poll() is None, panel.tail()
        return "to watch" in panel.output

    wait_until(serves, 30.0, "the operator panel")


def heard(live: ClientConnection, kind: str, timeout: float = 15.0) -> Any:
    """Return the content of the next packet of a kind."""
    deadline = time.monotonic() + timeout
    while time.monotonic() < deadline:
        packet = json.loads(live.recv(timeout=deadline - time.monotonic()))
        if kind in packet:
            return packet[kind]
    raise AssertionError(f"no {kind} within {timeout:g} s")
