"""Short questions to a cell over its web socket: a tool of ROS takes half a second for each."""

from __future__ import annotations

import contextlib
import json
from typing import Any

import websocket

TIMEOUT_S = 5.0


def mode_over(port: int) -> str:
    """Return the twin controller's mode, empty if the gateway cannot tell it now.

    It needs no ROS master once the gateway has subscribed.
    """
    return str(state_over(port).get("mode", ""))


def state_over(port: int) -> dict[str, Any]:
    """Return the fields of twin_controller/state, empty if the gateway cannot tell it now."""
    with contextlib.suppress(OSError, websocket.WebSocketException), _line(port) as line:
        line.send(json.dumps({"op": "subscribe", "topic": "twin_controller/state"}))
        packet = json.loads(line.recv())
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
        with _line(port) as line:
            service, arguments = "twin_controller/command", {"command": command}
            line.send(json.dumps({"op": "call_service", "service": service, "args": arguments}))
            packet = json.loads(line.recv())
    except (OSError, websocket.WebSocketException) as error:
        raise AssertionError(f"{command} over the gateway: {error}") from error
    assert packet.get("result") is True, packet
    values: dict[str, Any] = packet["values"]
    return values


def _line(port: int) -> contextlib.closing[websocket.WebSocket]:
    address = f"ws://127.0.0.1:{port}"
    return contextlib.closing(
        websocket.create_connection(address, timeout=TIMEOUT_S, suppress_origin=True)
    )
