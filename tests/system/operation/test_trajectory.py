"""Trajectories of a plain actionlib client in the whole cell.

The real robot follows, the pair comes to rest.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import pytest
import rosbag
from harness.live_cell import LiveCell
from harness.processes import wait_until

CLIENT = Path(__file__).parents[1] / "clients" / "actionlib_client.py"
SUCCEEDED = 3
HOME = (0.0, 0.0, -0.16, 0.0)
ACTION = "FollowJointTrajectoryAction"
RECORDED = {
    "/joint_trajectory_action/goal": f"control_msgs/{ACTION}Goal",
    "/joint_trajectory_action/feedback": f"control_msgs/{ACTION}Feedback",
    "/joint_trajectory_action/result": f"control_msgs/{ACTION}Result",
}


def send(cell: LiveCell, seconds: float, *positions: float, listeners: int = 1) -> dict[str, Any]:
    """Send one trajectory, once so many listen to its goal, and return how it ended."""
    client = ("env", f"GOAL_LISTENERS={listeners}", sys.executable, str(CLIENT))
    said = cell.tool(*client, str(seconds), *map(str, positions), timeout=90.0)
    line = next(line for line in said.splitlines() if line.startswith("ended "))
    ended: dict[str, Any] = json.loads(line.removeprefix("ended "))
    return ended


def idle(cell: LiveCell) -> None:
    """Wait until the pair is idle."""
    wait_until(lambda: cell.mode() == "IDLE", 30.0, "IDLE", period=0.2)


def decisions(cell: LiveCell) -> list[str]:
    """Return the last decisions; each line has its own number and time."""
    lines: list[str] = cell.call("/twin_controller/why", "{count: 20}")["decisions"]
    return lines


@pytest.mark.thorough
def test_the_real_robot_follows_a_trajectory_of_the_twin_and_the_recording_holds_it(
    live_cell: LiveCell,
) -> None:
    """The client reads success, the robot's registers show the goal, and the pair is idle.

    The end was no stop. Goal and result are recorded with the action's own types. The recorder, as
    any subscriber, hears what a new client says once it is connected to it.
    """

    def scene() -> None:
        answer = live_cell.call("/recorder/start")
        assert answer["success"], answer
        before = decisions(live_cell)
        # The table is not named: it holds.
        ended = send(live_cell, 2.0, 0.4, 0.5, -0.10, listeners=2)
        assert (ended["state"], ended["code"]) == (SUCCEEDED, 0), ended
        assert ended["feedback"] > 5
        idle(live_cell)
        assert live_cell.call("/recorder/stop")["success"]
        recorded(answer["path"])
        wanted = [22.918, 28.648, -100.0, 0.0]
        joints = live_cell.real_joints()
        assert [*joints[:3], joints[4]] == pytest.approx(wanted, abs=0.1), "deg and mm"
        why = [line for line in decisions(live_cell) if line not in before]
        assert any("TWIN_LEADS" in line for line in why) and not any(
            "STOPPED" in line for line in why
        ), why
        assert send(live_cell, 2.0, *HOME)["state"] == SUCCEEDED
        idle(live_cell)

    live_cell.beside_lost_links(scene)


def recorded(path: str) -> None:
    """Hold that a bag has one goal of these joints, and that it succeeded."""
    with rosbag.Bag(path) as bag:
        kinds = {name: info.msg_type for name, info in bag.get_type_and_topic_info().topics.items()}
        assert RECORDED.items() <= kinds.items(), kinds
        (goal,) = (read.message for read in bag.read_messages("/joint_trajectory_action/goal"))
        (end,) = (read.message for read in bag.read_messages("/joint_trajectory_action/result"))
    assert goal.goal.trajectory.joint_names == ["joint_1", "joint_2", "joint_3"]
    assert end.status.goal_id.id == goal.goal_id.id and end.status.status == SUCCEEDED
