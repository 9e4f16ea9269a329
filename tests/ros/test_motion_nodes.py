"""The motion nodes with the real simulator: services, topics, commands, as a user sees them."""

from __future__ import annotations

import contextlib
import math
import shutil
import threading
from itertools import pairwise

import numpy as np
import pytest
from harness.running.thorough import thorough
from harness.workspace import ROOT
from scara_config import load_robot
from scara_control.config import load_motion
from scara_control.kinematics.scara import Scara, tool_position

pytestmark = pytest.mark.usefixtures("cell")
ROBOT = load_robot()
SCARA = Scara.from_robot(ROBOT)
NAMES = [joint.name for joint in ROBOT.twin_joints]
HOME = [0.0, 0.0, -0.16, 0.0]
FAR = [1.0, -0.8, -0.05, 0.5]
POINTS = {"P1": (0.65, 0.0, 0.0), "P2": (0.51, 0.16, 0.10), "P3": (0.51, -0.16, 0.16)}
CAP = "joint_pose_controller/speed_limit_percent"
NODES = ("kinematics_server", "joint_pose_controller", "joint_vel_controller", "motion_server")


class Cell:
    """The nodes, and what a test says and hears."""

    def __init__(self, ros):
        from sensor_msgs.msg import JointState
        from std_msgs.msg import String
        from trajectory_msgs.msg import JointTrajectory

        from control_msgs.msg import JointJog
        from scara_msgs.msg import MotionCommand, MotionState
        from scara_msgs.srv import MoveJoints, MoveTo

        self.ros = ros
        self.processes = [
            ros.run("scara_simulation", "simulator"),
            *(ros.run("scara_control", node) for node in NODES),
        ]
        self.move = ros.service("joint_pose_controller/move", MoveJoints)
        self.move_to = ros.service("move_to", MoveTo)
        self.commands = ros.publisher("motion_command", MotionCommand, subscribers=4)
        self.follow = ros.publisher("joint_pose_controller/follow", JointTrajectory)
        self.jogs = ros.publisher("joint_vel_controller/command", JointJog)
        self.joints = ros.collect("twin/joint_states", JointState)
        self.setpoints = ros.collect("twin/joint_setpoints", JointTrajectory)
        self.states = ros.collect("joint_pose_controller/state", MotionState)
        self.jog_states = ros.collect("joint_vel_controller/state", String)
        ros.wait_until(
            lambda: self.joints and self.states and self.jog_states, 10.0, "joints and states"
        )
        self._command_id = 100

    def q(self):
        """Return the joints' positions now."""
        message = self.joints[-1]
        return [dict(zip(message.name, message.position))[name] for name in NAMES]

    def has_forwarded(self, stamp):
        """Return whether a set point with this stamp has reached the twin."""
        return any(packet.header.stamp == stamp for packet in list(self.setpoints)[-10:])

    def speed(self):
        """Return the largest joint speed now."""
        return max(map(abs, self.joints[-1].velocity))

    def state(self, wanted, timeout=5.0):
        """Wait for a state of joint_pose_controller."""
        self.ros.wait_until(
            lambda: self.states[-1].state == wanted,
            timeout,
            f"state {wanted}, now {self.states[-1].state}",
        )

    def still(self):
        """Wait until the twin stands still."""
        self.ros.wait_until(
            lambda: self.states[-1].standing_still and self.speed() < 1e-3, 5.0, "standstill"
        )

    def command(self, command, reason="test", number=None):
        """Send a motion command and wait until it is reported back."""
        from scara_msgs.msg import MotionCommand

        self._command_id += 1
        message = MotionCommand(
            command=getattr(MotionCommand, command), id=number or self._command_id, reason=reason
        )
        message.header.frame_id = "tests"
        self.commands.publish(message)
        self.ros.wait_until(
            lambda: self.states[-1].last_command_id == message.id, 5.0, f"{command} to be reported"
        )

    def background(self, call, **fields):
        """Call a service in a thread; return a list that will hold the answer."""
        answers = []
        threading.Thread(target=lambda: answers.append(call(**fields)), daemon=True).start()
        return answers

    def answer(self, answers):
        """Wait for the answer of :meth:`background`."""
        return self.ros.wait_until(lambda: answers, 15.0, "the answer")[0]

    def jog(self, names, velocities):
        """Send one jog command."""
        from control_msgs.msg import JointJog

        self.jogs.publish(JointJog(joint_names=names, velocities=velocities))


@pytest.fixture(scope="module")
def running(ros_module):
    """Start the nodes once."""
    return Cell(ros_module)


@pytest.fixture
def cell(running):
    """Give each test a twin at home, nothing latched, and nodes that are alive."""
    running.command("RESET")
    running.command("STOP", "a new test begins")
    running.still()
    answer = running.move(joint_positions=HOME, speed_percent=100.0)
    assert answer.success, answer.message
    # Once it is reported back, no state of the way home is still to be heard.
    running.command("RESET")
    running.ros.wait_until(
        lambda: running.jog_states[-1].data.startswith("idle"), 5.0, "the jog controller to be idle"
    )
    # The move may be answered before its last packet, which has one point, is heard here.
    running.ros.wait_until(
        lambda: not running.setpoints or len(running.setpoints[-1].points) == 1,
        5.0,
        "the last packet of the way home",
    )
    del running.setpoints[:]
    yield running
    assert [process.poll() for process in running.processes] == [None] * 5
    assert not [process.name for process in running.processes if "Traceback" in process.output]


@pytest.mark.parametrize("name", ["P2", *thorough("P1", "P3")])
def test_move_to_brings_the_tool_to_the_articles_points(cell, name):
    """The service drives until the position is reached and reports the error that is left.

    The table holds, and no state says between the motion and its end that the twin is trimming.
    """
    point = POINTS[name]
    del cell.states[:-1]
    answer = cell.move_to(*point, 100.0, "")
    assert answer.success, answer.message
    cell.still()
    assert {state.state for state in cell.states} <= {"announcing", "moving", "idle"}
    assert answer.error <= 0.02e-3 and math.dist(
        tool_position(SCARA, *answer.joint_positions), point
    ) == pytest.approx(answer.error)
    assert math.dist(tool_position(SCARA, *cell.q()[:3]), point) <= 0.04e-3
    assert abs(cell.q()[3]) < 1e-3
    assert 0.1 < answer.duration < 10.0


def test_move_to_goes_along_a_line_and_says_by_which_joints(cell):
    """What is published is off the line by less than 0.01 mm; the state announces its way."""
    (x, y, z), (x2, y2, z2) = POINTS["P2"], POINTS["P3"]
    assert cell.move_to(x, y, z, 100.0, "").success
    cell.still()
    del cell.states[:-1], cell.setpoints[:]
    answer = cell.move_to(x=x2, y=y2, z=z2, path="linear", speed_mm_s=200.0)
    assert answer.success and answer.error <= 0.02e-3, answer.message
    length = math.dist((x, y, z), (x2, y2, z2))
    announced = [state for state in cell.states if state.way]
    assert len({tuple(state.way) for state in announced}) == 1
    way = np.reshape(announced[0].way, (-1, len(announced[0].name)))
    assert len(way) > length / 0.02 and way[-1] == pytest.approx(announced[0].target)
    points = [row.positions[:3] for told in cell.setpoints for row in told.points]
    line = np.subtract((x2, y2, z2), (x, y, z)) / length
    off = [np.subtract(tool_position(SCARA, *q), (x, y, z)) for q in (*points, *way[:, :3])]
    assert max(np.linalg.norm(each - (each @ line) * line) for each in off) < 1e-5
    refused = cell.move_to(x=0.65, y=0.0, z=z2, path="linear")
    assert not refused.success and "after 100% of the way" in refused.message


def test_move_refuses_a_wrong_request(cell):
    """The answer and the state say the same; what is wrong, and how, is test_requests.py's."""
    text = "joint_2 = 2.71 rad is outside [-2.618, 2.618]"
    answer = cell.move(joint_positions=[0.0, 2.71, -0.1, 0.0])
    assert not answer.success and text in answer.message
    cell.ros.wait_until(lambda: text in cell.states[-1].message, 5.0, "the refusal in the state")
    assert not cell.setpoints


def test_a_move_is_announced_on_time_and_looks_ahead(cell):
    """The first packet comes as motion.yaml says before the first motion; each looks 0.13 s ahead.

    The last one is at rest.
    """
    assert cell.move(joint_positions=FAR, speed_percent=100.0).success
    cell.ros.wait_until(lambda: len(cell.setpoints[-1].points) == 1, 5.0, "the last packet")
    packets = list(cell.setpoints)
    first = packets[0].header.stamp.to_sec()
    moving = next(p for p in packets if any(p.points[0].velocities))
    announced = moving.header.stamp.to_sec() - first - load_motion().move.announce
    assert -0.02 < announced < 0.05
    assert packets[0].points[-1].time_from_start.to_sec() == pytest.approx(0.13)
    assert any(packets[0].points[-1].velocities) and not any(packets[-1].points[0].velocities)
    assert packets[-1].points[0].positions == pytest.approx(FAR) and packets[0].joint_names == NAMES
    stamps = [packet.header.stamp.to_sec() for packet in packets]
    assert all(after > before for before, after in pairwise(stamps))


def test_a_move_is_announced_as_early_as_the_real_robot_is_late(cell):
    """What the twin controller has measured is heard in its state."""
    from scara_msgs.msg import TwinControllerState

    states = cell.ros.publisher("twin_controller/state", TwinControllerState)
    states.publish(TwinControllerState(follower_lag=0.15))

    def horizon():
        """Return how far the first packet of a new move looks ahead [s]."""
        del cell.setpoints[:]
        assert cell.move(joint_positions=HOME if cell.q()[0] > 0.1 else FAR).success
        return cell.setpoints[0].points[-1].time_from_start.to_sec()

    cell.ros.wait_until(lambda: horizon() == pytest.approx(0.28), 20.0, "a longer look ahead")
    states.publish(TwinControllerState(follower_lag=0.0))
    cell.ros.wait_until(lambda: horizon() == pytest.approx(0.13), 20.0, "the shorter one again")


def test_the_target_topic_moves_without_an_answer(cell):
    """velocity[0] is the speed in percent; a refusal appears in the state."""
    from sensor_msgs.msg import JointState

    targets = cell.ros.publisher("joint_pose_controller/target", JointState)
    targets.publish(JointState(name=["table_joint"], position=[0.4], velocity=[100.0]))
    cell.ros.wait_until(lambda: abs(cell.q()[3] - 0.4) < 1e-3, 5.0, "the table at its target")
    assert cell.states[-1].speed_requested_percent == 100.0
    targets.publish(JointState(name=["table_joint"], position=[4.0]))
    cell.ros.wait_until(
        lambda: "table_joint = 4 rad is outside" in cell.states[-1].message, 5.0, "the refusal"
    )


def test_the_speed_cap_stretches_a_move(cell):
    """Requested and applied are reported apart."""
    from std_msgs.msg import Float64

    caps = cell.ros.publisher(CAP, Float64, subscribers=3)  # both controllers and the simulator
    caps.publish(40.0)
    cell.ros.wait_until(lambda: cell.states[-1].speed_limit_percent == 40.0, 5.0, "the cap")
    answers = cell.background(cell.move, joint_positions=FAR, speed_percent=80.0)
    cell.state("moving")
    assert cell.states[-1].speed_requested_percent == 80.0
    assert cell.states[-1].speed_applied_percent == pytest.approx(40.0)
    caps.publish(100.0)
    assert cell.answer(answers).success


def test_stop_cancels_move_to_with_its_reason(cell):
    """Both the caller of move_to and the state hear why; the twin stands somewhere on its way."""
    answers = cell.background(cell.move_to, x=0.3, y=0.4, z=0.1, speed_percent=10.0)
    cell.state("moving")
    cell.command("STOP", "gate open")
    answer = cell.answer(answers)
    assert (
        not answer.success
        # move_to hears the STOP itself, or first from joint_pose_controller: that is chance.
        and answer.message in ("cancelled by STOP: gate open", "aborted by STOP: gate open")
        and answer.error > 0.01
    )
    assert "gate open" in cell.states[-1].message
    cell.still()


@pytest.mark.parametrize(
    ("held", "text"), [(True, "paused: RESUME"), (False, "speed_mm_s: a joint")]
)
def test_a_newer_move_to_that_is_refused_ends_the_older_one_too(cell, held, text):
    """Both callers have their answers then: nothing may move on, and nothing after RESUME."""
    older = cell.background(cell.move_to, x=0.3, y=0.4, z=0.1, speed_percent=5.0)
    cell.state("moving")
    if held:
        cell.command("PAUSE")

    def refused() -> str:
        newer = cell.move_to(x=0.51, y=0.16, z=0.1, speed_mm_s=5.0 * (not held))
        assert not newer.success
        return str(newer.message)

    # One right behind a PAUSE may be taken for one from before it: that is refused, but not newer.
    cell.ros.wait_until(lambda: text in refused(), 5.0, text)
    assert cell.answer(older).message == "replaced by a newer request"
    cell.state("idle", 1.0)
    cell.command("RESUME")
    cell.still()
    assert cell.states[-1].state == "idle"


def test_emergency_stop_is_latched_until_reset(cell):
    """Moves, streams and jogs are refused; RESET moves nothing."""
    answers = cell.background(cell.move, joint_positions=FAR, speed_percent=5.0)
    cell.state("moving")
    cell.command("ESTOP", "button")
    answer = cell.answer(answers)
    assert not answer.success and answer.message == "aborted by ESTOP: button"
    cell.still()
    assert cell.states[-1].state == "estopped"

    def refused() -> str:
        answer = cell.move(joint_positions=HOME)
        assert not answer.success
        return str(answer.message)

    # A move or a jog right behind a stop may be taken for one from before it: refused as well.
    cell.ros.wait_until(lambda: "emergency stop is latched" in refused(), 5.0, "the latch's reason")
    refusals = ("emergency stop is latched", "cancelled by ESTOP: button, before it began")
    cell.jog(["joint_1"], [0.1])
    cell.ros.wait_until(
        lambda: any(words in cell.jog_states[-1].data for words in refusals), 5.0, "the refusal"
    )
    where = cell.q()
    cell.command("RESET")
    cell.state("idle")
    assert cell.q() == pytest.approx(where, abs=1e-3)
    assert cell.move(joint_positions=HOME).success


def trajectory(q, qdot, stamp):
    """Make a streamed packet of one point."""
    from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

    packet = JointTrajectory(
        joint_names=NAMES, points=[JointTrajectoryPoint(positions=q, velocities=qdot)]
    )
    packet.header.stamp = stamp
    return packet


def test_a_stream_is_forwarded_with_its_stamps_and_ends_by_itself(cell):
    """The twin follows; when the stream breaks off it stops; meanwhile moves are refused."""
    import rospy

    start, stamps, answers = rospy.Time.now(), [], None
    for k in range(60):
        cell.ros.wait_until(
            lambda k=k: (rospy.Time.now() - start).to_sec() >= 0.01 * k,
            2.0,
            "the next packet's time",
        )
        stamp = rospy.Time.now()
        t = (stamp - start).to_sec()
        cell.follow.publish(
            trajectory(
                [0.1 * (1.0 - math.cos(4.0 * t)), 0.0, -0.16, 0.0],
                [0.4 * math.sin(4.0 * t), 0, 0, 0],
                stamp,
            )
        )
        stamps.append(stamp)
        if k == 30:
            answers = cell.background(cell.move, joint_positions=HOME)
        # The next one goes when this one has come through: a late machine takes only the newest.
        with contextlib.suppress(AssertionError):
            cell.ros.wait_until(lambda stamp=stamp: cell.has_forwarded(stamp), 0.05, period=0.002)
    cell.state("idle")
    refused = cell.answer(answers)
    assert not refused.success and refused.message.startswith("following a stream")
    forwarded = {packet.header.stamp for packet in cell.setpoints}
    assert len(forwarded & set(stamps)) >= 50
    assert "follow: no packet for 100 ms" in [state.message for state in cell.states]
    cell.still()
    assert 0.05 < cell.q()[0] < 0.25


def test_a_jog_moves_one_joint_until_its_time_out(cell):
    """0.25 s after the last command the joint stands; then all is silent and a move works again."""
    cell.jog(["table_joint"], [0.3])
    cell.ros.wait_until(
        lambda: cell.jog_states[-1].data == "jogging table_joint 0.3 rad/s", 5.0, "the jog"
    )
    cell.ros.wait_until(
        lambda: cell.jog_states[-1].data == "idle: no command for 250 ms", 5.0, "the time-out"
    )
    cell.still()
    assert 0.04 < cell.q()[3] < 0.12 and cell.q()[:3] == pytest.approx(HOME[:3], abs=1e-3)
    assert cell.move(joint_positions=FAR, speed_percent=100.0).success


def test_a_move_that_trims_drives_the_rest_out_through_the_velocity_controller(cell, tmp_path):
    """Small velocities complete the joint move; a tolerance of 2 um leaves something to do."""
    from scara_msgs.srv import MoveJoints

    config = shutil.copytree(ROOT / "config", tmp_path / "config")
    motion = config / "motion.yaml"
    fine = motion.read_text().replace("  tolerance_mm: 0.02 ", "  tolerance_mm: 0.002 ")
    motion.write_text(fine.replace("  timeout: 10.0 ", "  timeout: 1.0 "))
    node = cell.ros.run(
        "scara_control",
        "joint_pose_controller",
        "joint_pose_controller/move:=fine_move",
        "__name:=fine_pose_controller",
        f"_config_dir:={config}",
    )
    move = cell.ros.service("fine_move", MoveJoints)
    answer = move(joint_names=NAMES[:3], joint_positions=FAR[:3], speed_percent=100.0, trims=True)
    assert answer.success or "trimming ended without reaching it" in answer.message, answer
    assert any(state.data.startswith("jogging joint_1") for state in cell.jog_states)
    cell.still()
    assert cell.q()[:3] == pytest.approx(FAR[:3], abs=1e-4)
    assert node.stop() == 0
