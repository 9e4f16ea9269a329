"""A cell that can be broken.

Each node a process of its own, a relay on both wires of the twin controller, everything watched.
"""

from __future__ import annotations

import concurrent.futures
import contextlib
import signal
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from scara_config import load_robot
from scara_config.loader import OVERRIDE
from scara_config.profile import SETTINGS_CHOICE

from harness.plants.known_robot import known_robot
from harness.processes import Process, Stage, free_port, wait_until
from harness.ros import Ros
from harness.wires.motion import Motion
from harness.wires.operator_page import TOKEN, VARIABLE
from harness.wires.proxy import modbus_units, websocket_units
from harness.wires.relay import Relay
from harness.workspace import ROOT

ROBOT = load_robot(ROOT / "config")
NODES = ("emulator", "simulator", "gateway", "joint_pose_controller", "twin_controller", "recorder")
PACKAGES = {
    "emulator": "fanuc_emulator",
    "simulator": "scara_simulation",
    "gateway": "rosbridge_gateway",
    "joint_pose_controller": "scara_control",
    "twin_controller": "twin_controller",
    "recorder": "cell_recorder",
    # Started by a storm only.
    "motion_server": "scara_control",
    "kinematics_server": "scara_control",
    "joint_vel_controller": "scara_control",
    "trajectory_server": "scara_control",
}
SET_UPS = (
    "",
    "cstopi_for_abort: false",
    "imstp_assigned: false",
    "cstopi_for_abort: false, imstp_assigned: false",
)
"""How the robot was set up, where it is not as filed; the last is one that only HOLD stops."""
THERE, BACK = (1.2, 1.0, -0.10, 0.8), (0.0, 0.0, -0.16, 0.0)


class FaultCell:
    """A running cell; a context manager.

    Attributes:
        modbus: The relay between twin controller and robot.
        web: The relay between twin controller and gateway.
        real: The robot's true motion, from the stand-in's ground truth.
        twin: The twin's motion.
        states: All states of the twin controller, newest last.
        decisions: All its decisions.
    """

    def __init__(self, ros: Ros, environment: Mapping[str, str] | None = None) -> None:
        """Choose ports; ``start`` starts the nodes, with ``environment`` beside that of ``ros``.

        Without one its twin controller knows the robot: its first move is as fast as the others.
        All nodes know the token of the operator's page.
        """
        self.ros = ros
        config = ros.folder / "known_robot"
        given = environment or {OVERRIDE: str(known_robot(config))}
        self.environment = {VARIABLE: TOKEN, **given}
        self.ports = {"emulator": free_port(), "gateway": free_port()}
        self.modbus = Relay(self.ports["emulator"], modbus_units)
        self.web = Relay(self.ports["gateway"], websocket_units)
        self.processes: dict[str, Process] = {}
        self.states: deque[Any] = deque(maxlen=2000)
        self.decisions: deque[Any] = deque(maxlen=5000)
        self._subscribers: list[Any] = []
        self.real = Motion([joint.name for joint in ROBOT.twin_joints])
        self.twin = Motion([joint.name for joint in ROBOT.twin_joints])

    def __enter__(self) -> FaultCell:
        for node in NODES:
            self.start(node)
        self._watch()
        wait_until(self._is_ready, 60.0, "an idle cell", period=0.1)
        self.pendant("override", "100")
        wait_until(lambda: self.states[-1].speed_limited is False, 5.0, "override 100 %")
        return self

    def __exit__(self, *_: object) -> None:
        for subscriber in self._subscribers:
            subscriber.unregister()
        self.modbus.close()
        self.web.close()
        for process in self.processes.values():
            process.signal(signal.SIGCONT)

    @property
    def stage(self) -> Stage:
        """The processes, whose last lines a failed test shows."""
        return self.ros.stage

    def _is_ready(self) -> bool:
        return self._alive() and bool(self.states) and self._recovered()

    def _alive(self) -> bool:
        for process in self.processes.values():
            assert process.poll() is None, (
                f"{process} ended with {process.poll()}:\n{process.tail()}"
            )
        return True

    def start(self, node: str, *prefix: str) -> Process:
        """Start a node (again); ``prefix`` is a command that runs it."""
        words = {
            "emulator": (f"_port:={self.ports['emulator']}",),
            "gateway": (f"_port:={self.ports['gateway']}",),
            "twin_controller": (
                f"_modbus_port:={self.modbus.port}",
                f"_gateway_url:=ws://127.0.0.1:{self.web.port}",
            ),
            "recorder": (f"_directory:={self.ros.folder}",),
        }.get(node, ())
        process = self.ros.stage.start(
            *prefix, "rosrun", PACKAGES[node], node, *words, name=node, env=self.environment
        )
        self.processes[node] = process
        return process

    def kill(self, node: str) -> float:
        """End a node without a farewell; return when (ROS time)."""
        now = time.time()
        self.processes[node].signal(signal.SIGKILL)
        self.processes[node].wait(5.0)
        return now

    def stop(self, node: str) -> float:
        """Let a node stand still as a process; return when (ROS time)."""
        now = time.time()
        self.processes[node].signal(signal.SIGSTOP)
        return now

    def go_on(self, node: str) -> float:
        """Let a stopped node run again; return when (ROS time)."""
        now = time.time()
        self.processes[node].signal(signal.SIGCONT)
        return now

    def set_up(self, settings: str) -> None:
        """Start the robot again, set up otherwise, and lead the pair to IDLE."""
        if self.environment.get(SETTINGS_CHOICE, "") == settings:
            return
        self.environment[SETTINGS_CHOICE] = settings
        self.kill("emulator")
        self.start("emulator")
        self.recover()

    def pendant(self, *words: str) -> str:
        """Use the robot's own pendant, which has a line of its own."""
        return self.ros.shell(
            "rosrun", "fanuc_emulator", "pendant", *words, "--port", str(self.ports["emulator"])
        )

    def command(self, command: str, **fields: Any) -> Any:
        """Call ``twin_controller/command``."""
        from scara_msgs.srv import TwinCommand

        return self.call("twin_controller/command", TwinCommand, command=command, **fields)

    def call(self, service: str, kind: type[Any], timeout: float = 10.0, **fields: Any) -> Any:
        """Call a service of the cell; fail after ``timeout`` [s] or when it is not there."""
        import rospy

        def ask() -> Any:
            return rospy.ServiceProxy(self.ros.name(service), kind)(**fields)

        with concurrent.futures.ThreadPoolExecutor(1) as pool:
            future = pool.submit(ask)
            try:
                return future.result(timeout)
            except rospy.ServiceException as error:
                raise AssertionError(f"{service}: {error}") from error
            except TimeoutError:
                raise AssertionError(f"{service}: no answer within {timeout:g} s") from None

    @property
    def mode(self) -> str:
        """The twin controller's newest mode, empty before the first."""
        return str(self.states[-1].mode) if self.states else ""

    def wait_for(self, mode: str, timeout: float = 30.0) -> None:
        """Wait until the controller is in ``mode`` now, by a state younger than half a second."""

        def there() -> bool:
            return self.mode == mode and time.time() - self.states[-1].header.stamp.to_sec() < 0.5

        wait_until(
            there,
            timeout,
            f"{mode}; it is {self.mode}: {self.states[-1].why if self.states else ''}",
        )

    def move(self, speed_percent: float = 15.0) -> None:
        """Make sure of an idle cell, then :meth:`go`."""
        self.recover()
        self.go(speed_percent)

    def go(self, speed_percent: float = 15.0, left_percent: float | None = None) -> None:
        """Let the operator move both sides to the further of two poses.

        Wait until the robot is under way.

        Args:
            speed_percent: What is asked for.
            left_percent: What may be left of it at least, where something limits the speed.
        """
        target = self.farther_pose()
        answer = self.command("MOVE_JOINTS", joint_positions=target, speed_percent=speed_percent)
        assert answer.success, answer.message
        shown = 0.6e-2 * (speed_percent if left_percent is None else left_percent)
        wait_until(lambda: self.real.under_way(shown, 0.1), 8.0, "a robot under way")

    def farther_pose(self) -> Sequence[float]:
        """Return the further of two poses, so that a move to it takes a while."""
        here = self.twin.position()
        return max((THERE, BACK), key=lambda pose: abs(pose[0] - here[0]))

    def until(self, condition: Callable[[], bool], timeout: float, what: str = "") -> None:
        """Wait for ``condition``, which may fail meanwhile."""

        def quiet() -> bool:
            with contextlib.suppress(AssertionError):
                return condition()
            return False

        wait_until(quiet, timeout, what, period=0.2)

    def lost(self, since: float, timeout: float = 5.0) -> float:
        """Wait for LINK_LOST after ``since`` and return when it was decided (ROS time)."""
        return self.noticed(since, timeout, ("LINK_LOST",))

    def noticed(
        self, since: float, timeout: float = 5.0, events: Sequence[str] = ("LINK_LOST", "REJECTED")
    ) -> float:
        """Wait for the first of these decisions after ``since`` and return when it was made.

        Each of them stops both.
        """
        found = wait_until(
            lambda: [d for d in self.decided(since) if d.event in events],
            timeout,
            f"{' or '.join(events)}; mode {self.mode}",
        )
        return float(found[0].header.stamp.to_sec())

    def decided(self, since: float) -> list[Any]:
        """Return the decisions made after ``since`` (ROS time)."""
        return [d for d in list(self.decisions) if d.header.stamp.to_sec() > since]

    def recover(self, timeout: float = 60.0) -> None:
        """Lead the cell out of whatever happened, as an operator would, until it is idle."""
        self.modbus.heal()
        self.web.heal()
        self.until(self._recovered, timeout, f"IDLE; it is {self.mode}: {self.states[-1].why}")

    def _recovered(self) -> bool:
        if time.time() - self.states[-1].header.stamp.to_sec() > 0.5:
            return False
        leads = "STOP" if self.mode.endswith("_LEADS") else ""
        command = {"FAULT": "RESET", "ESTOP": "RESET", "STOPPED": "ALIGN", "PAUSED": "STOP"}.get(
            self.mode, leads
        )
        if command:
            self.command(command)
        return self.mode == "IDLE"

    def _watch(self) -> None:
        import rospy
        from sensor_msgs.msg import JointState

        from scara_msgs.msg import Decision, TwinControllerState

        for topic, kind, kept in (
            ("twin_controller/state", TwinControllerState, self.states),
            ("twin_controller/decisions", Decision, self.decisions),
            ("real/ground_truth", JointState, self.real.messages),
            ("twin/joint_states", JointState, self.twin.messages),
        ):
            name = self.ros.name(topic)
            self._subscribers.append(
                rospy.Subscriber(name, kind, kept.append, queue_size=1000, tcp_nodelay=True)
            )

    def memory(self, node: str) -> float:
        """Return a node's resident memory [MB]."""
        pages = Path(f"/proc/{self.processes[node].pid}/statm").read_text().split()[1]
        return int(pages) * 4096 / 1e6
