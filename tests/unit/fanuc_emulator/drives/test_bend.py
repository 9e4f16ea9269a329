"""Other ways to bend an arm are ways to the same place, whichever way its joints count."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import msgspec
import numpy as np
import pytest
from fanuc_emulator.drives.arm import Arm
from fanuc_emulator.drives.bend import Bend
from harness.workspace import ROOT
from scara_config import Robot, load_robot

ROBOTS = ROOT / "config" / "robots"
SCARA, SIX = load_robot(ROBOTS / "fanuc_sr6ia"), load_robot(ROBOTS / "articulated_six")


def counted(robot: Robot, backwards: Sequence[int]) -> Robot:
    """Return a robot some of whose turning joints count the other way round."""
    replace = msgspec.structs.replace
    joints = list(robot.joints)
    for k in backwards:
        turned = tuple(-v for v in joints[k].screw_axis or ())
        joints[k] = replace(joints[k], screw_axis=turned)
    return replace(robot, joints=tuple(joints))


def off(one: Sequence[float], other: Sequence[float]) -> float:
    """Return how far two ways to stand are apart; whole turns do not count [rad]."""
    return max(abs(math.remainder(a - b, math.tau)) for a, b in zip(one, other))


@pytest.mark.parametrize("backwards", [(), (1,), (2,), (1, 2), (0, 4), (3, 5), range(6)])
def test_six_joints_are_told_all_eight_ways_to_a_place(backwards: Sequence[int]) -> None:
    """Each leads there, the one that the place was made by is among them, and no two are alike."""
    robot = counted(SIX, backwards)
    arm = Arm(robot)
    bend = Bend(robot, arm)
    low, high = np.array([(joint.lower, joint.upper) for joint in robot.joints]).T
    rng, most = np.random.default_rng(7), 0
    for q in rng.uniform(0.4 * low, 0.4 * high, (20, 6)):
        goal = arm.pose(q)
        here, *arms = bend.guesses(goal, [0.1] * 6)
        assert here == (0.1,) * 6
        ways = [way for each in arms for way in bend.alike(each)]
        assert len(ways) == 2 * len(arms)
        for way in ways:
            assert arm.pose(way) == pytest.approx(goal, abs=1e-9)
        assert min(off(q, way) for way in ways) < 1e-6
        assert min(off(*two) for two in itertools.combinations(ways, 2)) > 1e-3
        most = max(most, len(ways))
    assert most == 8


def test_an_arm_of_two_links_is_looked_for_all_round_with_either_elbow() -> None:
    """Nowhere more than 1.3 rad from a beginning, each with the elbow a quarter turn out."""
    arm = Arm(SCARA)
    here = (0.3, 0.5, -0.1, 0.2)
    first, *others = Bend(SCARA, arm).guesses(arm.pose(here), here)
    assert first == here
    for side in (1.0, -1.0):
        same = [each for each in others if each[1] * side > 0.0]
        assert all(each[1] == pytest.approx(side * math.pi / 2.0) for each in same)
        assert all(each[2:] == here[2:] for each in same)
        round_ = sorted(each[0] % math.tau for each in same)
        gaps = np.diff([*round_, round_[0] + math.tau])
        assert len(same) == 6 and max(gaps) < 1.3
