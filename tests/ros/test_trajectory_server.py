"""The action joint_trajectory_action with the simulator, seen by a plain actionlib client."""

from __future__ import annotations

import pytest
from scara_config import load_robot

ROBOT = load_robot()
NAMES = [joint.name for joint in ROBOT.twin_joints]
HOME = [0.0, 0.0, -0.16, 0.0]
AWAY = [0.5, -0.4, -0.06, 0.4]
NODES = (
    ("scara_simulation", "simulator"),
    ("scara_control", "joint_pose_controller"),
    ("scara_control", "trajectory_server"),
)


class Client:
    """Three nodes and an actionlib client."""

    def __init__(self, ros):
        import actionlib
        import rospy
        from sensor_msgs.msg import JointState

        from control_msgs.msg import FollowJointTrajectoryAction
        from scara_msgs.msg import MotionCommand, MotionState

        self.ros = ros
        for package, node in NODES:
            ros.run(package, node)
        self.client = actionlib.SimpleActionClient(
            ros.name("joint_trajectory_action"), FollowJointTrajectoryAction
        )
        assert self.client.wait_for_server(rospy.Duration(30))
        self.joints = ros.collect("twin/joint_states", JointState)
        self.states = ros.collect("joint_pose_controller/state", MotionState)
        self.commands = ros.publisher("motion_command", MotionCommand, subscribers=3)
        ros.wait_until(lambda: self.joints and self.states, 20.0, "joints and states")

    def q(self):
        """Return the joints' positions now."""
        message = self.joints[-1]
        return [dict(zip(message.name, message.position))[name] for name in NAMES]

    def goal(self, *points):
        """Return a goal; points are (time, positions)."""
        import rospy
        from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

        from control_msgs.msg import FollowJointTrajectoryGoal

        rows = [
            JointTrajectoryPoint(positions=q, time_from_start=rospy.Duration.from_sec(t))
            for t, q in points
        ]
        return FollowJointTrajectoryGoal(trajectory=JointTrajectory(joint_names=NAMES, points=rows))

    def send(self, *points, feedback=None):
        """Send a goal, wait for its end; return status and result.

        A stream that this machine held up fails the test: the whole of it is played again, counted.
        """
        import rospy

        self.client.send_goal(self.goal(*points), feedback_cb=feedback)
        assert self.client.wait_for_result(rospy.Duration(30))
        return self.client.get_state(), self.client.get_result()

    def arrive(self, *points):
        """Send a goal that must succeed."""
        from actionlib_msgs.msg import GoalStatus

        status, result = self.send(*points)
        assert status == GoalStatus.SUCCEEDED, result

    def begin(self, *points):
        """Send a goal and wait until it moves."""
        self.client.send_goal(self.goal(*points))
        start = self.q()
        self.ros.wait_until(lambda: abs(self.q()[0] - start[0]) > 0.02, 15.0, "motion")

    def idle(self):
        """Wait until joint_pose_controller is idle."""
        self.ros.wait_until(lambda: self.states[-1].state == "idle", 10.0, "idle")


@pytest.fixture(scope="module")
def client(ros_module):
    """Give one set of nodes to all tests of this module."""
    return Client(ros_module)


@pytest.fixture(autouse=True)
def at_rest(client):
    """Begin each test with a twin that nothing commands."""
    # By its id: a late cancellation of all would meet the next test's goal.
    client.client.cancel_goal()
    client.idle()


def test_a_trajectory_is_followed_with_feedback_and_succeeds(client) -> None:
    """Two points there, one back.

    The joints are where they shall be, the feedback showed the way.
    """
    from actionlib_msgs.msg import GoalStatus

    seen = []
    middle = [0.5 * (a + b) for a, b in zip(HOME, AWAY)]
    status, result = client.send((0.6, middle), (1.2, AWAY), feedback=seen.append)
    assert (status, result.error_code) == (GoalStatus.SUCCEEDED, 0), result
    assert client.q() == pytest.approx(AWAY, abs=2e-3)
    assert len(seen) > 10 and list(seen[0].joint_names) == NAMES
    assert max(abs(value) for message in seen for value in message.error.positions) < 0.05
    client.arrive((1.2, HOME))


def test_a_goal_out_of_limits_is_rejected_with_a_reason(client) -> None:
    """Nothing moves; the status text and the result say joint, value and range."""
    from actionlib_msgs.msg import GoalStatus

    status, result = client.send((2.0, [0.0, 2.71, -0.16, 0.0]))
    assert status == GoalStatus.REJECTED and result.error_code == result.INVALID_GOAL
    assert "joint_2 = " in result.error_string
    assert "is outside [-2.618, 2.618]" in result.error_string
    assert client.client.get_goal_status_text() == result.error_string


def test_cancel_ends_a_goal_on_its_way(client) -> None:
    """The twin stands somewhere between, and takes the next goal."""
    import rospy
    from actionlib_msgs.msg import GoalStatus

    client.begin((4.0, AWAY))
    client.client.cancel_goal()
    assert client.client.wait_for_result(rospy.Duration(10))
    assert client.client.get_state() == GoalStatus.PREEMPTED
    assert 0.0 < client.q()[0] < AWAY[0] - 0.05
    client.idle()
    client.arrive((1.2, HOME))


def test_a_stop_aborts_and_an_emergency_stop_rejects_until_reset(client) -> None:
    """The reason of the command reaches the client."""
    import rospy
    from actionlib_msgs.msg import GoalStatus

    from scara_msgs.msg import MotionCommand

    client.begin((4.0, AWAY))
    client.commands.publish(MotionCommand(command=MotionCommand.ESTOP, reason="the red button"))
    assert client.client.wait_for_result(rospy.Duration(10))
    assert client.client.get_state() == GoalStatus.ABORTED
    text = client.client.get_result().error_string
    assert "the red button" in text, text

    def refused() -> str:
        status, result = client.send((1.2, HOME))
        assert status == GoalStatus.REJECTED
        return str(result.error_string)

    # A goal right behind a stop may be taken for one from before it, which is refused as well.
    client.ros.wait_until(lambda: "RESET it first" in refused(), 10.0, "the reason of the latch")
    client.commands.publish(MotionCommand(command=MotionCommand.RESET))
    client.idle()

    def arrives() -> bool:
        status, result = client.send((1.2, HOME))
        assert status in (GoalStatus.REJECTED, GoalStatus.SUCCEEDED), result
        return bool(status == GoalStatus.SUCCEEDED)

    # The server may hear of the reset a little later than this test, and rejects until then.
    client.ros.wait_until(arrives, 10.0, "a goal that is accepted again")
