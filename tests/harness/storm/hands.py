"""Whoever commands: open doors to every interface of the cell, and a note of each attempt."""

from __future__ import annotations

import contextlib
import json
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import websocket
from fanuc_emulator.pendant.pendant_link_io import PendantLink
from scara_config.modbus_map import load_modbus_map
from scara_ros.services.service_connection_io import ServiceError
from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection

from harness.faults.fault_cell import ROBOT, FaultCell
from harness.processes import wait_until
from harness.storm.names import JOINTS, KINDS
from harness.storm.rules.history import SIDES, Deed
from harness.wires.gateway_client import RosbridgeClient, connect
from harness.wires.operator_page import TOKEN, Panel
from harness.wires.service_line import ServiceLine
from harness.workspace import ROOT

PERIOD_S = 0.05
"""What must be repeated is repeated in this rhythm."""
ANSWER_S = 25.0
"""A move that answers at its end may take so long."""
PAGE_ANSWER_S = 3.0
"""A page whose node stood still answers after it."""
SPARE = 2
"""A request and a stop may leave for the same node while it stands still."""
LISTENERS_S = 20.0
LISTENERS = {"motion_command": 6}
"""Simulator, gateway and all that move the twin; each other topic has one."""
_MAP = load_modbus_map(ROOT / "config")


@dataclass
class Attempt:
    """One deed while it is done; what was never sent is none."""

    name: str
    sides: tuple[str, ...] = SIDES
    waits: bool = False
    sent: float | None = None
    until: float = 0.0
    answered: float | None = None
    success: bool = True
    said: str = ""

    def mark(self) -> None:
        """Note that something leaves now."""
        self.until = time.time()
        self.sent = self.sent or self.until

    def close(self, success: bool, said: str) -> None:
        """Note the answer."""
        self.answered, self.success, self.said = time.time(), success, said

    def deed(self) -> Deed | None:
        """Return what the monitor judges, None if nothing was sent."""
        if self.sent is None:
            return None
        kind = KINDS[self.name]
        return Deed(
            self.name,
            kind,
            self.sent,
            self.until,
            self.answered,
            self.success,
            self.said,
            self.sides,
            self.waits,
        )


class Page:
    """The operator's page with its live connection, which comes again when it is lost."""

    def __init__(self, cell: FaultCell) -> None:
        """Start the page's node and open it as its operator."""
        self._panel = Panel(cell.ros)
        cell.processes["operator_panel"] = self._panel.process
        self._presses = 0
        self._stopped: dict[int, Any] = {}
        self.refused: dict[int, str] = {}
        self._live: ClientConnection | None = None
        self._doors = contextlib.ExitStack()
        self._lock = threading.Lock()

    def press(self) -> int:
        """Return the number of the next press."""
        with self._lock:
            self._presses += 1
            return self._presses

    def open(self) -> ClientConnection:
        """Return the living connection; load the page again where it was lost.

        Raises:
            OSError, WebSocketException: The page cannot be reached.
        """
        with self._lock:
            if self._live is None:
                live = self._panel.live(self._panel.enter())
                self._live = self._doors.enter_context(live)
                threading.Thread(target=self._read, args=(self._live,), daemon=True).start()
            return self._live

    def send(self, **packet: Any) -> None:
        """Send a packet over the living connection; it fails as :meth:`open` does."""
        self.open().send(json.dumps(packet))

    def stopped(self, press: int) -> Any:
        """Return what the page was told of a stop at last, None if it was told nothing."""
        deadline = time.monotonic() + PAGE_ANSWER_S
        while time.monotonic() < deadline:
            told = self._stopped.get(press)
            if told is not None and told["confirmed"]:
                break
            time.sleep(0.01)
        return self._stopped.get(press)

    def close(self) -> None:
        """Leave the page."""
        self._doors.close()

    def _read(self, live: ClientConnection) -> None:
        with contextlib.suppress(OSError, WebSocketException):
            for text in live:
                packet = json.loads(text)
                if "stopped" in packet:
                    self._stopped[packet["stopped"]["press"]] = packet["stopped"]
                elif "refused" in packet:
                    self.refused[packet["refused"]["press"]] = packet["refused"]["why"]
        with self._lock:
            if self._live is live:
                self._live = None


class Hands:
    """Every door of the cell: services, topics, gateway, page, pendant."""

    def __init__(self, cell: FaultCell) -> None:
        """Open what stays open, and wait until somebody listens."""
        self.cell = cell
        self.page = Page(cell)
        web = partial(connect, cell.gateway_port, ANSWER_S)
        self._doors: dict[str, Callable[[], Any]] = {"gateway": web}
        for service, kind in _services().items():
            self._doors[service] = partial(self._line, service, kind)
        self._spare: dict[str, list[Any]] = {}
        self._publishers = {name: self._publisher(name, kind) for name, kind in _topics().items()}
        wait_until(
            lambda: all(
                publisher.get_num_connections() >= LISTENERS.get(topic, 1)
                for topic, publisher in self._publishers.items()
            ),
            LISTENERS_S,
            "listeners on all command topics",
        )
        self.page.open()

    def _publisher(self, topic: str, kind: type[Any]) -> Any:
        import rospy

        return rospy.Publisher(self.cell.ros.name(topic), kind, queue_size=10, tcp_nodelay=True)

    def publish(self, attempt: Attempt, topic: str, message: Any) -> None:
        """Send one message."""
        attempt.mark()
        self._publishers[topic].publish(message)

    def call(self, attempt: Attempt, service: str, **fields: Any) -> None:
        """Call a service and note its answer."""
        with self._opened(service) as line:
            attempt.mark()
            answer = line.call(ANSWER_S, **fields)
        # A stop is acknowledged when it is sent: from then on nothing may begin.
        taken = answer.success or getattr(answer, "sent", False)
        attempt.close(bool(taken), str(answer.message))

    def gateway(self) -> RosbridgeClient:
        """Return a client of the gateway, to be entered."""
        client: RosbridgeClient = self._opened("gateway")
        return client

    def release_control(self) -> None:
        """Let go of the control that the page holds, so that each scene begins without."""
        from scara_msgs.srv import Control

        person, _, session = self.cell.states[-1].holder.partition(" ")
        if person:
            fields = {"person": person, "session": session, "token": TOKEN}
            self.cell.call("twin_controller/control", Control, action="RELEASE", **fields)

    @contextlib.contextmanager
    def lines_open(self) -> Iterator[None]:
        """Keep lines open for what is sent meanwhile: a node that stands still greets nobody."""
        for name, door in self._doors.items():
            with contextlib.suppress(OSError, ServiceError, websocket.WebSocketException):
                self._spare[name] = [door() for _ in range(SPARE)]
        try:
            yield
        finally:
            for lines in self._spare.values():
                while lines:
                    lines.pop().close()

    def _opened(self, name: str) -> Any:
        """Return a line that is open already, or open one."""
        lines = self._spare.get(name)
        return lines.pop() if lines else self._doors[name]()

    def _line(self, service: str, kind: type[Any]) -> ServiceLine:
        return ServiceLine(self.cell.ros.master.uri, self.cell.ros.name(service), kind, "/storm")

    def pendant(self) -> PendantLink:
        """Return the robot's pendant, to be entered."""
        return PendantLink("127.0.0.1", self.cell.modbus_port, _MAP)

    def close(self) -> None:
        """Close all doors."""
        self.page.close()
        for publisher in self._publishers.values():
            publisher.unregister()


def joint(name: str) -> Any:
    """Return what robot.yaml says of a joint."""
    return ROBOT.joint(name)


def _services() -> dict[str, type[Any]]:
    """Return every service that takes commands."""
    from scara_msgs.srv import MoveJoints, MoveTo, TwinCommand

    return {
        "twin_controller/command": TwinCommand,
        "move_to": MoveTo,
        "joint_pose_controller/move": MoveJoints,
    }


def _topics() -> dict[str, type[Any]]:
    """Return every topic that takes commands."""
    from sensor_msgs.msg import JointState
    from std_msgs.msg import Float64

    from control_msgs.msg import FollowJointTrajectoryActionGoal, JointJog
    from scara_msgs.msg import MotionCommand

    found: dict[str, type[Any]] = {
        "joint_pose_controller/target": JointState,
        "joint_vel_controller/command": JointJog,
        "joint_trajectory_action/goal": FollowJointTrajectoryActionGoal,
        "motion_command": MotionCommand,
    }
    for name in JOINTS:
        for loop in ("velocity", "position"):
            found[f"twin/{name}_{loop}_controller/command"] = Float64
    return found
