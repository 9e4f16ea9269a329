"""run_experiment on a cell that the test plays: who is missing, Ctrl-C, a whole run.

What else it ends with: tests/unit/twin_experiments/test_exit_codes.py.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import rosbag
import rospy
from harness.processes import Process
from harness.ros import Ros
from harness.yaml_files import shipped
from scara_config import load_robot
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from twin_experiments.config import load_experiments
from twin_experiments.run.cell_node import RunError, RunningCell

from scara_msgs.msg import RobotData, TwinControllerState
from scara_msgs.srv import MoveTo, MoveToResponse, TwinCommand, TwinCommandResponse

JOINTS = ["joint_1", "joint_2", "joint_3", "table_joint"]
POSES = {  # inverse kinematics of the article's positions, righty, as in the robot's own program
    (0.65, 0.0, 0.0): np.array([0.0, 0.0, -0.16, 0.0]),
    (0.51, 0.16, 0.1): np.array([np.radians(-14.321759156), np.radians(69.600037824), -0.06, 0.0]),
    (0.51, -0.16, 0.16): np.array([np.radians(-49.157700740), np.radians(69.600037824), 0.0, 0.0]),
}
MOVE_S = 0.4
ROBOT = load_robot()


class PlayedCell:
    """Publishes both sides.

    ``move_to`` moves both along a quintic, the real side ``lag`` [s] late.
    """

    def __init__(self, ros: Ros, lag: float) -> None:
        """Offer everything that run_experiment needs, except the recorder."""
        self._lag = lag
        self._here = self._there = POSES[0.65, 0.0, 0.0]
        self._since = -10.0
        self.mode = "IDLE"
        self.commands: list[str] = []
        self._stop = threading.Event()
        self._publishers = {
            topic: rospy.Publisher(ros.name(topic), kind, queue_size=10, tcp_nodelay=True)
            for topic, kind in (
                ("real/ground_truth", JointState),
                ("real/joint_states", JointState),
                ("twin/joint_states", JointState),
                ("real/robot_data", RobotData),
                ("twin_controller/state", TwinControllerState),
            )
        }
        self._services = [
            rospy.Service(ros.name("move_to"), MoveTo, self._move_to),
            rospy.Service(ros.name("twin_controller/command"), TwinCommand, self._command),
        ]
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    @property
    def moves(self) -> bool:
        """Return whether it is in the middle of a move."""
        return 0.0 < rospy.get_time() - self._since < 0.5 * MOVE_S

    def _move_to(self, request: MoveTo._request_class) -> MoveToResponse:
        self._here, self._there = self._there, POSES[request.x, request.y, request.z]
        self._since = rospy.get_time()
        self._stop.wait(MOVE_S + 0.05)
        return MoveToResponse(success=not self._stop.is_set(), message="")

    def _command(self, request: TwinCommand._request_class) -> TwinCommandResponse:
        self.commands.append(request.command)
        return TwinCommandResponse(True, "", True)

    def _run(self) -> None:
        while not self._stop.wait(0.005):
            now = rospy.get_rostime()
            for topic, late in (("twin/joint_states", 0.0), ("real/ground_truth", self._lag)):
                u = np.clip((now.to_sec() - late - self._since) / MOVE_S, 0.0, 1.0)
                way = self._there - self._here
                position = self._here + way * (10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5)
                velocity = way * (30.0 * u**2 - 60.0 * u**3 + 30.0 * u**4) / MOVE_S
                message = JointState(name=JOINTS, position=position, velocity=velocity)
                message.header.stamp = now
                self._publishers[topic].publish(message)
            self._publishers["real/joint_states"].publish(message)
            self._publishers["real/robot_data"].publish(RobotData(control_type="none"))
            self._publishers["twin_controller/state"].publish(
                TwinControllerState(mode=self.mode, why="told so")
            )

    def close(self) -> None:
        """Leave nothing behind."""
        self._stop.set()
        self._thread.join()
        for service in self._services:
            service.shutdown("the test has ended")
        for publisher in self._publishers.values():
            publisher.unregister()


@pytest.fixture
def cell(ros: Ros) -> Iterator[PlayedCell]:
    """Start a played cell and a real recorder."""
    played = PlayedCell(ros, lag=0.003)
    ros.run("cell_recorder", "recorder", f"_directory:={ros.folder}")
    yield played
    played.close()


def short_configuration(ros: Ros, cell_deadline: float = 20.0) -> Path:
    """Write the shipped configuration with few visits, short rests and another deadline."""
    folder = ros.folder / "config"
    folder.mkdir(exist_ok=True)
    (folder / "robot.yaml").write_text(shipped("robot.yaml").read_text())
    text = shipped("experiments.yaml").read_text()
    for shipped_value, value in (
        ("[P1, P2, P3, P1, P2, P3, P1]", "[P1, P2, P3, P1]"),
        ("dwell_s: 0.7 ", "dwell_s: 0.4 "),
        ("rest_s: 0.5 ", "rest_s: 0.3 "),
        ("cell: 60.0", f"cell: {cell_deadline}"),
    ):
        assert shipped_value in text
        text = text.replace(shipped_value, value)
    (folder / "experiments.yaml").write_text(text)
    return folder


def start_twin_leads(ros: Ros, output: Path) -> Process:
    """Start the second experiment with a short configuration."""
    folder = short_configuration(ros)
    return ros.run(
        "twin_experiments",
        "run_experiment",
        "twin_leads",
        "--output",
        str(output),
        f"_config_dir:={folder}",
    )


def test_ctrl_c_stops_the_motion_and_keeps_the_bag(ros: Ros, cell: PlayedCell) -> None:
    """The operator's way out: STOP is sent, the bag is complete, its place is said."""
    said = ros.collect("experiment/marker", String)
    run = start_twin_leads(ros, ros.folder / "out")
    bag = ros.folder / "out" / "run.bag"
    ros.wait_until(lambda: said and cell.moves, 30.0, "a move", period=0.005)
    run.signal(signal.SIGINT)
    assert run.wait(15.0) == 130
    assert cell.commands == ["STOP"]
    assert str(bag) in run.output.replace("\n", "")
    with rosbag.Bag(str(bag)) as opened:
        assert opened.get_message_count(ros.name("real/ground_truth")) > 50
        assert opened.get_message_count(ros.name("experiment/marker")) == 1


@pytest.mark.parametrize(
    ("mode", "way_out"), [("STOPPED", "ALIGN"), ("ESTOP", "RESET and ALIGN"), ("PAUSED", "RESUME")]
)
def test_a_stop_heard_while_services_are_looked_for_is_judged_with_a_whole_cell(
    ros: Ros, monkeypatch: pytest.MonkeyPatch, mode: str, way_out: str
) -> None:
    """The reason is never cut off by what was still missing a moment before."""
    config = load_experiments(ROBOT)
    cell = RunningCell(ROBOT, config.metrics.moving_speed_percent, config.deadlines_s)
    for topic in ("real/joint_states", "twin/joint_states"):
        cell._receive(JointState(), topic)
    cell._receive(RobotData(), "real/robot_data")

    def offered(name: str, within: float) -> bool:
        """Be there; the state comes while it is asked."""
        cell._receive(TwinControllerState(mode=mode, why="told so"), "twin_controller/state")
        return True

    monkeypatch.setattr("twin_experiments.run.cell_node.is_offered", offered)
    with pytest.raises(RunError, match=f"in {mode}: told so.*first give {way_out}"):
        cell.wait_ready(lambda text: None)


def test_a_real_robot_is_judged_by_what_it_shows_and_a_stand_in_by_its_truth(
    ros: Ros, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No real robot publishes a truth, and nothing is waited for that never comes."""
    config = load_experiments(ROBOT)
    cell = RunningCell(ROBOT, config.metrics.moving_speed_percent, config.deadlines_s)
    monkeypatch.setattr("twin_experiments.run.cell_node.is_offered", lambda *_: True)
    moves = JointState(name=["joint_1"], velocity=[1.0])
    cell._receive(JointState(), "twin/joint_states")
    cell._receive(RobotData(), "real/robot_data")
    cell._receive(TwinControllerState(mode="IDLE"), "twin_controller/state")
    assert [name.endswith("real/joint_states") for name in cell._absent()] == [True]
    cell._receive(moves, "real/joint_states")
    assert cell._absent() == [] and cell.moves("real") == 1
    cell._receive(JointState(), "real/ground_truth")
    assert cell.moves("real") == 0


def test_a_stop_during_a_run_ends_it(ros: Ros, cell: PlayedCell) -> None:
    """The reason is said, both are stopped, the bag is kept."""
    said = ros.collect("experiment/marker", String)
    run = start_twin_leads(ros, ros.folder / "out")
    ros.wait_until(lambda: said, 30.0, "a marker")
    cell.mode = "STOPPED"
    assert run.wait(60.0) == 3
    assert "the twin controller went to STOPPED: told so" in run.output
    assert cell.commands == ["STOP"]


def test_what_is_missing_is_named(ros: Ros) -> None:
    """Nothing is started on half a cell."""
    folder = short_configuration(ros, cell_deadline=0.3)
    run = ros.run(
        "twin_experiments",
        "run_experiment",
        "--output",
        str(ros.folder / "out"),
        f"_config_dir:={folder}",
    )
    assert run.wait(60.0) == 3
    for name in ("topic {}/twin/joint_states", "service {}/recorder/start", "service {}/move_to"):
        assert name.format(ros.namespace) in run.output
    assert not (ros.folder / "out" / "run.bag").exists()


def test_a_missing_master_is_named(ros: Ros) -> None:
    """Without a master the command says where it looked."""
    folder = short_configuration(ros, cell_deadline=0.5)
    uri = f"http://127.0.0.1:{ros.free_port()}"
    run = ros.run(
        "twin_experiments", "run_experiment", f"_config_dir:={folder}", env={"ROS_MASTER_URI": uri}
    )
    assert run.wait(60.0) == 3
    assert f"no ROS master at {uri}" in run.output
