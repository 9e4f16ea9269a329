"""The audit: whoever commands is named there, at a console and over the web socket alike."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import websocket
from harness.ros import Ros

from scara_msgs.msg import Audit

DEADLINE = 20.0


class Pair:
    """A gateway and a twin controller that has no robot, and what they tell of who did what."""

    def __init__(self, ros: Ros) -> None:
        self.ros = ros
        port = ros.free_port()
        gateway = ros.run(
            "rosbridge_gateway", "gateway", f"_port:={port}", env={"SCARA_VIEWER_TOKEN": "look"}
        )
        ros.wait_until(
            lambda: f"on 127.0.0.1:{port}" in gateway.output, DEADLINE, "the gateway's port"
        )
        self.port = port
        self.told = ros.collect("twin_controller/audit", Audit)
        ros.run(
            "twin_controller",
            "twin_controller",
            f"_gateway_url:=ws://127.0.0.1:{port}",
            f"_modbus_port:={ros.free_port()}",
        )
        ros.wait_for_service("twin_controller/command")

    def client(self, **options: Any) -> tuple[websocket.WebSocket, str]:
        """Connect, and return the client's address too."""
        line = websocket.create_connection(
            f"ws://127.0.0.1:{self.port}", timeout=DEADLINE, suppress_origin=True, **options
        )
        return line, ":".join(map(str, line.sock.getsockname()))

    def wait_for(self, such_that: Callable[[Audit], bool]) -> Audit:
        """Return the first entry for which ``such_that`` is true."""

        def find() -> list[Audit]:
            return [entry for entry in list(self.told) if such_that(entry)][:1]

        what = f"an entry of the audit among {len(self.told)}"
        return self.ros.wait_until(find, DEADLINE, what)[0]


@pytest.fixture(scope="module")
def pair(ros_module: Ros) -> Iterator[Pair]:
    """Start both nodes once."""
    yield Pair(ros_module)


def test_command_of_a_console_is_told_with_its_node(pair: Pair) -> None:
    """``rosservice`` is a node with a name of its own."""
    pair.ros.shell(
        "rosservice", "call", pair.ros.name("twin_controller/command"), "{command: PAUSE}"
    )
    entry = pair.wait_for(lambda entry: entry.what.startswith("PAUSE "))
    assert "rosservice" in entry.who and entry.outcome


def test_command_over_the_web_socket_is_told_with_role_and_address(pair: Pair) -> None:
    """The gateway's own name would say nothing about who it was."""
    line, address = pair.client()
    name = pair.ros.name("twin_controller/command")
    line.send(
        json.dumps({"op": "call_service", "id": "c", "service": name, "args": {"command": "STOP"}})
    )
    assert json.loads(line.recv())["id"] == "c"
    entry = pair.wait_for(lambda entry: entry.what.startswith("STOP "))
    assert entry.who == f"{pair.ros.name('gateway')}/operator@{address}" and entry.outcome
    line.close()


def test_what_a_client_publishes_and_what_is_refused_is_told(pair: Pair) -> None:
    """The twin controller knows nothing of what goes to the twin or is not let through."""
    name = pair.ros.name("motion_command")
    line, address = pair.client()
    line.send(json.dumps({"op": "publish", "topic": name, "msg": {"command": 1}}))
    entry = pair.wait_for(lambda entry: entry.who.endswith(address))
    assert (entry.what, entry.success) == (f'publish {name} {{"command":1}}', True)
    line.close()
    line, address = pair.client(header=["Authorization: Bearer look"])
    line.send(json.dumps({"op": "publish", "topic": name, "msg": {}}))
    entry = pair.wait_for(lambda entry: entry.who.endswith(address))
    assert entry.who == f"{pair.ros.name('gateway')}/viewer@{address}" and not entry.success
    assert entry.outcome == f"role viewer may not publish {name}"
    line.close()
