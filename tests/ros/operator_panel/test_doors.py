"""The doors of both pages as they are served: who is let in, and what a stranger costs.

The rules themselves are tested in tests/unit/scara_ros.
"""

from __future__ import annotations

import http.client
import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.processes import Process, free_port, wait_until
from harness.ros import Ros
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

TOKEN = "token-of-the-tests"
FRAME = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate", "Sec-Fetch-Dest": "iframe"}
STRANGERS = 300
COST_MB = 8.0


class Served:
    """A running page."""

    def __init__(self, ros: Ros, *words: str, variable: str, option: str) -> None:
        """Start it and wait until it listens."""
        self.port = free_port()
        env = {variable: TOKEN}
        self.process: Process = ros.run(*words, option.format(port=self.port), env=env)
        wait_until(
            lambda: "http://" in self.process.output or self.process.poll() is not None,
            30.0,
            "the page",
        )
        assert self.process.poll() is None, self.process.tail()

    def ask(
        self, path: str = "/", method: str = "GET", cookie: str = "", **headers: str
    ) -> http.client.HTTPResponse:
        """Send one request; underlines stand for dashes in the names of headers."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=20.0)
        named = {key.replace("_", "-"): value for key, value in headers.items()}
        connection.request(method, path, headers=named | ({"Cookie": cookie} if cookie else {}))
        answer = connection.getresponse()
        answer.read()
        return answer

    def enter(self) -> str:
        """Come in by the address with the token; return the cookie."""
        answer = self.ask(f"/?token={TOKEN}")
        assert (answer.status, answer.getheader("Location")) == (303, "/")
        return (answer.getheader("Set-Cookie") or "").split(";")[0]

    def is_heard(self, path: str, origin: str | None, cookie: str = "") -> bool:
        """Return whether a web socket is accepted."""
        head = {"Cookie": cookie} if cookie else {}
        try:
            uri = f"ws://127.0.0.1:{self.port}{path}"
            with connect(uri, origin=origin, additional_headers=head):  # type: ignore[arg-type]
                return True
        except InvalidStatus as error:
            assert error.response.status_code == 403
            return False

    def memory_mb(self) -> float:
        """Return the resident memory of the node."""
        pages = int(Path(f"/proc/{self.process.pid}/statm").read_text().split()[1])
        return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


@pytest.fixture(scope="module")
def panel(ros_module: Ros) -> Served:
    """Give the operator's page."""
    words = ("operator_panel", "operator_panel")
    return Served(ros_module, *words, variable="OPERATOR_PANEL_TOKEN", option="_port:={port}")


@pytest.fixture(scope="module")
def pendant(ros_module: Ros) -> Served:
    """Give the robot's pendant page; there is no robot."""
    words = ("fanuc_emulator", "pendant_page")
    return Served(ros_module, *words, variable="PENDANT_PAGE_TOKEN", option="--page-port={port}")


@pytest.fixture(params=["panel", "pendant"])
def page(request: pytest.FixtureRequest) -> Iterator[Served]:
    """Give each of the two pages."""
    yield request.getfixturevalue(request.param)


def test_pages_of_other_sites_reach_neither_page(page: Served) -> None:
    """Neither by a name that points here, nor from another origin, nor in a frame."""
    cookie = page.enter()
    assert TOKEN not in cookie and page.ask(cookie=cookie).status == 200
    assert page.ask(cookie=cookie, Host="evil.example").status == 403
    assert page.ask(cookie=cookie, Origin="http://localhost:9999").status == 403
    assert page.ask(cookie=cookie, method="POST", Origin="null").status == 403
    assert page.ask(cookie=cookie, **FRAME).status == 403
    assert page.ask(cookie=cookie).getheader("X-Frame-Options") == "DENY"
    socket = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
    assert page.is_heard(socket, f"http://127.0.0.1:{page.port}", cookie)
    assert not page.is_heard(socket, "http://localhost:9999", cookie)


def test_live_line_of_the_operators_page_is_its_own(panel: Served) -> None:
    """STOP and jog go over it."""
    assert panel.is_heard("/live?page=x", f"http://127.0.0.1:{panel.port}")
    assert not panel.is_heard("/live?page=x", "http://localhost:9999")


@pytest.mark.parametrize("visited", [False, True])
def test_pendant_page_is_loaded_for_its_first_visitor(ros: Ros, visited: bool) -> None:
    """It listens and says its address before; a signal ends it in peace in both states."""
    words = ("fanuc_emulator", "pendant_page")
    page = Served(ros, *words, variable="PENDANT_PAGE_TOKEN", option="--page-port={port}")
    before = page.memory_mb()
    if visited:
        cookie = page.enter()
        assert page.ask(cookie=cookie).status == 200
        assert page.memory_mb() > before + 20.0
    page.process.signal(signal.SIGTERM)
    assert page.process.wait(20.0) == 0
    assert "Traceback" not in page.process.output
    ros.stage.processes.remove(page.process)


def test_pendant_page_is_for_who_brings_the_token(pendant: Served) -> None:
    """It starts programs: without the printed address there is nothing to see or to press."""
    socket = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
    assert pendant.ask().status == pendant.ask("/_nicegui/x").status == 403
    assert not pendant.is_heard(socket, None)
    assert not pendant.is_heard(socket, None, f"pendant_page_{pendant.port}={TOKEN}")


def test_strangers_cost_nothing(page: Served) -> None:
    """No page is built for a guess, for another site, or for a path that leads nowhere."""
    page.ask("/?token=guess")
    before = page.memory_mb()
    assert before > 40.0, "this is not the node"
    for number in range(STRANGERS):
        assert page.ask(f"/?token=guess-{number}").status == 403
        assert page.ask(Host="evil.example").status == 403
        assert page.ask(f"/{number}").status in (403, 404)
    assert page.memory_mb() - before < COST_MB


@pytest.mark.parametrize(
    ("words", "variable"),
    [
        (("operator_panel", "operator_panel"), "OPERATOR_PANEL_TOKEN"),
        (("fanuc_emulator", "pendant_page"), "PENDANT_PAGE_TOKEN"),
    ],
)
def test_token_on_the_command_line_ends_the_node(
    ros_module: Ros, words: tuple[str, str], variable: str
) -> None:
    """With the places where it may stand."""
    node = ros_module.run(*words, "_token:=secret-secret-secret")
    assert node.wait(30.0) == 2
    assert f"Set {variable}, or write the token into" in node.output
