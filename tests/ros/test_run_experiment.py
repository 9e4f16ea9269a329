"""run_experiment and report on a cell that the test plays.

Who is missing, Ctrl-C, verdicts, exit codes.
"""

from __future__ import annotations

import json
import signal
import tempfile
import threading
import time
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
from twin_experiments.nodes.cell import Cell, RunError

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

    ``move_to`` moves both along a quintic, the real side ``lag`` [s] late and ``offset`` [rad] off.
    """

    def __init__(self, ros: Ros, lag: float, offset: float) -> None:
        """Offer everything that run_experiment needs, except the recorder."""
        self._lag, self._offset = lag, offset
        self._here = self._there = POSES[0.65, 0.0, 0.0]
        self._since = -10.0
        self.mode = "IDLE"
        self.commands: list[str] = []
        self._stop = threading.Event()
        self._publishers = {
            topic: rospy.Publisher(ros.name(topic), kind, queue_size=10, tcp_nodelay=True)
            for topic, kind in (
                ("real/ground_truth", JointState),
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
            for topic, late, off in (
                ("twin/joint_states", 0.0, 0.0),
                ("real/ground_truth", self._lag, self._offset),
            ):
                u = np.clip((now.to_sec() - late - self._since) / MOVE_S, 0.0, 1.0)
                way = self._there - self._here
                position = self._here + way * (10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5)
                velocity = way * (30.0 * u**2 - 60.0 * u**3 + 30.0 * u**4) / MOVE_S
                message = JointState(
                    name=JOINTS, position=position + [off, 0.0, 0.0, 0.0], velocity=velocity
                )
                message.header.stamp = now
                self._publishers[topic].publish(message)
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
def cell(ros: Ros, request: pytest.FixtureRequest) -> Iterator[PlayedCell]:
    """Start a played cell and a real recorder; the parameters are lag [s] and offset [rad]."""
    lag, offset = getattr(request, "param", (0.003, 0.0))
    played = PlayedCell(ros, lag, offset)
    ros.run("cell_recorder", "recorder", f"_directory:={ros.folder}")
    yield played
    played.close()


def short_configuration(ros: Ros, cell_deadline: float = 20.0) -> Path:
    """Write the shipped configuration with the three positions once and another deadline."""
    folder = ros.folder / "config"
    folder.mkdir(exist_ok=True)
    (folder / "robot.yaml").write_text(shipped("robot.yaml").read_text())
    text = shipped("experiments.yaml").read_text()
    text = text.replace("[P1, P2, P3, P1, P2, P3, P1]", "[P1, P2, P3, P1]").replace(
        "cell: 60.0", f"cell: {cell_deadline}"
    )
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


def test_a_run_is_recorded_marked_and_reported(ros: Ros, cell: PlayedCell) -> None:
    """One command: bag, report.json with a lag and errors, page and figures, exit code 0.

    `report` finds the same again.
    """
    # A folder of its own for each try, if it has to be played again.
    output = Path(tempfile.mkdtemp(dir=ros.folder)) / "out"
    run = start_twin_leads(ros, output)
    assert run.wait(60.0) == 0, run.tail()
    document = json.loads((output / "report.json").read_text())
    (found,) = document["experiments"]
    assert (found["name"], found["leader"], found["verdict"], found["held"]) == (
        "twin_leads",
        "twin",
        "pass",
        ["P1", "P2", "P3", "P1"],
    )
    assert found["lag_s"] == pytest.approx(0.003, abs=5e-4)
    assert 0.0 < found["path_error_max_percent"] < 2.0
    with rosbag.Bag(str(output / "run.bag")) as bag:
        said = [m.data for _, m, _ in bag.read_messages(topics=[ros.name("experiment/marker")])]
    assert said == ["start twin_leads", "end twin_leads"]
    assert {p.name for p in output.glob("*.png")} == {
        f"twin_leads_{kind}.png" for kind in ("paths", "joints", "errors", "deviations", "worst")
    }
    words = ("--output", str(ros.folder / "again"), "--config-dir", str(ros.folder / "config"))
    again = ros.run("twin_experiments", "report", str(output / "run.bag"), *words)
    assert again.wait(30.0) == 0, again.tail()
    repeated = json.loads((ros.folder / "again" / "report.json").read_text())
    # Only when it was written is another.
    assert repeated["made_with"].pop("reported") >= document["made_with"].pop("reported")
    assert repeated == document


@pytest.mark.parametrize("cell", [(0.003, 0.05)], indirect=True)
def test_a_missed_limit_ends_with_exit_code_one_and_says_which(ros: Ros, cell: PlayedCell) -> None:
    """A verdict that fails is a failed command."""
    folder = short_configuration(ros)
    run = ros.run(
        "twin_experiments",
        "run_experiment",
        "twin_leads",
        "--output",
        str(ros.folder / "out"),
        f"_config_dir:={folder}",
    )
    assert run.wait(60.0) == 1
    assert "twin_leads: positioning error" in run.output and "limit 0.2 %" in run.output


def test_ctrl_c_stops_the_motion_and_keeps_the_bag(ros: Ros, cell: PlayedCell) -> None:
    """The operator's way out: STOP is sent, the bag is complete, its place is said."""
    folder = short_configuration(ros)
    run = ros.run(
        "twin_experiments",
        "run_experiment",
        "twin_leads",
        "--output",
        str(ros.folder / "out"),
        f"_config_dir:={folder}",
    )
    bag = ros.folder / "out" / "run.bag"
    ros.wait_until(bag.exists, 30.0, "a bag")
    time.sleep(2.0)  # in the middle of a move
    run.signal(signal.SIGINT)
    assert run.wait(15.0) == 130
    assert cell.commands == ["STOP"]
    assert str(bag) in run.output.replace("\n", "")
    with rosbag.Bag(str(bag)) as opened:
        assert opened.get_message_count(ros.name("real/ground_truth")) > 100


@pytest.mark.parametrize(
    ("mode", "way_out"), [("STOPPED", "ALIGN"), ("ESTOP", "RESET and ALIGN"), ("PAUSED", "RESUME")]
)
def test_a_stop_of_the_operator_is_not_overruled(
    ros: Ros, cell: PlayedCell, mode: str, way_out: str
) -> None:
    """The command ends at once and says what the operator has to do."""
    cell.mode = mode
    run = start_twin_leads(ros, ros.folder / "out")
    assert run.wait(60.0) == 3
    assert f"it is in {mode}: told so" in run.output and f"first give {way_out}" in run.output
    assert not (ros.folder / "out" / "run.bag").exists()


def test_a_stop_heard_while_services_are_looked_for_is_judged_with_a_whole_cell(
    ros: Ros, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The reason is never cut off by what was still missing a moment before."""
    config = load_experiments(ROBOT)
    cell = Cell(ROBOT, config.metrics.moving_speed_percent, config.deadlines_s)
    for topic in ("real/ground_truth", "twin/joint_states"):
        cell._receive(JointState(), topic)
    cell._receive(RobotData(), "real/robot_data")

    def offered(name: str, within: float) -> bool:
        """Be there; the state comes while it is asked."""
        cell._receive(TwinControllerState(mode="STOPPED", why="told so"), "twin_controller/state")
        return True

    monkeypatch.setattr("twin_experiments.nodes.cell.is_offered", offered)
    with pytest.raises(RunError, match=r"in STOPPED: told so.*first give ALIGN"):
        cell.wait_ready(lambda text: None)


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
    folder = short_configuration(ros, cell_deadline=1.0)
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


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("nobody_leads",), "unknown experiment 'nobody_leads'"),
        (("--speed", "150"), "less than or equal to 100"),
        (("_config_dir:=/nowhere",), "/nowhere"),
    ],
)
def test_wrong_arguments_end_with_exit_code_two(
    ros: Ros, words: tuple[str, ...], text: str
) -> None:
    """A wrong name, speed or folder is told before anything moves."""
    run = ros.run("twin_experiments", "run_experiment", *words)
    assert run.wait(30.0) == 2
    assert text in run.output
