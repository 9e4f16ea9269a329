"""The way that a bag holds, and when the suction was switched on it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import rosbag
import rospy
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from what_if.errors import WhatIfError
from what_if.learning.recorded_way_io import read_way
from what_if.world import World

from scara_msgs.msg import GripperState

BEGIN = 1.7e9


def record(folder: Path, world: World, takes: dict[str, int]) -> Path:
    """Write a motion of 1 s, ten samples long; each gripper takes a part at a sample."""
    file = folder / "run.bag"
    names = [joint.name for joint in world.cell.robot.twin_joints]
    with rosbag.Bag(str(file), "w") as bag:
        for k in range(11):
            stamp = rospy.Time.from_sec(BEGIN + 0.1 * k)
            q = (0.1 * k, *world.q[1:])
            joints = JointState(header=Header(stamp=stamp), name=names, position=q)
            bag.write("/real/joint_states", joints, stamp)
            for topic, taken in takes.items():
                gripper = GripperState(header=Header(stamp=stamp), holding=k >= taken)
                bag.write(topic, gripper, stamp)
    return file


@pytest.mark.parametrize("takes", [{"/twin/gripper": 5}, {"/twin/gripper": 3, "/real/gripper": 5}])
def test_of_a_real_robot_the_twin_tells_when_the_suction_was_switched(
    world: World, tmp_path: Path, takes: dict[str, int]
) -> None:
    """The stand-in tells it by itself."""
    ((when, on),) = read_way(world.cell, record(tmp_path, world, takes)).grips
    assert on and when == pytest.approx(0.5, abs=1e-6)


def test_where_there_are_parts_a_bag_without_a_gripper_is_not_judged(
    world: World, tmp_path: Path
) -> None:
    """Whether the arm carried one is not known; a cell without parts needs none."""
    file = record(tmp_path, world, {})
    with pytest.raises(WhatIfError, match="holds no message of real/gripper or twin/gripper"):
        read_way(world.cell, file)
    assert read_way(replace(world.cell, work=None), file).grips == ()


def test_a_way_that_begins_with_a_part_in_hand_is_not_judged(world: World, tmp_path: Path) -> None:
    """It would be judged with an empty one; a cell without parts carries none."""
    file = record(tmp_path, world, {"/twin/gripper": 0})
    with pytest.raises(WhatIfError, match=r"run\.bag: a part is in hand where the way begins"):
        read_way(world.cell, file)
    assert read_way(replace(world.cell, work=None), file).grips == ()
