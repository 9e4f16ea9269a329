"""Somebody asks for a motion, a node on its way stands still, and STOP comes meanwhile."""

from __future__ import annotations

import math
import random
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple
from xmlrpc.client import ServerProxy

from harness.faults.fault_cell import ROBOT, FaultCell
from harness.processes import wait_until
from harness.wires.gateway_client import RosbridgeClient, connect

NAMES = [joint.name for joint in ROBOT.twin_joints]
MORE_NODES = ("motion_server", "joint_vel_controller", "trajectory_server")
"""Beside those of the breakable cell."""
ROUTES = {
    "gateway": ("MOVE_JOINTS by web", "MOVE by web", "move_to by web", "jog by web"),
    "trajectory_server": ("goal",),
    "joint_pose_controller": ("joint move", "move_to", "MOVE_JOINTS", "target", "set points"),
    "motion_server": ("move_to", "MOVE"),
    "twin_controller": ("MOVE_JOINTS", "MOVE"),
}
"""What passes a node before anything moves."""
STALL_S = (0.0, 1.0)
WATCHED_S = 0.8
"""So long after STOP and standstill nothing may move; a move is announced 0.08 s ahead."""
SPEED_PERCENT = 30.0
DEADLINE_S = 20.0


class Round(NamedTuple):
    """One schedule.

    Attributes:
        node: Stands still.
        order: What is asked for at the beginning of the standstill.
        stall: How long it lasts [s].
        stop: When STOP is given, as a part of it; None: never.
    """

    node: str
    order: str
    stall: float
    stop: float | None


class Found(NamedTuple):
    """What a round has shown: the farthest joint of each side since the request [deg or mm]."""

    round: Round
    stopped: bool
    twin: float
    real: float

    def __str__(self) -> str:
        node, order, stall, stop = self.round
        given = "no STOP" if stop is None else f"STOP at {stop * stall:5.3f} s"
        return (
            f"{node:22} {order:20} stands {stall:5.3f} s, {given}: "
            f"twin {self.twin:8.4f}, real {self.real:8.4f}"
        )


def draw(seed: int, count: int) -> list[Round]:
    """Draw so many rounds; each node comes in turn."""
    rng, nodes = random.Random(seed), list(ROUTES)
    rounds = []
    for k in range(count):
        node = nodes[k % len(nodes)]
        order = rng.choice(ROUTES[node])
        rounds.append(Round(node, order, rng.uniform(*STALL_S), rng.uniform(0.1, 0.9)))
    return rounds


class Orders:
    """A cell with all motion nodes, and open doors to them; a context manager."""

    def __init__(self, cell: FaultCell) -> None:
        """Open them."""
        import rospy
        from sensor_msgs.msg import JointState
        from trajectory_msgs.msg import JointTrajectory

        from control_msgs.msg import FollowJointTrajectoryActionGoal
        from scara_msgs.srv import MoveJoints, MoveTo, TwinCommand

        self._cell = cell
        self._kinds = {
            "twin_controller/command": TwinCommand,
            "move_to": MoveTo,
            "joint_pose_controller/move": MoveJoints,
        }
        for service in self._kinds:
            rospy.wait_for_service(cell.ros.name(service), DEADLINE_S)
        self._targets = cell.ros.publisher("joint_pose_controller/target", JointState)
        self._follow = cell.ros.publisher("joint_pose_controller/follow", JointTrajectory)
        self._goals = cell.ros.publisher(
            "joint_trajectory_action/goal", FollowJointTrajectoryActionGoal
        )
        self._now = rospy.Time.now
        self._jogs = cell.ros.name("joint_vel_controller/command")
        self._web: RosbridgeClient | None = None

    def __enter__(self) -> Orders:
        return self

    def __exit__(self, *_: object) -> None:
        if self._web is not None:
            self._web.close()

    def _connect(self) -> None:
        """Open a new connection: the gateway ends one whose client reads nothing for a while."""
        self.__exit__()
        self._web = connect(self._cell.gateway_port, DEADLINE_S)
        self._web.say(op="advertise", topic=self._jogs, type="control_msgs/JointJog")
        self._web.time()
        wait_until(self._jogs_are_heard, DEADLINE_S, "a jog controller that hears the gateway")

    def _jogs_are_heard(self) -> bool:
        """Return whether the gateway has a line for jogs: one that leaves before it is lost."""
        import rosgraph

        master = rosgraph.Master("/orders", self._cell.ros.master.uri)
        publishers = dict(master.getSystemState()[0]).get(self._jogs, [])
        (gateway,) = [name for name in publishers if name.endswith("gateway")]
        node: Any = ServerProxy(master.lookupNode(gateway))
        lines = node.getBusInfo("/orders")[2]
        return any((line[2], line[4]) == ("o", self._jogs) for line in lines)

    def play(self, scene: Round) -> Found:
        """Play one round from an idle pair."""
        self._cell.recover()
        wait_until(lambda: self._rest() == 0.0, DEADLINE_S, "two sides at rest")
        begin = time.time()
        twin, real = self._cell.twin.position(), self._cell.real.position()
        target = self._elsewhere(twin)
        answers: list[Any] = []
        if scene.order.endswith("by web"):
            self._connect()
        stop = threading.Thread(
            target=lambda: answers.append(self._cell.command("STOP")), daemon=True
        )
        with self._standing(scene.node, scene.stall):
            self._orders(scene.order, target)()
            if scene.stop is not None:
                time.sleep(scene.stall * scene.stop)
                stop.start()
        if scene.stop is not None:
            stop.join(DEADLINE_S)
        end = max(time.time(), begin + scene.stall) + WATCHED_S
        wait_until(
            lambda: min(self._newest(s) for s in (self._cell.twin, self._cell.real)) > end,
            DEADLINE_S,
            "both sides' motion after the standstill",
        )
        return Found(
            scene,
            bool(answers) and bool(answers[0].sent),
            _farthest(self._cell.twin, twin, begin),
            _farthest(self._cell.real, real, begin),
        )

    def _rest(self) -> float:
        return max(
            share if share > 1e-4 else 0.0
            for motion in (self._cell.twin, self._cell.real)
            for share in motion.shares(motion.messages[-1])
        )

    @staticmethod
    def _newest(motion: Any) -> float:
        return float(motion.messages[-1].header.stamp.to_sec())

    @staticmethod
    def _elsewhere(here: Sequence[float]) -> list[float]:
        """Return a pose that is far in the first joint."""
        return [here[0] + (-0.8 if here[0] > 0.0 else 0.8), *here[1:]]

    @contextmanager
    def _standing(self, node: str, seconds: float) -> Iterator[None]:
        begun = time.monotonic()
        self._cell.stop(node)
        try:
            yield
            time.sleep(max(0.0, begun + seconds - time.monotonic()))
        finally:
            self._cell.go_on(node)

    def _orders(self, order: str, target: list[float]) -> Callable[[], None]:
        """Return what sends an order."""
        q1, q2, q3 = target[0], target[1], target[2]
        point = {
            "x": 0.35 * math.cos(q1) + 0.3 * math.cos(q1 + q2),
            "y": 0.35 * math.sin(q1) + 0.3 * math.sin(q1 + q2),
            "z": 0.16 + q3,
            "speed_percent": SPEED_PERCENT,
        }
        joints = {"joint_positions": target, "speed_percent": SPEED_PERCENT}
        services = {
            "MOVE_JOINTS": ("twin_controller/command", {"command": "MOVE_JOINTS", **joints}),
            "MOVE": ("twin_controller/command", {"command": "MOVE", **point}),
            "move_to": ("move_to", point),
            "joint move": ("joint_pose_controller/move", joints),
        }
        word = order.removesuffix(" by web")
        if word in services:
            service, fields = services[word]
            return self._by_web(service, fields) if word != order else self._called(service, fields)
        others: dict[str, Callable[[list[float]], None]] = {
            "target": self._target,
            "goal": self._goal,
            "jog by web": self._jog,
            "set points": self._stream,
        }
        return lambda: others[order](target)

    def _called(self, service: str, fields: dict[str, Any]) -> Callable[[], None]:
        """Call as one of our own clients does: it says when."""
        from scara_ros.services.service_client_node import ServiceClient

        client = ServiceClient(self._cell.ros.name(service), self._kinds[service], DEADLINE_S)
        return lambda: client.start(**fields) and None

    def _by_web(self, service: str, fields: dict[str, Any]) -> Callable[[], None]:
        name = self._cell.ros.name(service)
        return lambda: self._send(op="call_service", service=name, args=fields)

    def _send(self, **packet: Any) -> None:
        assert self._web is not None
        self._web.say(**packet)

    def _jog(self, target: list[float]) -> None:
        jog = {"joint_names": NAMES[:1], "velocities": [0.5]}
        self._send(op="publish", topic=self._jogs, msg=jog)

    def _target(self, target: list[float]) -> None:
        from sensor_msgs.msg import JointState

        message = JointState(name=NAMES, position=target, velocity=[SPEED_PERCENT])
        message.header.stamp = self._now()
        self._targets.publish(message)

    def _goal(self, target: list[float]) -> None:
        import rospy
        from trajectory_msgs.msg import JointTrajectoryPoint

        from control_msgs.msg import FollowJointTrajectoryActionGoal

        action = FollowJointTrajectoryActionGoal()
        action.header.stamp = action.goal_id.stamp = self._now()
        action.goal_id.id = f"round {time.time():.6f}"
        point = JointTrajectoryPoint(positions=target)
        point.time_from_start = rospy.Duration.from_sec(3.0)
        action.goal.trajectory.joint_names, action.goal.trajectory.points = NAMES, [point]
        self._goals.publish(action)

    def _stream(self, target: list[float]) -> None:
        """Send a set point beside where the twin stands, as the first of a stream."""
        from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

        here = self._cell.twin.position()
        near = [here[0] + math.copysign(0.02, target[0] - here[0]), *here[1:]]
        zeros = [0.0] * len(NAMES)
        point = JointTrajectoryPoint(positions=near, velocities=zeros, accelerations=zeros)
        message = JointTrajectory(joint_names=NAMES, points=[point])
        message.header.stamp = self._now()
        self._follow.publish(message)


def _farthest(motion: Any, begin: Sequence[float], since: float) -> float:
    """Return how far a joint was from where it stood [deg or mm]."""
    scales = [joint.scale for joint in ROBOT.twin_joints]
    return max(
        (
            abs(q - at) / scale
            for _, row, _ in motion.truth(since)
            for q, at, scale in zip(row, begin, scales)
        ),
        default=math.nan,
    )
