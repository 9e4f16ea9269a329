"""The robots of RViz: where their frames are, and what the node costs while nobody looks."""

from __future__ import annotations

import itertools
import threading
import time
import xmlrpc.client
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from xmlrpc.server import SimpleXMLRPCServer

import numpy as np
import pytest
from harness.processes import Process, wait_until
from harness.ros import Ros
from harness.running.thorough import thorough
from harness.workspace import ROOT
from scara_config import load_robot
from scara_control.kinematics.screws import ScrewModel, forward_kinematics
from scara_description.ghost import ghost_of
from scara_ros.starting.master_io import UNREACHABLE, MasterClient
from scipy.spatial.transform import Rotation

NODE = "robot_state_publisher"
STATES = ("twin/joint_states", "real/joint_states")


class Cell:
    """A cell's joint states, published by the test, and the node that shows them."""

    def __init__(self, ros: Ros) -> None:
        """Advertise the joint states."""
        import rospy
        from sensor_msgs.msg import JointState

        self.ros = ros
        self.publishers = [
            rospy.Publisher(ros.name(topic), JointState, queue_size=10, tcp_nodelay=True)
            for topic in STATES
        ]

    def run(self, *words: str, env: dict[str, str] | None = None) -> Process:
        """Start the node and wait until it offers its frames."""
        node = self.ros.run("scara_description", NODE, *words, env=env)
        wait_until(lambda: self._offers(node), 30.0, "the node's frames")
        return node

    def hears(self) -> set[str]:
        """Return the joint states that the node listens to, as the master says."""
        _, subscribers, _ = MasterClient(self.ros.master.uri, "/tests").ask("getSystemState")
        node = self.ros.name(NODE)
        return {
            topic for topic in STATES if node in dict(subscribers).get(self.ros.name(topic), [])
        }

    def is_heard(self) -> bool:
        """Return whether the node is connected to both sides."""
        return all(publisher.get_num_connections() for publisher in self.publishers)

    def publish(self, side: int, q: dict[str, float], seconds: float) -> None:
        """Publish one joint state with a stamp."""
        import rospy
        from sensor_msgs.msg import JointState

        state = JointState(name=list(q), position=list(q.values()))
        state.header.stamp = rospy.Time.from_sec(seconds)
        self.publishers[side].publish(state)

    def close(self) -> None:
        """Leave the topics."""
        for publisher in self.publishers:
            publisher.unregister()

    def _offers(self, node: Process) -> bool:
        assert node.poll() is None, node.tail()
        publishers, _, _ = MasterClient(self.ros.master.uri, "/tests").ask("getSystemState")
        return self.ros.name(NODE) in dict(publishers).get("/tf_static", [])


@pytest.fixture
def cell(ros: Ros) -> Iterator[Cell]:
    """Give the joint states of a cell."""
    made = Cell(ros)
    yield made
    made.close()


def moved(messages: list[Any], child: str) -> list[tuple[float, Any]]:
    """Return (stamp, transform) of each time that a frame was told."""
    return [
        (each.header.stamp.to_sec(), each.transform)
        for message in list(messages)
        for each in message.transforms
        if each.child_frame_id.partition("/")[2] == child  # after the test's namespace
    ]


def looked_up(
    cell: Cell, side: int, q: dict[str, float], second: int, buffer: Any, frames: tuple[str, str]
) -> np.ndarray:
    """Publish one joint state until tf knows it; return the pose that tf makes of it."""
    import rospy

    base, tool = (cell.ros.frame(name) for name in frames)

    def known() -> bool:
        cell.publish(side, q, second)
        return bool(buffer.can_transform(base, tool, rospy.Time(second)))

    wait_until(known, 20.0, f"{tool} at {second} s", period=0.02)
    found = buffer.lookup_transform(base, tool, rospy.Time(second)).transform
    pose, turn = np.eye(4), found.rotation
    pose[:3, :3] = Rotation.from_quat((turn.x, turn.y, turn.z, turn.w)).as_matrix()
    pose[:3, 3] = found.translation.x, found.translation.y, found.translation.z
    return pose


@pytest.mark.parametrize("name", ["fanuc_sr6ia", *thorough("articulated_six")])
def test_tools_of_both_robots_are_where_forward_kinematics_says(
    cell: Cell, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a tf user looks up at the stamp of a joint state; both descriptions are the URDF's."""
    import rospy
    import tf2_ros

    monkeypatch.setenv("SCARA_ROBOT", name)
    robot = load_robot(ROOT / "config")
    arm, generator = ScrewModel.from_robot(robot), np.random.default_rng(5)
    cell.run(env={"SCARA_ROBOT": name})
    text = robot.description.read_text(encoding="utf-8")
    assert rospy.get_param(cell.ros.name("robot_description")) == text
    assert rospy.get_param(cell.ros.name("real/robot_description")) == ghost_of(text)
    buffer = tf2_ros.Buffer(debug=False)
    listener = tf2_ros.TransformListener(buffer)
    try:
        wait_until(cell.is_heard, 20.0, "a node that hears both robots")
        for second in range(100, 105):
            for side, tool in enumerate((robot.tool_frame, f"real/{robot.tool_frame}")):
                q = {joint.name: float(generator.uniform(-2, 2)) for joint in robot.twin_joints}
                found = looked_up(cell, side, q, second, buffer, (robot.base_frame, tool))
                expected = forward_kinematics(arm, np.array([q[j.name] for j in robot.arm_joints]))
                np.testing.assert_allclose(found, expected, atol=1e-9)
    finally:
        listener.unregister()


def test_joint_states_are_heard_only_while_somebody_listens(cell: Cell) -> None:
    """Hundreds of messages a second are work too; who comes later is served as well."""
    import rospy
    from tf2_msgs.msg import TFMessage

    cell.run()
    assert cell.hears() == set()
    stamps = itertools.count(100)

    def publish() -> None:
        cell.publish(0, {"joint_1": 0.5}, next(stamps))

    for _ in range(2):
        received: list[TFMessage] = []
        listener = rospy.Subscriber("/tf", TFMessage, received.append)
        wait_until(lambda: cell.hears() == set(STATES), 20.0, "a node that hears both robots")

        def told(received: list[TFMessage] = received) -> bool:
            publish()
            return bool(moved(received, "link_1"))

        wait_until(told, 20.0, "the frame", period=0.02)
        listener.unregister()

        def silent() -> bool:
            publish()  # that somebody has gone is noticed when something is sent to him
            return cell.hears() == set()

        wait_until(silent, 20.0, "a node that rests", period=0.1)


def test_newest_state_is_told_at_the_rate_and_no_stamp_twice(cell: Cell) -> None:
    """No listener gets more, whatever the sides publish; a repeated stamp makes tf warn."""
    from tf2_msgs.msg import TFMessage

    cell.run("_rate:=5")
    received = cell.ros.collect("/tf", TFMessage)
    wait_until(cell.is_heard, 20.0, "a node that hears both robots")
    begun, stamp = time.monotonic(), 100.0

    def ten_told() -> bool:
        nonlocal stamp
        stamp += 0.005
        cell.publish(0, {"joint_1": stamp - 100.0}, stamp)
        cell.publish(1, {"joint_1": 0.25}, 50.0)
        return len(moved(received, "link_1")) >= 10

    wait_until(ten_told, 30.0, "ten frames", period=0.005)
    assert len(moved(received, "link_1")) <= 2.0 + 5.0 * (time.monotonic() - begun)
    wait_until(lambda: moved(received, "link_1")[-1][0] == pytest.approx(stamp), 10.0, "the last")
    stamps = [each for each, _ in moved(received, "link_1")]
    assert stamps == sorted(set(stamps))
    last = moved(received, "link_1")[-1][1].rotation
    assert (last.z, last.w) == pytest.approx(
        (np.sin(0.5 * (stamp - 100.0)), np.cos(0.5 * (stamp - 100.0))), abs=1e-6
    )
    assert [each for each, _ in moved(received, "real/link_1")] == [50.0]


class Switchboard(SimpleXMLRPCServer):
    """A door to a ROS master that notes what is asked; a context manager."""

    def __init__(self, master: str) -> None:
        """Listen on a free port."""
        super().__init__(("127.0.0.1", 0), logRequests=False, allow_none=True)
        self.uri = f"http://127.0.0.1:{self.server_address[1]}"
        self.asked: list[str] = []
        self._master = master
        self._thread = threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.05})

    def __enter__(self) -> Switchboard:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.shutdown()
        self._thread.join()
        self.server_close()

    def _dispatch(self, method: str, params: Any) -> Any:
        self.asked.append(method)
        return getattr(xmlrpc.client.ServerProxy(self._master), method)(*params)


def test_no_message_asks_the_master_anything(cell: Cell) -> None:
    """Debian's node asked for tf_prefix at each joint state, 75 times a second."""
    from tf2_msgs.msg import TFMessage

    with Switchboard(cell.ros.master.uri) as board:
        node = cell.run(env={"ROS_MASTER_URI": board.uri})
        received = cell.ros.collect("/tf", TFMessage)
        wait_until(cell.is_heard, 20.0, "a node that hears both robots")
        stamp, asked = 100.0, len(board.asked)

        def told() -> bool:
            nonlocal stamp
            stamp += 0.01
            for side in (0, 1):
                cell.publish(side, {"joint_1": 0.5}, stamp)
            return min(len(moved(received, f"{p}link_1")) for p in ("", "real/")) >= 20

        wait_until(told, 30.0, "twenty frames of each robot", period=0.01)
        # Whether there is still the same master: twice a second, whatever is published.
        assert set(board.asked[asked:]) <= {"getPid"}
        assert node.stop() == 0


@pytest.mark.parametrize(
    ("q", "why"),
    [
        ({"joint_9": 0.5}, "the description has no moving joint 'joint_9': there are joint_1"),
        *thorough(({"joint_1": float("nan")}, "joint_1 = nan: must be finite")),
    ],
)
def test_state_that_does_not_fit_is_told_and_the_next_is_shown(
    cell: Cell, q: dict[str, float], why: str
) -> None:
    """One line names the topic and the joint; the node goes on."""
    from tf2_msgs.msg import TFMessage

    node = cell.run()
    received = cell.ros.collect("/tf", TFMessage)
    wait_until(cell.is_heard, 20.0, "a node that hears both robots")
    cell.publish(0, q, 100.0)
    told = f"{cell.ros.name(STATES[0])}: not shown: {why}"
    wait_until(lambda: told in node.output, 10.0, f"the warning {told}")
    cell.publish(0, {"joint_1": 0.5}, 101.0)
    wait_until(lambda: moved(received, "link_1"), 10.0, "the frame")
    assert [stamp for stamp, _ in moved(received, "link_1")] == [101.0]
    assert node.output.count("not shown") == 1


@pytest.mark.parametrize(
    ("text", "words", "why"),
    [
        (None, (), "robot.urdf: cannot be read: No such file or directory"),
        *thorough(
            ("<robot", (), "robot.urdf: the robot description is no XML"),
            ('<robot name="r"/>', (), "robot.urdf: the robot description must have one root"),
        ),
        ('<robot name="r"><link name="a"/></robot>', ("_rate:=0",), "~rate = 0: must be a number"),
    ],
)
def test_node_that_cannot_start_says_why_and_ends_with_2(
    ros: Ros, tmp_path: Path, text: str | None, words: tuple[str, ...], why: str
) -> None:
    """One line, with the file or the parameter."""
    file = tmp_path / "robot.urdf"
    if text is not None:
        file.write_text(text, encoding="utf-8")
    node = ros.run("scara_description", NODE, f"_file:={file}", *words)
    assert node.wait(30.0) == 2
    assert why in node.output and "Traceback" not in node.output


def test_next_roscore_has_the_descriptions_again(ros: Ros) -> None:
    """RViz, opened after a roscore was started again, finds both robots."""
    port = ros.free_port()
    env = {"ROS_MASTER_URI": f"http://127.0.0.1:{port}"}
    names = [ros.name(name) for name in ("robot_description", "real/robot_description")]

    def described() -> bool:
        master = MasterClient(env["ROS_MASTER_URI"], "/tests")
        try:
            return all(master.ask("hasParam", name) for name in names)
        except UNREACHABLE:
            return False

    first = ros.stage.start("rosmaster", "--core", "-p", str(port), env=env)
    node = ros.run("scara_description", NODE, env=env)
    wait_until(described, 30.0, "both descriptions")
    first.stop()
    ros.stage.start("rosmaster", "--core", "-p", str(port), env=env)
    wait_until(described, 20.0, "both descriptions at the next master")
    assert node.stop() == 0
