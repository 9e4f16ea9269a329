"""A rosbridge client of few words, and short questions: a tool of ROS takes half a second each."""

from __future__ import annotations

import contextlib
import json
import time
from typing import Any

import websocket
from typing_extensions import Self
from websocket import ABNF

TIMEOUT_S = 5.0
DEADLINE_S = 10.0


class RosbridgeClient:
    """A client of a gateway; a context manager."""

    def __init__(self, line: websocket.WebSocket) -> None:
        """Speak over a line that is open."""
        self.line = line
        self.held: list[dict[str, Any]] = []
        """What came between a subscription and the proof that it is done."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Leave."""
        self.line.close()

    def say(self, **packet: Any) -> None:
        """Send a packet."""
        self.line.send(json.dumps(packet))

    def hear(self, op: str = "") -> dict[str, Any]:
        """Return the next packet, or the next with this op, within the line's time-out.

        Each ping would let the line's own ``recv`` wait anew.
        """
        limit = float(self.line.gettimeout() or DEADLINE_S)
        end = time.monotonic() + limit
        while time.monotonic() < end:
            kind, frame = self.line.recv_data_frame(control_frame=True)
            if kind in (ABNF.OPCODE_PING, ABNF.OPCODE_PONG):
                continue
            packet: dict[str, Any] = json.loads(b"" if kind == ABNF.OPCODE_CLOSE else frame.data)
            if op in ("", packet.get("op")):
                return packet
        raise TimeoutError(f"no packet {op} within {limit:g} s")

    def ask(self, **packet: Any) -> dict[str, Any]:
        """Send a packet and return the next that comes."""
        self.say(**packet)
        return self.hear()

    def time(self) -> dict[str, Any]:
        """Ask for the time.

        Proves that the session lives and that all before has been performed.
        """
        return self.ask(op="call_service", id="time", service="/rosapi/get_time")

    def call(self, service: str, args: Any = None, **more: Any) -> dict[str, Any]:
        """Call a service and wait for its answer."""
        self.say(op="call_service", id="call", service=service, args=args or {}, **more)
        return self.hear("service_response")

    def subscribe(self, topic: str, kind: str | None = None, **more: Any) -> None:
        """Subscribe, and wait until it has been done."""
        self.say(op="subscribe", topic=topic, **({"type": kind} if kind else {}), **more)
        self.say(op="call_service", id="done", service="/rosapi/get_time")
        held = []
        while (packet := self.hear()).get("id") != "done":
            held.append(packet)
        assert not [packet for packet in held if packet["op"] == "status"], held
        self.held = held


def connect(
    port: int, timeout: float = DEADLINE_S, path: str = "", **options: Any
) -> RosbridgeClient:
    """Connect to a gateway of this machine; as a program, without an origin, unless one is given.

    Raises:
        OSError, websocket.WebSocketException: It cannot be reached, or refuses.
    """
    options.setdefault("suppress_origin", "origin" not in options)
    url = f"ws://127.0.0.1:{port}/{path}"
    return RosbridgeClient(websocket.create_connection(url, timeout=timeout, **options))


def mode_over(port: int) -> str:
    """Return the twin controller's mode, empty if the gateway cannot tell it now.

    It needs no ROS master once the gateway has subscribed.
    """
    return str(state_over(port).get("mode", ""))


def state_over(port: int) -> dict[str, Any]:
    """Return the fields of twin_controller/state, empty if the gateway cannot tell it now."""
    with (
        contextlib.suppress(OSError, websocket.WebSocketException),
        connect(port, TIMEOUT_S) as client,
    ):
        packet = client.ask(op="subscribe", topic="twin_controller/state")
        # Else it is a status: nobody offers the topic yet, and the gateway has said so.
        if packet["op"] == "publish":
            state: dict[str, Any] = packet["msg"]
            return state
    return {}


def command_over(port: int, command: str) -> dict[str, Any]:
    """Give the twin controller one command and return its answer.

    Raises:
        AssertionError: The gateway did not answer, or refused the call.
    """
    try:
        with connect(port, TIMEOUT_S) as client:
            packet = client.call("twin_controller/command", {"command": command})
    except (OSError, websocket.WebSocketException) as error:
        raise AssertionError(f"{command} over the gateway: {error}") from error
    assert packet.get("result") is True, packet
    values: dict[str, Any] = packet["values"]
    return values
