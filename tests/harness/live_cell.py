"""A whole cell as a user starts it.

What ``rosrun scara_bringup cell`` starts, on free ports, in an environment of its own.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

from rosgraph.names import resolve_name
from ruamel.yaml import YAML
from scara_ros.services.service_connection_io import ServiceError
from scara_ros.shell.program_io import command_of
from typing_extensions import Self

from harness.processes import Process, Stage, free_port, wait_until
from harness.running.repeats import played
from harness.starter import Cell, way_out
from harness.wires.gateway_client import command_over, mode_over
from harness.wires.service_line import ServiceLine
from harness.workspace import workspace_environment

NODES = (
    *("simulator", "gateway", "kinematics_server", "joint_pose_controller"),
    *("joint_vel_controller", "motion_server", "trajectory_server", "emulator"),
    *("twin_controller", "recorder", "journal"),
)
FOR_PEOPLE = (
    *("robot_state_publisher", "camera", "operator_panel", "pendant_page", "what_if"),
    "health_watch",
)
"""Their tests start them themselves."""


class LiveCell(Cell):
    """One bring-up and the tools around it; nodes that are started beside it use its files."""

    bringup: Process

    def __init__(
        self, folder: Path, master_uri: str | None = None, namespace: str | None = None
    ) -> None:
        """Choose ports; nothing is started yet. ``master_uri``: a master that runs already."""
        self.folder = folder
        self.output = folder / "output"
        self.master_port = None if master_uri else free_port()
        self.master_uri = master_uri or f"http://127.0.0.1:{self.master_port}"
        env = {**workspace_environment(), "ROS_MASTER_URI": self.master_uri}
        self.namespace = f"/{(namespace or '').strip('/')}".rstrip("/")
        if namespace:
            env["ROS_NAMESPACE"] = namespace
        stage = Stage(folder / "processes", env)
        super().__init__(stage, {"SCARA_CONFIG_DIR": str(self.output / "config")})

    def start(
        self,
        verb: str = "up",
        *arguments: str,
        env: dict[str, str] | None = None,
        choose_output: bool = True,
        people: bool = False,
    ) -> Process:
        """Start the bring-up.

        Args:
            verb: Of the bring-up.
            arguments: Further ones.
            env: Beside the environment of this cell.
            choose_output: Else it chooses its own folder.
            people: Whether ``up`` starts what people use too, pages, camera and judge.
        """
        words = [
            *command_of("scara_bringup", "cell", self.stage.env),
            verb,
            *(["--output", str(self.output)] if choose_output else []),
            *(["--runs", str(self.folder)] if choose_output and verb == "up" else []),
        ]
        words += ["--modbus-port", str(self.modbus_port), "--gateway-port", str(self.gateway_port)]
        words += ["--master-port", str(self.master_port)] if self.master_port else []
        if verb == "up" and not people:
            words += [word for node in FOR_PEOPLE for word in ("--without", node)]
        self.bringup = self.stage.start(*words, *arguments, name=f"cell_{verb}", env=env)
        return self.bringup

    @contextmanager
    def ready(
        self,
        *words: str,
        config: Path | None = None,
        env: Mapping[str, str] | None = None,
        people: bool = False,
        timeout: float = 90.0,
    ) -> Iterator[Self]:
        """Start it as ``up`` does, give it once it is ready, and end it.

        Args:
            words: Further arguments of the bring-up.
            config: Its configuration; None: what is shipped.
            env: Beside the environment of this cell, such as robot and plant.
            people: Whether what people use is started too.
            timeout: Until it is ready [s].
        """
        chosen = {"SCARA_CONFIG_DIR": str(config)} if config else {}
        with closing(self):
            self.wait_ready(
                self.start("up", *words, env={**chosen, **(env or {})}, people=people), timeout
            )
            yield self

    def wait_ready(self, bringup: Process, timeout: float = 90.0) -> None:
        """Wait until the bring-up says that the cell is ready."""

        def ready() -> bool:
            assert bringup.poll() is None, (
                f"the cell ended with {bringup.poll()}:\n{bringup.output}"
            )
            return "cell: ready after" in bringup.output

        wait_until(ready, timeout, f"a ready cell:\n{bringup.output}", period=0.1)

    def call(self, service: str, request: str = "{}", timeout: float = 60.0) -> dict[str, Any]:
        """Return a service's answer to a request in YAML.

        What ``rosservice call`` would print: the tool takes half a second to start.

        Args:
            service: Its name, in the namespace of this cell unless it is a whole one.
            request: Its fields.
            timeout: For its greeting, and for the answer [s].

        Raises:
            AssertionError: It is not there, has failed, or did not answer.
        """
        yaml = YAML(typ="safe")
        name = resolve_name(service, f"{self.namespace}/rosservice")
        try:
            with ServiceLine(self.master_uri, name, None, "/rosservice", timeout) as line:
                answer = yaml.load(str(line.call(timeout, **yaml.load(request))))
        except (OSError, ServiceError) as error:
            raise AssertionError(f"{service} {request}: {error}") from error
        assert isinstance(answer, dict), answer
        return answer

    def tool_call(self, service: str, request: str = "{}") -> dict[str, Any]:
        """Return the answer of ``rosservice call``, without what the tool logs beside it."""
        said = self.tool("rosservice", "call", service, request)
        answer = YAML(typ="safe").load(re.sub(r"^\[[A-Z]+\] \[.*\n", "", said, flags=re.MULTILINE))
        assert isinstance(answer, dict), answer
        return answer

    def real_joints(self) -> list[float]:
        """Read J1..J9 of the robot stand-in with mbpoll, in deg and mm."""
        command = ("mbpoll", "-m", "tcp", "-a", "1", "-p", str(self.modbus_port), "-1", "-q")
        output = self.tool(*command, "-t", "4:float", "-r", "11001", "-c", "9", "127.0.0.1")
        return [float(value) for value in re.findall(r"^\[\d+\]:\s+(\S+)", output, re.MULTILINE)]

    def real_tool(self) -> tuple[float, float, float]:
        """Compute where the stand-in's tool is [m], from its registers by the closed form."""
        return forward(self.real_joints())

    def mode(self) -> str:
        """Return the twin controller's mode, empty if it cannot be told now."""
        return mode_over(self.gateway_port)

    def make_ready(self, timeout: float = 60.0) -> None:
        """Bring the pair to rest and agreement, as an operator would, whatever has stopped it."""

        def ready() -> bool:
            mode = self.mode()
            if command := way_out(mode):
                command_over(self.gateway_port, command)
            return mode == "IDLE"

        wait_until(ready, timeout, "a ready pair", period=0.2)

    def beside_lost_links(self, scene: Callable[[], None]) -> None:
        """Play a scene with a ready pair.

        Again where it failed, the pair lost a link meanwhile and the machine stood still.

        A machine that stands still for a moment looks like a side that is silent, or like a clock
        that jumped: the pair goes OFFLINE and stands, as it should, and an operator would begin
        again.
        """
        log = self.output / "log" / "twin_controller.log"
        lost = [0]

        def begun() -> None:
            self.make_ready()
            lost.append(log.read_text(encoding="utf-8").count("-> OFFLINE"))
            scene()

        played(
            begun,
            may_repeat=lambda: log.read_text(encoding="utf-8").count("-> OFFLINE") > lost[-1],
        )

    def close(self) -> None:
        """End everything; fail if something is left."""
        self.release()
        self.stage.close(grace=20.0)


def forward(joints_deg_mm: list[float]) -> tuple[float, float, float]:
    """Closed form of facts: x = L1 c1 + L2 c12, y = L1 s1 + L2 s12, z = h + q3 [m]."""
    q1, q12 = math.radians(joints_deg_mm[0]), math.radians(joints_deg_mm[0] + joints_deg_mm[1])
    x, y = 0.35 * math.cos(q1) + 0.30 * math.cos(q12), 0.35 * math.sin(q1) + 0.30 * math.sin(q12)
    return x, y, 0.160 + joints_deg_mm[2] / 1000.0


def read_json(file: Path) -> Any:
    """Read a JSON file."""
    return json.loads(file.read_text(encoding="utf-8"))
