"""A whole cell with a judge that is asked for refused motions by all doors; wires are counted."""

from __future__ import annotations

import contextlib
import itertools
import json
import queue
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import websocket
from scara_config.modbus_map import load_modbus_map
from typing_extensions import Self
from what_if.cell_files_io import resting_cell
from what_if.judging import LIMITING, judge
from what_if.motions import JointTarget, ToolTarget
from what_if.verdict import Cause, Outcome, Verdict

from harness.live_cell import LiveCell
from harness.processes import wait_until
from harness.second_world.gated_nodes import FREE, HOME, PATIENCE_MS
from harness.wires.damage import Piece
from harness.wires.proxy import modbus_units
from harness.wires.relay import Relay
from harness.yaml_files import CONFIG, changed_yaml, copy_configuration

READY_S, LONG_S = 120.0, 40.0
DEEP_M = 0.008
"""Refused targets lie up to so deep in the pallet [m]; joint_3 gets no further down."""
JUDGED = "REFUSED at"
"""What the judge's sentence begins with."""
QUIET_S = 1.0
"""A cell that has sent no set point for so long stands."""
SETPOINTS = "twin/joint_setpoints"
HEARD_MS = 100
"""One set point in so long is heard: it tells as well that some were sent."""
WRITE, READ_AND_WRITE = 16, 23
"""Function codes of Modbus that write registers."""
WRITTEN_AT = {WRITE: 8, READ_AND_WRITE: 12}
"""Where such a request says the first register, and behind it how many."""


@dataclass
class SetpointWrites:
    """Let everything pass, and count the requests that write set points of the robot.

    Attributes:
        places: First register and the one behind the last, of each block, as requests count them.
        report: The count.
    """

    places: tuple[tuple[int, int], ...]
    report: dict[str, float] = field(default_factory=lambda: {"setpoints": 0.0})

    def __call__(self, unit: bytes, answers: bool) -> list[Piece]:
        """Look at a request."""
        at = WRITTEN_AT.get(unit[7]) if not answers and len(unit) > 7 else None
        if at is not None:
            first, count = (int.from_bytes(unit[k : k + 2], "big") for k in (at, at + 2))
            hit = any(first < end and begin < first + count for begin, end in self.places)
            self.report["setpoints"] += hit
        return [(0.0, unit)]


def setpoint_places() -> tuple[tuple[int, int], ...]:
    """Return where the shipped robot takes set points."""
    registers = load_modbus_map(CONFIG).holding_registers
    found = (registers[name] for name in ("setpoint", "ring_setpoint") if name in registers)
    return tuple((each.offset, each.offset + each.words) for each in found)


Target = tuple[float, ...]


def refused_targets(count: int) -> tuple[list[Target], list[Target]]:
    """Return where no move from home may lead, and nobody but the judge knows it.

    All are within reach and ranges and off all zones: the nozzle would go into the pallet.

    Returns:
        So many places of the tool [m], and as many joint positions.
    """
    rng = np.random.default_rng(11)
    points: list[Target] = []
    joints: list[Target] = []
    with resting_cell(CONFIG) as (world, _):
        assert world.cell.work is not None
        pallet = world.cell.work.pallet
        middle = 1e-3 * np.array((*pallet.middle_mm, pallet.top_mm))
        half = np.array((*(0.4e-3 * size for size in pallet.size_mm), DEEP_M))
        while len(joints) < count:
            x, y, z = (middle + rng.uniform(-1.0, (1.0, 1.0, -0.3)) * half).tolist()
            verdict = judge(world, ToolTarget(x, y, z))
            if _is_harm(verdict) and len(points) <= len(joints):
                points.append((x, y, z))
            elif _is_harm(verdict) and _is_harm(judge(world, JointTarget(verdict.target))):
                joints.append(verdict.target)
    return points, joints


def _is_harm(verdict: Verdict) -> bool:
    """Return whether a motion is refused, and only for bodies that would hit each other."""
    causes = {reason.cause for reason in verdict.reasons}
    return verdict.outcome is Outcome.REFUSED and causes <= {Cause.COLLISION, *LIMITING}


def refused_requests(count: int) -> list[tuple[str, dict[str, Any]]]:
    """Return services and requests that must not move anything: each door in its turn."""
    each = -(-count // 4)
    requests: list[list[tuple[str, dict[str, Any]]]] = []
    command = "twin_controller/command"
    points, targets = refused_targets(2 * each)
    for k in range(each):
        x, y, z = points[2 * k]
        place = dict(zip("xyz", points[2 * k + 1]))
        requests.append(
            [
                (command, {"command": "MOVE", "x": x, "y": y, "z": z}),
                (command, {"command": "MOVE_JOINTS", "joint_positions": targets[2 * k]}),
                ("move_to", place),
                ("joint_pose_controller/move", {"joint_positions": targets[2 * k + 1]}),
            ]
        )
    return list(itertools.chain.from_iterable(requests))[:count]


class RefusingCell:
    """The cell; a context manager. It is asked over its web socket, as a gateway's client does."""

    def __init__(self, folder: Path) -> None:
        """Choose ports; nothing is started yet."""
        self.config = copy_configuration(folder / "changed")
        what_if = self.config / "what_if.yaml"
        changed_yaml(what_if, self.config, ["gate_timeout_ms"], PATIENCE_MS)
        self.cell = LiveCell(folder)
        self._numbers = itertools.count(1)
        self._answers: queue.Queue[dict[str, Any]] = queue.Queue()
        self._ends = contextlib.ExitStack()
        self.setpoints = 0
        """So many set points of the motion nodes were heard."""

    def __enter__(self) -> Self:
        self._relay = Relay(self.cell.modbus_port, modbus_units)
        self._ends.callback(self._relay.close)
        self._ends.callback(self.cell.close)
        try:
            self._start()
        except BaseException:
            self._ends.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._ends.close()

    def _start(self) -> None:
        words = ("up", "--without", "twin_controller")
        bringup = self.cell.start(*words, env={"SCARA_CONFIG_DIR": str(self.config)})
        self.cell.wait_ready(bringup, READY_S)
        env = {"SCARA_CONFIG_DIR": str(self.cell.output / "config")}
        start = self.cell.stage.start
        judge_node = start("rosrun", "what_if", "what_if", env=env)
        port = f"_modbus_port:={self._relay.port}"
        # What is tested is what is refused, not how soon a late process is missed.
        start("rosrun", "twin_controller", "twin_controller", port, "_links:=desk", env=env)
        wait_until(lambda: "is ready" in judge_node.output, LONG_S, "a judge")
        self.cell.make_ready()
        address = f"ws://127.0.0.1:{self.cell.gateway_port}"
        self._line = websocket.create_connection(address, timeout=LONG_S, suppress_origin=True)
        reader = threading.Thread(target=self._read, name="refusing")
        reader.start()
        self._ends.callback(reader.join)
        self._ends.callback(self._line.abort)
        # Each has up to 14 kB, a hundred come a second: who is late with them is left.
        heard = {"op": "subscribe", "topic": SETPOINTS, "throttle_rate": HEARD_MS}
        self._line.send(json.dumps(heard))
        self._relay.disturb(SetpointWrites(setpoint_places()))
        wait_until(self._is_quiet, LONG_S, "a cell that stands")

    def _is_quiet(self) -> bool:
        """Return whether no set point was sent for a while, and forget those before."""
        self.setpoints, begin, writes = 0, time.monotonic(), self.writes
        while not self.setpoints and time.monotonic() < begin + QUIET_S:
            self._drain()
        return not self.setpoints and self.writes == writes

    @property
    def writes(self) -> int:
        """So many requests wrote set points into the robot."""
        return int(self._relay.report()["setpoints"])

    def ask(self, service: str, request: dict[str, Any]) -> dict[str, Any]:
        """Call a service over the gateway; set points that come meanwhile are counted."""
        number = f"refusing:{next(self._numbers)}"
        call = {"op": "call_service", "service": service, "args": request, "id": number}
        self._line.send(json.dumps(call))
        while True:
            packet = self._answers.get(timeout=LONG_S)
            if packet.get("id") == number:
                values = packet["values"]
                return values if isinstance(values, dict) else {"message": str(values)}

    def _read(self) -> None:
        """Take what comes, all the time: the gateway leaves a client that takes nothing for 1 s."""
        with contextlib.suppress(OSError, websocket.WebSocketException):
            while True:
                packet = json.loads(self._line.recv())
                if packet["op"] == "publish":
                    self.setpoints += packet["topic"].endswith(SETPOINTS)
                elif packet["op"] == "service_response":
                    self._answers.put(packet)

    def refuse(self, requests: Sequence[tuple[str, dict[str, Any]]]) -> list[str]:
        """Ask for refused motions; return what was not refused."""
        wrong = []
        for service, request in requests:
            answer = self.ask(service, request)
            if answer.get("success") is not False or JUDGED not in answer.get("message", ""):
                wrong.append(f"{service} {request}: {answer}")
        return wrong

    def move(self) -> None:
        """Make a free move there and back, by the twin controller."""
        for target in (FREE, HOME):
            request = {"command": "MOVE_JOINTS", "joint_positions": target}
            answer = self.ask("twin_controller/command", request)
            assert answer.get("success") is True, answer
            wait_until(lambda target=target: self._has_come(target), LONG_S, f"{target}, at rest")
        self._drain()

    def _has_come(self, target: Target) -> bool:
        """Return whether the robot stands there and the pair is ready for the next motion.

        The mode alone does not tell: a motion may end between two looks.
        """
        shoulder_elbow = np.rad2deg(target[:2])
        at_place = np.allclose(self.cell.real_joints()[:2], shoulder_elbow, atol=0.1)
        return bool(at_place) and self.cell.mode() == "IDLE"

    def _drain(self) -> None:
        """Read what the gateway has sent by now: it comes before this answer."""
        self.ask("twin_controller/why", {"count": 1})
