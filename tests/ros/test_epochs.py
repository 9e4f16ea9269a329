"""What was asked for before a STOP never begins after it, whichever node stood still meanwhile."""

from __future__ import annotations

import signal
import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from itertools import product
from typing import Any

import pytest
from harness.ros import Ros
from harness.running.pairs import pairs
from harness.running.thorough import thorough
from harness.wires.service_line import ServiceLine
from scara_config import load_robot

NAMES = [joint.name for joint in load_robot().twin_joints]
NODES = (
    "kinematics_server",
    "joint_pose_controller",
    "joint_vel_controller",
    "motion_server",
    "trajectory_server",
)
EACH_TIME_S = (0.05, 0.24, 0.4)
"""Gaps in which no stream, a stream, and a stream and a jog fall silent [s]."""
OTHERS_S = (0.02, 0.15)
GAPS = [*EACH_TIME_S, *thorough(*OTHERS_S)]
# A stamp is compared, whatever the gap. Without one the gap itself is judged.
ROWS = [(True, 0.24), *((False, gap) for gap in EACH_TIME_S)]
OTHER_ROWS = [row for row in product((True, False), EACH_TIME_S + OTHERS_S) if row not in ROWS]
STAMPS_AND_GAPS = [*ROWS, *thorough(*OTHER_ROWS)]
WAITED_FOR = ("motion_server", "joint_pose_controller")
ROUTES = {
    "target": "joint_pose_controller",
    "jog": "joint_vel_controller",
    "goal": "trajectory_server",
    "velocity": "simulator",
    "position": "simulator",
}
"""What no service answers, and who carries it out."""
WATCHED_S = 0.4
ANSWER_S = 10.0
REST_RAD = 1e-4
MOVED_RAD = 20.0 * REST_RAD
FAR = [1.0, 0.5, -0.1, 0.5]


class Cell:
    """Simulator and motion nodes; one of them can stand still."""

    def __init__(self, ros: Ros) -> None:
        """Start all."""
        import actionlib
        from sensor_msgs.msg import JointState
        from std_msgs.msg import Float64

        from control_msgs.msg import FollowJointTrajectoryAction, JointJog
        from scara_msgs.msg import MotionCommand, MotionState
        from scara_msgs.srv import MoveJoints, MoveTo

        self.ros = ros
        simulator = ros.run("scara_simulation", "simulator")
        self.nodes = {name: ros.run("scara_control", name) for name in NODES}
        self.nodes["simulator"] = simulator
        self.move_to = ros.service("move_to", MoveTo)
        self.move = ros.service("joint_pose_controller/move", MoveJoints)
        self.joints = ros.collect("twin/joint_states", JointState)
        self.states = ros.collect("joint_pose_controller/state", MotionState)
        # Each is in its listeners' sockets when publish() returns: with a queue a busy machine may
        # send a STOP only when the node that stood still runs again.
        with warnings.catch_warnings(action="ignore", category=SyntaxWarning):
            self.commands = ros.publisher(
                "motion_command", MotionCommand, subscribers=5, queue_size=None
            )
            self.targets = ros.publisher(
                "joint_pose_controller/target", JointState, queue_size=None
            )
            self.direct = {
                kind: ros.publisher(
                    f"twin/{NAMES[0]}_{kind}_controller/command", Float64, queue_size=None
                )
                for kind in ("position", "velocity")
            }
            self.jogs = ros.publisher("joint_vel_controller/command", JointJog, queue_size=None)
        self.goals = actionlib.SimpleActionClient(
            ros.name("joint_trajectory_action"), FollowJointTrajectoryAction
        )
        assert self.goals.wait_for_server(duration(10.0))
        ros.wait_until(lambda: bool(self.joints and self.states), 10.0, "joints and states")
        self._id = 0

    def line(self, name: str) -> ServiceLine:
        """Open a service's line: what is sent to a node that stands still then waits there."""
        from scara_msgs.srv import MoveJoints, MoveTo

        service, kind = {
            "move_to": ("move_to", MoveTo),
            "move": ("joint_pose_controller/move", MoveJoints),
        }[name]
        return ServiceLine(self.ros.master.uri, self.ros.name(service), kind, "/tests")

    def stop(self, *, stamped: bool = False) -> None:
        """Send STOP."""
        from scara_msgs.msg import MotionCommand

        self._id += 1
        asked = time.monotonic() if stamped else 0.0
        self.commands.publish(
            MotionCommand(command=MotionCommand.STOP, id=self._id, reason="test", asked=asked)
        )

    @contextmanager
    def standing(self, name: str, seconds: float) -> Iterator[None]:
        """Let a node stand still for a while; what is in the block falls into its first part."""
        began = time.monotonic()
        self.nodes[name].signal(signal.SIGSTOP)
        try:
            yield
            time.sleep(max(0.0, began + seconds - time.monotonic()))
        finally:
            self.nodes[name].signal(signal.SIGCONT)

    def call(
        self,
        asked_for: tuple[str, dict[str, Any]],
        standing: str,
        stalled: float,
        *,
        stamped: bool,
        stop: bool = True,
    ) -> Any:
        """Ask for a move while a node stands still, and STOP meanwhile; return the answer."""
        name, fields = asked_for
        answers: list[Any] = []
        with self.line(name) as line:
            with self.standing(standing, stalled):
                fields = {"asked": time.monotonic() if stamped else 0.0, **fields}
                call = partial(line.call, ANSWER_S, speed_percent=30.0, **fields)
                threading.Thread(target=lambda: answers.append(call()), daemon=True).start()
                time.sleep(0.5 * stalled)
                if stop:
                    self.stop(stamped=stamped)
            return self.ros.wait_until(lambda: answers, ANSWER_S, "the answer")[0]

    def send(self, order: str, begin: list[float], *, stamped: bool = False) -> None:
        """Send an order that no service answers, to a twin that stands at ``begin``."""
        import rospy
        from sensor_msgs.msg import JointState

        from control_msgs.msg import JointJog

        stamp = rospy.Time.now() if stamped else rospy.Time()
        if order == "target":
            target = JointState(name=NAMES, position=FAR, velocity=[30.0])
            target.header.stamp = stamp
            self.targets.publish(target)
        elif order == "jog":
            jog = JointJog(joint_names=[NAMES[0]], velocities=[0.3])
            jog.header.stamp = stamp
            self.jogs.publish(jog)
        elif order == "goal":
            self.goals.send_goal(self.goal(3.0))
        else:
            self.direct[order].publish(begin[0] + 0.3)

    def rests(self) -> None:
        """Wait until nothing moves."""
        since = time.time()
        self.ros.wait_until(lambda: self.states[-1].state == "idle", 10.0, "an idle twin")
        self.ros.wait_until(
            lambda: self.told_after(since) and max(map(abs, self.joints[-1].velocity)) < REST_RAD,
            10.0,
            "a twin at rest",
        )

    def told_after(self, since: float) -> bool:
        """Return whether the simulator has told where the joints are after ``since`` [s]."""
        return bool(self.joints[-1].header.stamp.to_sec() > since)

    def farthest(self, begin: list[float], first: int) -> float:
        """Return how far a joint was from ``begin`` since the joint state number ``first``."""
        states = self.joints[first:]
        return max((abs(a - b) for s in states for a, b in zip(s.position, begin)), default=0.0)

    def stays(self, begin: list[float]) -> None:
        """Watch for a while; the twin does not leave where it stood, and all nodes go on."""
        end, seen = time.time() + WATCHED_S, len(self.joints)
        self.ros.wait_until(lambda: self.told_after(end), ANSWER_S, "joints after the standstill")
        ended = [name for name, node in self.nodes.items() if node.poll() is not None]
        assert not ended, f"ended: {ended}"
        assert self.farthest(begin, seen) < REST_RAD

    def goal(self, seconds: float) -> Any:
        """Return a goal that leads far, in a time [s]."""
        from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

        from control_msgs.msg import FollowJointTrajectoryGoal

        point = JointTrajectoryPoint(positions=FAR)
        point.time_from_start = duration(seconds)
        trajectory = JointTrajectory(joint_names=NAMES, points=[point])
        return FollowJointTrajectoryGoal(trajectory=trajectory)


def duration(seconds: float) -> Any:
    """Return a duration."""
    import rospy

    return rospy.Duration.from_sec(seconds)


@pytest.fixture(scope="module")
def cell(ros_module: Ros) -> Cell:
    """Give one cell to all tests of this module."""
    return Cell(ros_module)


@pytest.fixture
def place(cell: Cell) -> list[float]:
    """Return where the twin stands, at rest."""
    cell.rests()
    return list(cell.joints[-1].position)


TURNS = (WAITED_FOR, (True, False), EACH_TIME_S + OTHERS_S)
POINT_ROWS = pairs(WAITED_FOR, (True, False), EACH_TIME_S)
POINT = ("move_to", {"x": 0.51, "y": 0.16, "z": 0.10})
JOINTS = ("move", {"joint_names": NAMES, "joint_positions": FAR})


@pytest.mark.parametrize(
    ("asked_for", "standing", "stamped", "stalled"),
    [
        *((POINT, *row) for row in POINT_ROWS),
        *((JOINTS, "joint_pose_controller", *row) for row in ROWS),
        *thorough(
            *((POINT, *row) for row in product(*TURNS) if row not in POINT_ROWS),
            *((JOINTS, "joint_pose_controller", *row) for row in OTHER_ROWS),
        ),
    ],
)
def test_a_move_that_waited_behind_a_node_does_not_begin_after_stop(
    cell: Cell,
    place: list[float],
    asked_for: tuple[str, dict[str, Any]],
    standing: str,
    stalled: float,
    stamped: bool,
) -> None:
    """It waits for another node, or in the queue of the node itself, beside the STOP."""
    answer = cell.call(asked_for, standing, stalled, stamped=stamped)
    assert not answer.success and "by STOP: test" in answer.message
    cell.stays(place)


def test_a_point_that_is_asked_for_after_the_stop_is_reached(cell: Cell) -> None:
    """A stop ends what was, not what comes."""
    cell.stop()
    time.sleep(0.1)
    answer = cell.move_to(x=0.55, y=0.10, z=0.05, speed_percent=60.0)
    assert answer.success, answer.message


@pytest.mark.parametrize("order", ["target", "jog"])
@pytest.mark.parametrize(("stamped", "stalled"), STAMPS_AND_GAPS)
def test_a_message_that_waited_does_not_begin_after_stop(
    cell: Cell, place: list[float], order: str, stalled: float, stamped: bool
) -> None:
    """A target or a jog has no answer: the twin tells."""
    with cell.standing(ROUTES[order], stalled):
        cell.send(order, place, stamped=stamped)
        time.sleep(0.5 * stalled)
        cell.stop(stamped=stamped)
    cell.stays(place)


@pytest.mark.parametrize("stalled", GAPS)
def test_a_goal_that_waited_does_not_begin_after_stop(
    cell: Cell, place: list[float], stalled: float
) -> None:
    """trajectory_server finds the goal and the STOP side by side."""
    with cell.standing(ROUTES["goal"], stalled):
        cell.send("goal", place)
        time.sleep(0.5 * stalled)
        cell.stop()
    assert cell.goals.wait_for_result(duration(10.0))
    assert "by STOP: test" in cell.goals.get_goal_status_text()
    cell.stays(place)


@pytest.mark.parametrize("stalled", [0.4, *thorough(0.15)])
def test_a_goal_that_runs_does_not_go_on_after_a_stop_that_its_server_missed(
    cell: Cell, place: list[float], stalled: float
) -> None:
    """Its stream has broken off by then; the first set point behind the standstill is none."""
    cell.goals.send_goal(cell.goal(30.0))
    cell.ros.wait_until(lambda: cell.states[-1].state == "following", 5.0, "a stream")
    with cell.standing("trajectory_server", stalled):
        time.sleep(0.7 * stalled)
        cell.stop()
    assert cell.goals.wait_for_result(duration(10.0))
    cell.rests()
    cell.stays(list(cell.joints[-1].position))
    assert cell.states[-1].state == "idle"


@pytest.mark.parametrize(
    ("kind", "stalled"),
    [
        *(("velocity", 0.05), ("position", 0.24), ("velocity", 0.4)),
        *thorough(("position", 0.05), ("velocity", 0.24), ("position", 0.4)),
        *thorough(*product(("position", "velocity"), OTHERS_S)),
    ],
)
def test_a_direct_command_that_waited_does_not_begin_after_stop(
    cell: Cell, place: list[float], kind: str, stalled: float
) -> None:
    """A plain number names no time: the simulator finds it and the STOP side by side."""
    with cell.standing(ROUTES[kind], stalled):
        cell.send(kind, place)
        time.sleep(0.5 * stalled)
        cell.stop()
    cell.stays(place)


def test_a_move_that_waited_without_a_stop_is_made(cell: Cell, place: list[float]) -> None:
    """So it is the STOP that the other rounds show."""
    seen = len(cell.joints)
    assert cell.call(POINT, WAITED_FOR[0], EACH_TIME_S[0], stamped=True, stop=False).success
    assert cell.farthest(place, seen) > MOVED_RAD


@pytest.mark.parametrize("order", ROUTES)
def test_an_order_that_waited_without_a_stop_moves_the_twin(
    cell: Cell, place: list[float], order: str
) -> None:
    """Likewise: what nobody carries out shows nothing about STOP."""
    seen = len(cell.joints)
    with cell.standing(ROUTES[order], EACH_TIME_S[0]):
        cell.send(order, place)
    cell.ros.wait_until(
        lambda: cell.farthest(place, seen) > MOVED_RAD, ANSWER_S, "a twin that moves"
    )
    cell.stop()
