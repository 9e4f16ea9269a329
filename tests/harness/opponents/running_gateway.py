"""A live gateway between a ROS master and web-socket clients."""

from __future__ import annotations

import json
from typing import Any

import websocket

from harness.processes import Process
from harness.ros import Ros

DEADLINE = 10.0
TOKENS = {"SCARA_VIEWER_TOKEN": "look", "SCARA_OPERATOR_TOKEN": "drive"}


class RosbridgeClient:
    """A rosbridge client of few words."""

    def __init__(self, port: int, **options: Any) -> None:
        options.setdefault("suppress_origin", True)  # a program, no page
        self.line = websocket.create_connection(
            f"ws://127.0.0.1:{port}", timeout=DEADLINE, **options
        )

    def say(self, **packet: Any) -> None:
        """Send a packet."""
        self.line.send(json.dumps(packet))

    def hear(self, op: str = "") -> dict[str, Any]:
        """Return the next packet, or the next with this op."""
        while True:
            packet: dict[str, Any] = json.loads(self.line.recv())
            if op in ("", packet["op"]):
                return packet

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


class RunningGateway:
    """The node ``gateway`` on a port of its own, and its clients."""

    def __init__(self, ros: Ros, *args: str, port: int = 0) -> None:
        self.ros = ros
        self.port = port or ros.free_port()
        self.node: Process = ros.run(
            "rosbridge_gateway", "gateway", f"_port:={self.port}", *args, env=TOKENS
        )
        ros.wait_until(
            lambda: f"on 127.0.0.1:{self.port}" in self.node.output, 20.0, "the gateway's port"
        )
        self.clients: list[RosbridgeClient] = []

    def client(self, **options: Any) -> RosbridgeClient:
        """Connect."""
        self.clients.append(RosbridgeClient(self.port, **options))
        return self.clients[-1]

    def end_clients(self) -> None:
        """Close what has been connected so far."""
        for client in self.clients:
            client.line.close(timeout=0.2)
        self.clients.clear()
