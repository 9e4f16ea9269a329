"""The one starter of a cell's nodes; what differs from world to world is data.

Which nodes, relays and ports, which robot, plant and settings (the environment), which further
arguments. :class:`harness.faults.fault_cell.FaultCell` looks at its cell from within ROS,
:class:`harness.live_cell.LiveCell` from outside, as a user does. A cell in virtual time has no
process to start: it shares files and ways out, and ends there (:mod:`harness.virtual_cell`).
"""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from scara_config.profile import CHOICE

from harness.processes import Process, Stage, free_port
from harness.wires.proxy import modbus_units, websocket_units
from harness.wires.relay import Relay

PACKAGES = {
    "emulator": "fanuc_emulator",
    "simulator": "scara_simulation",
    "gateway": "rosbridge_gateway",
    "joint_pose_controller": "scara_control",
    "twin_controller": "twin_controller",
    "recorder": "cell_recorder",
    "motion_server": "scara_control",
    "kinematics_server": "scara_control",
    "joint_vel_controller": "scara_control",
    "trajectory_server": "scara_control",
    # What people use.
    "what_if": "what_if",
    "operator_panel": "operator_panel",
    "health_watch": "twin_analysis",
    "robot_state_publisher": "scara_description",
}
WAYS_OUT = {"FAULT": "RESET", "ESTOP": "RESET", "STOPPED": "ALIGN", "PAUSED": "STOP"}


def way_out(mode: str) -> str:
    """Return the command by which an operator leads a pair on to IDLE; empty: none is needed."""
    return "STOP" if mode.endswith("_LEADS") else WAYS_OUT.get(mode, "")


@contextmanager
def chosen(robot: str) -> Iterator[None]:
    """Choose a robot for a while; the loaders read the choice from the environment."""
    before = os.environ.get(CHOICE)
    os.environ[CHOICE] = robot
    try:
        yield
    finally:
        del os.environ[CHOICE]
        if before is not None:
            os.environ[CHOICE] = before


class Cell:
    """Nodes of one cell, each a process of its own.

    Attributes:
        stage: Where they run; a failed test shows their last lines.
        environment: Of each node and tool, beside that of the stage.
        arguments: Further ones, by node.
        modbus_port: The robot's own.
        gateway_port: The gateway's own.
        relays: Before the robot (``modbus``) and the gateway (``web``); the twin controller uses
            those that are there when it starts.
        processes: By node, the newest of each.
    """

    def __init__(self, stage: Stage, environment: Mapping[str, str]) -> None:
        """Choose ports; nothing is started yet."""
        self.stage, self.environment = stage, dict(environment)
        self.modbus_port, self.gateway_port = free_port(), free_port()
        self.arguments: dict[str, tuple[str, ...]] = {}
        self.relays: dict[str, Relay] = {}
        self.processes: dict[str, Process] = {}

    def put_relays(self, *wires: str) -> None:
        """Put relays before ``modbus``, ``web`` or both."""
        servers = {
            "modbus": (self.modbus_port, modbus_units),
            "web": (self.gateway_port, websocket_units),
        }
        self.relays |= {wire: Relay(*servers[wire]) for wire in wires}

    @property
    def modbus(self) -> Relay:
        """The relay between twin controller and robot."""
        return self.relays["modbus"]

    @property
    def web(self) -> Relay:
        """The relay between twin controller and gateway."""
        return self.relays["web"]

    def start_node(self, node: str, *prefix: str, env: Mapping[str, str] | None = None) -> Process:
        """Start a node (again); ``prefix`` is a command that runs it, ``env`` is its alone."""
        doors = {"modbus": self.modbus_port, "web": self.gateway_port}
        doors |= {wire: relay.port for wire, relay in self.relays.items()}
        words = {
            "emulator": (f"_port:={self.modbus_port}",),
            "gateway": (f"_port:={self.gateway_port}",),
            "twin_controller": (
                f"_modbus_port:={doors['modbus']}",
                f"_gateway_url:=ws://127.0.0.1:{doors['web']}",
            ),
        }.get(node, ())
        command = ("rosrun", PACKAGES[node], node, *words, *self.arguments.get(node, ()))
        own = {**self.environment, **(env or {})}
        process = self.stage.start(*prefix, *command, name=node, env=own)
        self.processes[node] = process
        return process

    def kill(self, node: str) -> float:
        """End a node without a farewell; return when (ROS time)."""
        now = self._signal(node, signal.SIGKILL)
        self.processes[node].wait(5.0)
        return now

    def stop(self, node: str) -> float:
        """Let a node stand still as a process; return when (ROS time)."""
        return self._signal(node, signal.SIGSTOP)

    def go_on(self, node: str) -> float:
        """Let a stopped node run again; return when (ROS time)."""
        return self._signal(node, signal.SIGCONT)

    def _signal(self, node: str, number: signal.Signals) -> float:
        now = time.time()
        self.processes[node].signal(number)
        return now

    def tool(self, *command: str, timeout: float = 60.0) -> str:
        """Run a command line tool to its end and return what it printed; fail if it fails."""
        return self.stage.tool(*command, timeout=timeout, env=self.environment)

    def pendant(self, *words: str) -> str:
        """Use the robot's own pendant, which has a line of its own."""
        port = ("--port", str(self.modbus_port))
        return self.tool("rosrun", "fanuc_emulator", "pendant", *words, *port)

    def memory(self, node: str) -> float:
        """Return a node's resident memory [MB]."""
        pages = Path(f"/proc/{self.processes[node].pid}/statm").read_text().split()[1]
        return int(pages) * 4096 / 1e6

    def release(self) -> None:
        """End the relays, and let all go on that stands still, so that it can be ended."""
        for relay in self.relays.values():
            relay.close()
        for node in self.processes:
            self.go_on(node)
