"""What the simulator lets in and what it refuses."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from scara_config import load_robot
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.motion.commands import Command
from scara_simulation.command_desk import CommandDesk
from scara_simulation.commands import CommandError, CommandGate
from scara_simulation.config import load_simulation
from scara_simulation.joints.control import JointControl

CONFIG = Path(__file__).parents[4] / "config"
ROBOT = load_robot(CONFIG)
ALL = ["joint_1", "joint_2", "joint_3", "table_joint"]


@pytest.fixture
def gate():
    """Give the gate of the shipped configuration."""
    return CommandGate(ROBOT, load_simulation(ROBOT, CONFIG))


def point(time=0.0, q=(0.0,), v=(0.0,), a=(0.0,)):
    """Make a point of a message."""
    return JointMotion(tuple(q), tuple(v), tuple(a), time)


def setpoints(names, points):
    """Make a message of points."""
    return Setpoints(tuple(names), tuple(points))


@pytest.mark.parametrize(
    ("joint", "value", "taken"),
    [
        ("joint_1", 1.0, 1.0),
        ("joint_3", -0.21, -0.21),
        ("joint_3", 0.000005, 0.0),
        ("table_joint", -3.1, -3.1),
    ],
)
def test_position_within_the_limits_is_taken(gate, joint, value, taken):
    """Noise of less than a display digit beyond a limit is pulled to the limit."""
    assert gate.position(joint, value) == taken


@pytest.mark.parametrize(
    ("joint", "value", "why"),
    [
        ("joint_1", 2.7, r"joint_1 = 2\.7 rad is outside \[-2\.58309, 2\.58309\] rad"),
        ("joint_3", 0.001, r"joint_3 = 0\.001 m is outside \[-0\.21, 0\] m"),
        ("joint_1", math.nan, "joint_1 = nan: not finite"),
        ("joint_1", -math.inf, "joint_1 = -inf: not finite"),
        (
            "joint_4",
            0.0,
            "unknown joint 'joint_4': the twin has joint_1, joint_2, joint_3, table_joint",
        ),
    ],
)
def test_position_that_cannot_be_is_refused(gate, joint, value, why):
    """The text names joint, value and allowed range."""
    with pytest.raises(CommandError, match=why):
        gate.position(joint, value)


@pytest.mark.parametrize(
    ("joint", "value", "why"),
    [
        ("joint_3", 2.5, r"joint_3 velocity = 2\.5 m/s is outside \[-2, 2\] m/s"),
        ("joint_2", math.nan, "joint_2 velocity = nan: not finite"),
        ("elbow", 0.1, "unknown joint 'elbow'"),
    ],
)
def test_velocity_that_cannot_be_is_refused(gate, joint, value, why):
    """As for positions."""
    with pytest.raises(CommandError, match=why):
        gate.velocity(joint, value)


def test_velocity_within_the_limit_is_taken(gate):
    """Up to the joint's maximum speed."""
    assert gate.velocity("joint_3", -2.0) == -2.0


def test_set_points_of_some_joints_become_a_track(gate):
    """The track has the message's joints in the message's order."""
    points = [point(1.0, (0.5, 0.1), (0.0, 0.2), (0.0, 0.0))]
    track = gate.track(setpoints(["table_joint", "joint_1"], points), now=0.9)
    assert track.sample(1.0) == ([0.5, 0.1], [0.0, 0.2], [0.0, 0.0])


def test_missing_velocities_and_accelerations_count_as_zero(gate):
    """A bare position is a set point at rest."""
    assert gate.track(setpoints(["joint_1"], [point(0.0, (0.3,), (), ())]), now=0.0).sample(
        5.0
    ) == ([0.3], [0.0], [0.0])


def test_set_point_may_pass_a_speed_limit_by_the_tolerance_only(gate):
    """A real robot's measured speed is noisy."""
    limit = ROBOT.joint("joint_1").velocity
    gate.track(setpoints(["joint_1"], [point(v=(limit * 1.19,))]), now=0.0)
    with pytest.raises(CommandError, match=r"joint_1 velocity = 9\.2.* rad/s is outside"):
        gate.track(setpoints(["joint_1"], [point(v=(limit * 1.21,))]), now=0.0)


@pytest.mark.parametrize(
    ("names", "points", "now", "why"),
    [
        (["joint_9"], [point()], 0.0, "unknown joint 'joint_9'"),
        (
            ["joint_1", "joint_1"],
            [point(q=(0, 0), v=(0, 0), a=(0, 0))],
            0.0,
            "name each joint once",
        ),
        ([], [point()], 0.0, "name each joint once"),
        (["joint_1"], [], 0.0, "no points"),
        (["joint_1"], [point(q=(0.0, 1.0))], 0.0, "point 0: 2 positions for 1 joints"),
        (["joint_1"], [point(v=(0.0, 1.0))], 0.0, "point 0: 2 velocities for 1 joints"),
        (["joint_1"], [point(q=(math.nan,))], 0.0, "positions = .*not finite"),
        (["joint_1"], [point(a=(math.inf,))], 0.0, "accelerations = .*not finite"),
        (["joint_1"], [point(q=(3.0,))], 0.0, "joint_1 = 3 rad is outside"),
        (["joint_1"], [point(a=(1e6,))], 0.0, r"joint_1 acceleration = 1e\+06 rad/s\^2 is outside"),
        (["joint_1"], [point(1.0), point(1.0)], 1.0, "is not after point 0"),
        (
            ["joint_1"],
            [point(1.0)],
            1.2,
            r"stale: the last point was due 0\.200 s ago, allowed are 0\.05 s",
        ),
        (["joint_1"], [point(9.0)], 1.2, r"due in 7\.800 s, allowed are 1 s"),
    ],
)
def test_set_points_that_cannot_be_followed_are_refused(gate, names, points, now, why):
    """A message is taken whole or not at all."""
    with pytest.raises(CommandError, match=why):
        gate.track(setpoints(names, points), now)


def test_clock_that_is_set_back_lets_no_set_point_past_an_emergency_stop(gate):
    """The motion nodes may end their ramp, once; the hour that comes again is no ramp."""
    desk = CommandDesk(JointControl([], [], [], 1e-3, None), gate, load_simulation(ROBOT, CONFIG))
    desk.obey(Command.ESTOP, 4000.0)
    message = setpoints([], [point()])
    for now in (400.0, 3999.9, 4060.0):
        with pytest.raises(CommandError, match="RESET first"):
            desk.track(message, now)
    desk.obey(Command.RESET, 400.0)
    with pytest.raises(CommandError, match=r"^(?!.*RESET)"):
        desk.track(message, 400.0)
