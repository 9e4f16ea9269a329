"""A cell that can be broken.

Each node a process of its own, a relay on both wires of the twin controller, everything watched.
"""

from __future__ import annotations

import contextlib
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from scara_config import load_robot
from scara_config.loader import OVERRIDE
from scara_config.profile import PLANT_CHOICE, SETTINGS_CHOICE

from harness.plants.known_robot import known_robot
from harness.processes import wait_until
from harness.ros import Ros, with_deadline
from harness.starter import Cell, way_out
from harness.wires.motion import Motion
from harness.wires.operator_page import TOKEN, VARIABLE
from harness.workspace import ROOT

ROBOT = load_robot(ROOT / "config")
NODES = ("emulator", "simulator", "gateway", "joint_pose_controller", "twin_controller", "recorder")
SET_UPS = (
    "",
    "cstopi_for_abort: false",
    "imstp_assigned: false",
    "cstopi_for_abort: false, imstp_assigned: false",
)
"""How the robot was set up, where it is not as filed; the last is one that only HOLD stops."""
NEVER_APART = 1.0
"""The sides of an idle pair are nearer to each other than this [deg or mm]."""
THERE_ENOUGH = 0.01
"""Who is nearer to a pose than this [rad or m] has come there."""
THERE, BACK = (1.2, 1.0, -0.10, 0.8), (0.0, 0.0, -0.16, 0.0)


class FaultCell(Cell):
    """A running cell in a test's namespace; a context manager.

    Attributes:
        real: The robot's true motion, from the stand-in's ground truth.
        twin: The twin's motion.
        states: All states of the twin controller, newest last.
        decisions: All its decisions.
        audit: What it was asked for, and by whom.
    """

    def __init__(
        self,
        ros: Ros,
        environment: Mapping[str, str] | None = None,
    ) -> None:
        """Choose ports; the context starts the nodes, with ``environment`` beside that of ``ros``.

        Without one its twin controller knows the robot: its first move is as fast as the others.
        All nodes know the token of the operator's page.
        """
        given = environment or {OVERRIDE: str(known_robot(ros.folder / "known_robot"))}
        super().__init__(ros.stage, {VARIABLE: TOKEN, **given})
        self.ros = ros
        self.arguments["recorder"] = (f"_directory:={ros.folder}",)
        self.put_relays("modbus", "web")
        self.states: deque[Any] = deque(maxlen=2000)
        self.decisions: deque[Any] = deque(maxlen=5000)
        self.audit: deque[Any] = deque(maxlen=2000)
        self.real = Motion([joint.name for joint in ROBOT.twin_joints])
        self.twin = Motion([joint.name for joint in ROBOT.twin_joints])

    def __enter__(self) -> FaultCell:
        for node in NODES:
            self.start_node(node)
        self._watch()
        wait_until(self._is_ready, 60.0, "an idle cell", period=0.1)
        self._full_override()
        return self

    def __exit__(self, *_: object) -> None:
        self.release()

    def _is_ready(self) -> bool:
        for process in self.processes.values():
            assert process.poll() is None, (
                f"{process} ended with {process.poll()}:\n{process.tail()}"
            )
        return bool(self.states) and self._recovered()

    @contextlib.contextmanager
    def beside(self, *nodes: str) -> Iterator[None]:
        """Let further nodes run for a while, which may stand still or have died by its end."""
        for node in nodes:
            self.start_node(node)
        try:
            yield
        finally:
            for node in nodes:
                self.end(node)

    def end(self, node: str) -> None:
        """Ask a node to end, also one that stands still."""
        process = self.processes.pop(node, None)
        if process is not None:
            process.signal(signal.SIGCONT)
            process.stop()

    def set_up(self, settings: str, plant: str = "") -> None:
        """Start the robot again, set up otherwise, and lead the pair to IDLE.

        Args:
            settings: How its controller was set up, where it is not as filed.
            plant: How it moves, such as ``field:7``; empty: as filed. Another plant is another
                robot: the twin controller begins anew too.
        """
        wanted = {SETTINGS_CHOICE: settings, PLANT_CHOICE: plant}
        changed = {key for key in wanted if self.environment.get(key, "") != wanted[key]}
        if not changed:
            return
        self.environment |= wanted
        nodes = ("emulator", "twin_controller") if PLANT_CHOICE in changed else ("emulator",)
        for node in nodes:
            self.kill(node)
            self.start_node(node)
        self.recover()
        self._full_override()

    def _full_override(self) -> None:
        self.pendant("override", "100")
        wait_until(lambda: self.states[-1].real_override_percent == 100.0, 5.0, "override 100 %")

    def command(self, command: str, **fields: Any) -> Any:
        """Call ``twin_controller/command``."""
        from scara_msgs.srv import TwinCommand

        return self.call("twin_controller/command", TwinCommand, command=command, **fields)

    def call(self, service: str, kind: type[Any], timeout: float = 10.0, **fields: Any) -> Any:
        """Call a service of the cell; fail after ``timeout`` [s] or when it is not there."""
        import rospy

        proxy = rospy.ServiceProxy(self.ros.name(service), kind)
        try:
            return with_deadline(lambda: proxy(**fields), timeout, f"answer of {service}")
        except rospy.ServiceException as error:
            raise AssertionError(f"{service}: {error}") from error

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
            lambda: f"{mode}; it is {self.mode}: {self.states[-1].why if self.states else ''}",
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
        self._order(speed_percent)
        shown = 0.6e-2 * (speed_percent if left_percent is None else left_percent)
        wait_until(lambda: self.real.under_way(shown, 0.1), 8.0, "a robot under way")

    def visit(self, speed_percent: float) -> None:
        """Let the operator move both sides to the further of two poses; wait until both are there.

        Nobody need see them on their way: it takes a second, and who looks may be as late.
        """
        target = self._order(speed_percent)

        def there() -> bool:
            sides = (self.real.position(), self.twin.position())
            apart = (abs(a - b) for side in sides for a, b in zip(side, target))
            return self.mode == "IDLE" and max(apart) < THERE_ENOUGH

        wait_until(there, 30.0, lambda: f"both at {target}; mode {self.mode}")

    def _order(self, speed_percent: float) -> Sequence[float]:
        target = self.farther_pose()
        answer = self.command("MOVE_JOINTS", joint_positions=target, speed_percent=speed_percent)
        assert answer.success, answer.message
        return target

    def farther_pose(self) -> Sequence[float]:
        """Return the further of two poses, so that a move to it takes a while."""
        here = self.twin.position()
        return max((THERE, BACK), key=lambda pose: abs(pose[0] - here[0]))

    def until(
        self, condition: Callable[[], bool], timeout: float, what: str | Callable[[], str] = ""
    ) -> None:
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
            lambda: f"{' or '.join(events)}; mode {self.mode}",
        )
        return float(found[0].header.stamp.to_sec())

    def decided(self, since: float) -> list[Any]:
        """Return the decisions made after ``since`` (ROS time)."""
        return [d for d in list(self.decisions) if d.header.stamp.to_sec() > since]

    def recover(self, timeout: float = 60.0) -> None:
        """Lead the cell out of whatever happened, as an operator would, until it is idle."""
        self.modbus.heal()
        self.web.heal()
        self.until(
            self._recovered,
            timeout,
            lambda: f"IDLE; it is {self.mode}: {self.states[-1].why}",
        )

    def _recovered(self) -> bool:
        if time.time() - self.states[-1].header.stamp.to_sec() > 0.5:
            return False
        if command := way_out(self.mode):
            self.command(command)
        # A robot that has just been started again stands at home: IDLE is from before.
        state = self.states[-1]
        apart = (abs(a - b) for a, b in zip(state.real_position, state.twin_position))
        return self.mode == "IDLE" and max(apart, default=NEVER_APART) < NEVER_APART

    def _watch(self) -> None:
        from sensor_msgs.msg import JointState

        from scara_msgs.msg import Audit, Decision, TwinControllerState

        for topic, kind, kept in (
            ("twin_controller/state", TwinControllerState, self.states),
            ("twin_controller/decisions", Decision, self.decisions),
            ("twin_controller/audit", Audit, self.audit),
            ("real/ground_truth", JointState, self.real.messages),
            ("twin/joint_states", JointState, self.twin.messages),
        ):
            self.ros.collect(topic, kind, kept, publishers=1)
