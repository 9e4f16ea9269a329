"""A live gateway between a ROS master and web-socket clients."""

from __future__ import annotations

from typing import Any

from harness.processes import Process
from harness.ros import Ros
from harness.wires.gateway_client import RosbridgeClient, connect

DEADLINE = 10.0
TOKENS = {"SCARA_VIEWER_TOKEN": "look", "SCARA_OPERATOR_TOKEN": "drive"}


class RunningGateway:
    """The node ``gateway`` on a port of its own, and its clients."""

    def __init__(
        self, ros: Ros, *args: str, port: int = 0, env: dict[str, str] | None = None
    ) -> None:
        self.ros = ros
        self.port = port or ros.free_port()
        self.node: Process = ros.run(
            "rosbridge_gateway", "gateway", f"_port:={self.port}", *args, env=TOKENS | (env or {})
        )
        ros.wait_until(
            lambda: f"on 127.0.0.1:{self.port}" in self.node.output, 20.0, "the gateway's port"
        )
        self.clients: list[RosbridgeClient] = []

    def client(self, **options: Any) -> RosbridgeClient:
        """Connect."""
        self.clients.append(connect(self.port, **options))
        return self.clients[-1]

    def end_clients(self) -> None:
        """Close what has been connected so far."""
        for client in self.clients:
            client.line.close(timeout=0.2)
        self.clients.clear()
