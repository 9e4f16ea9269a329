"""The twin's link to a gateway that asks for a token and speaks TLS."""

from __future__ import annotations

import queue
import ssl
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest
from harness.opponents.graph_and_clients import JsonMessage
from harness.opponents.secured_gateway import SecuredGateway
from harness.workspace import ROOT
from robot_doctor.finding import Level
from robot_doctor.twin_probe_io import ask_twin
from scara_config import ConfigError, load_robot
from scara_ros.page.token_file_io import TWIN_CONTROLLER_FILE, TWIN_CONTROLLER_VARIABLE, read_token
from twin_controller.config import Twin, load_twin_controller
from twin_controller.twin.rosbridge_access_io import Access, _SharedSocket, read_access, shown
from twin_controller.twin.rosbridge_link_io import RosbridgeLink
from twin_controller.twin.rosbridge_socket_io import LinkSettings

DEADLINE = 10.0
TOKEN = "drive-7f3a"
QUICK = LinkSettings(silent_timeout=3.0, retry_first=0.02, retry_last=0.05)
SHIPPED: Twin = load_twin_controller(load_robot(ROOT / "config"), ROOT / "config").twin


@pytest.fixture
def gateway(tmp_path: Path) -> Iterator[SecuredGateway]:
    """Run a gateway."""
    with SecuredGateway(tmp_path, {TOKEN: "operator"}) as running:
        yield running


class Owner:
    """What a link told."""

    def __init__(self) -> None:
        self.changes: queue.Queue[tuple[bool, str]] = queue.Queue()
        self.answers: queue.Queue[tuple[Any, ...]] = queue.Queue()
        self.heard: queue.Queue[tuple[Any, ...]] = queue.Queue()

    def link(self, url: str, access: Access) -> RosbridgeLink:
        """Return a link that tells this owner."""

        def change(up: bool, why: str) -> None:
            self.changes.put((up, why))

        return RosbridgeLink(
            url, lambda *message: self.heard.put(message), change, access=access, settings=QUICK
        )


def test_link_to_a_secured_gateway_is_made(gateway: SecuredGateway) -> None:
    """Token in the header, certificate checked; calls and messages go to and fro at once."""
    owner = Owner()
    settings = msgspec.structs.replace(
        SHIPPED, token_environment="TWIN_TOKEN", ca_file=gateway.certificate
    )
    access = read_access(settings, gateway.url, {"TWIN_TOKEN": TOKEN})
    with owner.link(gateway.url, access) as link:
        assert owner.changes.get(timeout=DEADLINE) == (True, "")
        link.subscribe("t", "std_msgs/String", queue_length=10_000)
        link.call_service(
            "/rosapi/get_time", {}, lambda *answer: owner.answers.put(answer), DEADLINE
        )
        assert owner.answers.get(timeout=DEADLINE)[:2] == (
            True,
            {"time": {"secs": 12, "nsecs": 34}},
        )

        def publish() -> None:
            for _ in range(300):
                link.publish("u", {"data": "x" * 1000})

        sender = threading.Thread(target=publish)
        sender.start()
        for number in range(300):
            gateway.deliver("/t", JsonMessage(b'{"data":%d}' % number))
        assert [owner.heard.get(timeout=DEADLINE)[1] for _ in range(300)] == [
            {"data": number} for number in range(300)
        ]
        sender.join(DEADLINE)
        assert link.connected and owner.changes.empty()
    assert any("came as operator" in line for line in gateway.log)


def test_doctor_gets_into_a_secured_gateway(gateway: SecuredGateway) -> None:
    """It asks as the twin controller does, and shows no token either."""
    access = Access(TOKEN, gateway.certificate)
    (finding,) = ask_twin(gateway.url + "/?token=secret", access)
    assert finding.level is Level.FINE and finding.what.startswith(f"twin at {gateway.url}/: ")
    (finding,) = ask_twin(gateway.url, Access("guess-secret", gateway.certificate))
    assert "401" in finding.what and "secret" not in finding.what


def test_wrong_token_is_said_without_the_token(gateway: SecuredGateway) -> None:
    """The reason goes to the log, the diagnostics and the bag."""
    owner = Owner()
    with owner.link(
        gateway.url + "/?token=query-secret",
        Access(token="guess-secret", ca_file=gateway.certificate),
    ):
        assert owner.changes.get(timeout=DEADLINE) == (
            False,
            f"{gateway.url}/: refused with HTTP 401: unknown token",
        )


def test_gateway_with_another_certificate_gets_no_token(gateway: SecuredGateway) -> None:
    """The system's authorities do not know it, so that it may be anybody."""
    owner = Owner()
    with owner.link(gateway.url, Access(token=TOKEN)):
        up, why = owner.changes.get(timeout=DEADLINE)
    assert not up and why.startswith(f"{gateway.url}: ") and "certificate verify failed" in why


@pytest.mark.parametrize(
    ("url", "text"),
    [
        ("ws://127.0.0.1:9090", "ws://127.0.0.1:9090"),
        ("wss://cell.example:9090/twin?token=secret#x", "wss://cell.example:9090/twin"),
        ("wss://name:secret@cell.example/", "wss://cell.example/"),
        ("secret@[", "secret@["),
        ("?token=secret", ""),
    ],
)
def test_url_is_shown_without_what_may_be_secret(url: str, text: str) -> None:
    """Neither query nor user."""
    assert shown(url) == text


def test_access_shows_no_token() -> None:
    """A log line or a traceback may print it."""
    assert TOKEN not in repr(Access(token=TOKEN))


@pytest.mark.parametrize(
    ("changes", "url", "text"),
    [
        (
            {"token_environment": "TWIN_TOKEN"},
            "ws://h",
            r"twin\.token_environment = TWIN_TOKEN: the variable is not set",
        ),
        (
            {"token_environment": "EMPTY"},
            "ws://h",
            r"twin\.token_environment = EMPTY: the variable is not set",
        ),
        (
            {"token_environment": "TWO"},
            "ws://h",
            r"twin\.token_environment = TWO: the token must be .* without blanks",
        ),
        ({"ca_file": "missing.pem"}, "wss://h", r"twin\.ca_file = missing\.pem: No such file"),
        ({"ca_file": __file__}, "wss://h", r"twin\.ca_file = .*: is no PEM file with certificates"),
        (
            {"ca_file": "missing.pem"},
            "ws://h",
            r"twin\.ca_file = missing\.pem: ws://h has no certificate: allowed with wss://",
        ),
        (
            {"url": "ws://h/?token=secret"},
            "ws://h",
            r"twin\.url = ws://h/\?\.\.\.: must have no query",
        ),
    ],
)
def test_wrong_access_is_refused(changes: dict[str, Any], url: str, text: str) -> None:
    """The node ends with one line that names key, value and what is allowed, and no secret."""
    with pytest.raises(ConfigError, match=rf"^twin_controller\.yaml: {text}") as caught:
        read_access(
            msgspec.structs.replace(SHIPPED, **changes), url, {"EMPTY": "", "TWO": "a secret\n"}
        )
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize("host", ["127.0.0.1:9090", "localhost:9090", "[::1]:9090"])
def test_gateway_of_this_machine_is_told_that_it_is_the_twin_controller(
    tmp_path: Path, host: str
) -> None:
    """By the token that this user's gateway finds in the same place."""
    home = {"HOME": str(tmp_path)}
    token = read_token(TWIN_CONTROLLER_VARIABLE, TWIN_CONTROLLER_FILE, home)
    assert read_access(SHIPPED, f"ws://{host}", home) == Access(token)
    given = home | {TWIN_CONTROLLER_VARIABLE: "given"}
    assert read_access(SHIPPED, f"ws://{host}", given) == Access("given")


@pytest.mark.parametrize("url", ["ws://cell.example:9090", "ws://192.0.2.1", "ws://[", "no url"])
def test_gateway_of_another_machine_gets_no_token_that_was_not_given(
    tmp_path: Path, url: str
) -> None:
    """This user's own token is nobody else's business."""
    home = {"HOME": str(tmp_path), TWIN_CONTROLLER_VARIABLE: "given"}
    assert read_access(SHIPPED, url, home) == Access()


def test_token_file_that_cannot_be_used_is_said(tmp_path: Path) -> None:
    """Without it the twin controller would be a stranger, and could not lead the twin."""
    (tmp_path / ".ros").write_text("a file")
    with pytest.raises(ConfigError, match=r"token_environment = null: .*cannot be used"):
        read_access(SHIPPED, SHIPPED.url, {"HOME": str(tmp_path)})


def test_openssl_is_never_asked_by_two_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither for what it holds already: a reader asks that before it waits for data."""
    turns: list[bool] = []

    def pending(line: Any) -> int:
        turns.append(line._turn.locked())
        return 1

    monkeypatch.setattr(ssl.SSLSocket, "pending", pending)
    for name in ("recv", "send"):
        monkeypatch.setattr(ssl.SSLSocket, name, lambda line, *_: turns.append(line._turn.locked()))
    line = _SharedSocket.__new__(_SharedSocket)
    line.recv()
    line.send(b"")
    assert turns == [True, True, True]
