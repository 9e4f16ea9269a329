"""First messages: kept for a second, never what moves or stops a robot."""

from __future__ import annotations

import pytest
from harness.opponents.graph_and_clients import SHIPPED
from hypothesis import given
from hypothesis import strategies as st
from rosbridge_gateway.config import FirstMessages
from rosbridge_gateway.protocol.first_messages import FirstOnes, KeepRules

RULES = KeepRules(SHIPPED.first_messages, "/cell_2")
LIMITS = FirstMessages(
    seconds=1.0, count=3, never_topics=[], never_types=[], until_stop_topics=[], until_stop_types=[]
)


@pytest.mark.parametrize(
    ("topic", "type_name"),
    [
        ("/chatter", "std_msgs/String"),
        ("/cell_2/notes", "std_msgs/String"),
        ("/map", "nav_msgs/OccupancyGrid"),
        ("/initialpose", "geometry_msgs/PoseWithCovarianceStamped"),
    ],
)
def test_what_commands_nothing_is_kept(topic: str, type_name: str) -> None:
    """The examples of the clients' documentations among it."""
    assert RULES.keeps(topic, type_name)


@pytest.mark.parametrize(
    ("topic", "type_name"),
    [
        ("/cell_2/motion_command", "scara_msgs/MotionCommand"),
        ("/anywhere", "scara_msgs/MotionCommand"),
        ("/cell_2/joint_vel_controller/command", "control_msgs/JointJog"),
        ("/cell_2/joint_pose_controller/follow", "trajectory_msgs/JointTrajectory"),
        ("/cell_2/joint_pose_controller/speed_limit_percent", "std_msgs/Float64"),
        ("/cell_2/twin/joint_1_position_controller/command", "std_msgs/Float64"),
        ("/cell_2/people/nearest", "geometry_msgs/PointStamped"),
        ("/other_robot/joint_1_position_controller/command", "std_msgs/Float64"),
        ("/turtle1/cmd_vel", "geometry_msgs/Twist"),
        ("/mixed", "geometry_msgs/TwistStamped"),
        ("/move_base/cancel", "actionlib_msgs/GoalID"),
        ("/E_Stop", "std_msgs/Bool"),
        ("/line_3/emergency_stop/state", "std_msgs/Empty"),
    ],
)
def test_what_moves_or_stops_a_robot_is_never_kept(topic: str, type_name: str) -> None:
    """By name or by type; a command that comes late undoes what was commanded meanwhile."""
    assert not RULES.keeps(topic, type_name)


def test_all_that_clients_may_command_in_the_cell_is_never_kept() -> None:
    """Whatever gateway.yaml lets clients publish beside the cell's nodes, or names outright."""
    outright = [name for role in SHIPPED.roles.values() for name in role.publish if "*" not in name]
    for pattern in (*SHIPPED.reserved.shared, *outright, *SHIPPED.driving.topics):
        name = pattern.replace("*", "joint_1")
        if name == "joint_trajectory_action/goal":
            continue  # until a stop
        assert not RULES.keeps(f"/cell_2/{name}", "std_msgs/String"), name


@pytest.mark.parametrize(
    ("topic", "type_name"),
    [
        ("/cell_2/joint_trajectory_action/goal", "control_msgs/FollowJointTrajectoryActionGoal"),
        ("/move_base/goal", "move_base_msgs/MoveBaseActionGoal"),
        ("/anywhere", "actionlib_tutorials/FibonacciActionGoal"),
    ],
)
def test_goal_of_an_action_is_kept_until_a_stop(topic: str, type_name: str) -> None:
    """An action client sends it right behind its advertise; its server answers it."""
    assert RULES.keeps(topic, type_name) and RULES.until_stop(topic, type_name)


def test_what_is_no_goal_outlives_a_stop() -> None:
    """Nobody moves by it."""
    assert not RULES.until_stop("/chatter", "std_msgs/String")


def test_stop_forgets_what_came_before_it() -> None:
    """What came after it is handed on; only what was young enough counts as lost."""
    first = FirstOnes(LIMITS, now=0.0)
    for number, now in enumerate((0.1, 0.2, 0.9)):
        first.add(number, now)
    assert first.forget(0.5, 1.0) and first.young(1.0) == [2]
    assert not first.forget(0.5, 1.0) and first.young(1.0) == [2]
    assert not first.forget(0.95, 2.0), "it was too old already"


def test_messages_of_the_first_second_live_a_second_each() -> None:
    """A later message is not kept; the oldest gives way when there are too many."""
    first = FirstOnes(LIMITS, now=10.0)
    assert first.over_in(10.0) == 1.0 and first.wanted_for(10.0) == 0.0
    for number, now in enumerate((10.0, 10.2, 10.4, 10.9)):
        first.add(number, now)
    first.add("late", 11.1)
    assert first.young(11.1) == [1, 2, 3]
    assert first.wanted_for(11.1) == pytest.approx(0.8), "as long as the newest lives"
    assert first.young(11.3) == [2, 3]
    assert first.wanted_for(11.3) == pytest.approx(0.6) == first.over_in(11.3)
    assert first.young(11.95) == [] and first.over_in(11.95) == 0.0 == first.wanted_for(11.95)


def test_second_publisher_has_a_first_second_of_its_own() -> None:
    """It shares the connections of the first one, and what is kept for them."""
    first = FirstOnes(LIMITS, now=0.0)
    first.add("a", 0.9)
    first.extend(0.95)
    first.add("b", 1.8)
    assert first.young(1.85) == ["a", "b"] and first.young(1.95) == ["b"]
    assert first.over_in(1.95) == pytest.approx(0.85)


@given(st.lists(st.floats(0.0, 5.0), max_size=20), st.floats(0.0, 5.0))
def test_nothing_is_handed_on_that_is_old_or_too_much(times: list[float], asked: float) -> None:
    """Whenever messages come and whenever a subscriber does."""
    first = FirstOnes(LIMITS, now=0.0)
    for time in sorted(t for t in times if t <= asked):
        first.add(time, time)
    young = first.young(asked)
    assert len(young) <= 3 and young == sorted(young)
    assert all(asked - time <= 1.0 and time <= 1.0 for time in young)
