"""What hangs at the tool: in the arm's dynamics, and in what planned motion may ask of the joints.

Rated motion: both ends anywhere, all speeds and accelerations of robot.yaml.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import pytest
from harness.running.thorough import examples, thorough
from scara_config import Robot, load_robot
from scara_config.payload import Payload, load_payloads
from scara_config.profile import CHOICE
from scara_control.config import load_motion
from scara_control.dynamics.arm_model_io import ArmModel
from scara_control.dynamics.effort import Load, load_of, unplanned_shares
from scara_control.dynamics.payload_links import with_payloads, without_shapes
from scara_control.dynamics.planner import Planner
from scara_control.joint_motion import JointMotion
from scara_control.motion.plan import Path as JointPath
from scara_control.motion.plan import plan_move
from scara_control.motion.time_scaling import ScaleBounds, TimeBase, advance, motion_at
from scara_control.trajectory.goal import GoalError, check_efforts, plan_path

CONFIG = Path(__file__).parents[4] / "config"
ROBOTS = ["fanuc_sr6ia", *thorough("fanuc_sr3ia"), "articulated_six"]
PERCENT = load_motion(CONFIG).move.effort_percent
ROOM = 100.0 / PERCENT
"""What a joint has, in what a plan may ask of it."""


def loaded(robot: Robot, *payloads: Payload) -> Load:
    """Return a robot with payloads at its tool."""
    names = [joint.name for joint in robot.twin_joints]
    model = ArmModel(robot.description, names, robot.tool_frame, gravity=9.81, payloads=payloads)
    return load_of(model, robot.twin_joints, PERCENT)


@pytest.fixture(params=ROBOTS)
def robot(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Robot:
    """Give each robot."""
    monkeypatch.setenv(CHOICE, request.param)
    return load_robot(CONFIG)


@pytest.fixture
def sr6ia() -> Robot:
    """Give the article's robot."""
    return load_robot(CONFIG)


def rated() -> Payload:
    """Return what the chosen robot is rated for."""
    return load_payloads(CONFIG).payloads[-1]


def hard_moves(
    robot: Robot, count: int = examples(30, 60)
) -> Iterator[tuple[JointMotion, list[float]]]:
    """Yield moves of the arm alone, at random and from corner to corner of the workspace."""
    random, joints = np.random.default_rng(7), robot.twin_joints
    arm = [joint.screw_axis is not None for joint in joints]
    for k in range(count):
        ends = [
            [
                (random.choice([joint.lower, joint.upper]) if k % 3 == 0 else
                 random.uniform(joint.lower, joint.upper)) if moves else 0.0
                for joint, moves in zip(joints, arm)
            ]
            for _ in range(2)
        ]  # fmt: skip
        yield JointMotion.at_rest([float(q) for q in ends[0]]), [float(q) for q in ends[1]]


def finest(load: Load, path: JointPath) -> float:
    """Return the most that a path asks, looked at ten times finer than the planner does."""
    return max(max(load.shares(path.at(k * path.duration / 960))) for k in range(961))


def test_payload_adds_its_mass_times_the_square_of_its_distance(sr6ia: Robot) -> None:
    """By hand: Steiner about joint 1 at the straight arm, and its weight on joint 3."""
    payload = Payload(4, "rated", 6.0, (0.0, 0.0, 0.04), (0.01, 0.01, 0.008))
    empty, full = loaded(sr6ia).model, loaded(sr6ia, payload).model
    q, still = (0.0, 0.0, -0.1, 0.0), (0.0,) * 4
    added = np.array(full.mass_matrix(q)) - np.array(empty.mass_matrix(q))
    assert added[0][0] == pytest.approx(6.0 * 0.65**2 + 0.008, rel=1e-9)
    assert added[1][1] == pytest.approx(6.0 * 0.30**2 + 0.008, rel=1e-9)
    assert added[2][2] == pytest.approx(6.0, rel=1e-9)
    weight = np.array(full.inverse_dynamics(q, still, still)) - np.array(
        empty.inverse_dynamics(q, still, still)
    )
    assert weight == pytest.approx([0.0, 0.0, 6.0 * 9.81, 0.0], abs=1e-9)


def test_centre_beside_the_tool_axis_is_further_out(sr6ia: Robot) -> None:
    """0.1 m along y of the tool frame, which points back to joint 1 at home (home_pose)."""
    y_out = [row[1] for row in sr6ia.home_pose[:3]]
    assert y_out[:2] == [0, 0] or math.hypot(*y_out) == pytest.approx(1.0)
    middle = loaded(sr6ia, Payload(1, "x", 2.0)).model
    aside = loaded(sr6ia, Payload(1, "x", 2.0, (0.0, 0.1, 0.0))).model
    q = (0.0,) * 4
    where = np.array([0.65, 0.0]) + 0.1 * np.array(y_out[:2])
    added = aside.mass_matrix(q)[0][0] - middle.mass_matrix(q)[0][0]
    assert added == pytest.approx(2.0 * (where @ where - 0.65**2), rel=1e-9)


def test_two_payloads_count_beside_each_other(sr6ia: Robot) -> None:
    """A tool and the part that it holds."""
    tool, part = Payload(1, "tool", 2.0), Payload(2, "part", 0.05, (0.0, 0.0, 0.01))
    q = (0.3, 0.7, -0.1, 0.0)
    masses = [loaded(sr6ia, *each).model.mass_matrix(q)[2][2] for each in ([], [tool, part])]
    assert masses[1] - masses[0] == pytest.approx(2.05)


def test_empty_payload_changes_no_letter_of_the_description(sr6ia: Robot) -> None:
    """So every figure of the empty twin stays as it was, bit for bit."""
    text = sr6ia.description.read_text()
    assert with_payloads(text, "tool0", [Payload(1, "empty", 0.0)]) == text
    assert "<visual>" not in without_shapes(text) and "<inertial>" in without_shapes(text)


def test_another_payload_takes_the_place_of_the_last(sr6ia: Robot) -> None:
    """As a controller's PAYLOAD[n] does."""
    model, q = loaded(sr6ia, Payload(4, "rated", 6.0)).model, (0.1, 0.2, -0.1, 0.0)
    assert isinstance(model, ArmModel)
    model.carry([])
    assert model.mass_matrix(q) == loaded(sr6ia).model.mass_matrix(q)


def test_rated_load_asks_for_twice_the_effort_where_nothing_follows_it(sr6ia: Robot) -> None:
    """The reason for all this: all speeds and accelerations at once, 6 kg at the tool."""
    load, joints, random = loaded(sr6ia, rated()), sr6ia.twin_joints, np.random.default_rng(5)
    worst = 0.0
    for _ in range(2000):
        q = tuple(float(random.uniform(joint.lower, joint.upper)) for joint in joints)
        signs = random.choice([-1.0, 1.0], (2, len(joints)))
        v = tuple(float(s) * joint.velocity for s, joint in zip(signs[0], joints))
        a = tuple(float(s) * joint.acceleration for s, joint in zip(signs[1], joints))
        worst = max(worst, load.shares(JointMotion(q, v, a))[0] / ROOM)
    assert 1.8 < worst < 2.1


def test_planned_motion_with_the_rated_load_stays_inside_the_efforts(robot: Robot) -> None:
    """At most 100 % of each joint's effort, looked at ten times finer, and robot.yaml's limits."""
    planner = Planner(robot.twin_joints)
    planner.load = loaded(robot, rated())
    before, shares = 0.0, []
    for start, target in hard_moves(robot):
        unloaded = plan_move(robot.twin_joints, start, target, 100.0)
        path = planner.move(start, target, 100.0)
        before = max(before, finest(planner.load, unloaded) / ROOM)
        shares.append(path.share)
        assert finest(planner.load, path) <= ROOM
        assert path.end == tuple(target) and path.duration >= unloaded.duration
        for k, joint in itertools.product(range(97), range(len(target))):
            motion, limit = path.at(k * path.duration / 96), robot.twin_joints[joint]
            assert abs(motion.qdot[joint]) <= limit.velocity * 1.000001
            assert abs(motion.qddot[joint]) <= limit.acceleration * path.share * 1.000001
    assert max(shares) == 1.0  # easy moves keep all of their acceleration
    if robot.name == "fanuc_sr6ia":
        assert before > 1.3 and min(shares) < 0.8


def test_no_acceleration_would_be_left_at_the_worst_pose(sr6ia: Robot) -> None:
    """Why paths are looked at: velocity coupling alone takes more than joint 1 has."""
    load, joints = loaded(sr6ia, rated()), sr6ia.twin_joints
    v = tuple(-joint.velocity for joint in joints)
    poses = [(0.0, q2, -0.1, 0.0) for q2 in np.linspace(-2.6, 2.6, 53).tolist()]
    still = (0.0,) * len(joints)
    assert max(load.shares(JointMotion(q, v, still))[0] for q in poses) > ROOM


def test_empty_arm_is_planned_as_ever(robot: Robot) -> None:
    """The limits of robot.yaml are made for it: no path is slower with the model than without."""
    planner = Planner(robot.twin_joints)
    planner.load = loaded(robot)
    for start, target in hard_moves(robot, 20):
        path = planner.move(start, target, 100.0)
        assert (path.share, path.duration) == (
            1.0,
            plan_move(robot.twin_joints, start, target, 100.0).duration,
        )


def test_slow_motion_keeps_its_acceleration_while_it_fits(sr6ia: Robot) -> None:
    """A path that asks for less than the effort is left alone."""
    planner = Planner(sr6ia.twin_joints)
    planner.load = loaded(sr6ia, rated())
    start = JointMotion.at_rest((0.0, 0.0, -0.1, 0.0))
    assert planner.move(start, (0.0, 0.0, 0.0, 0.0), 100.0).share == 1.0
    assert planner.move(start, (0.0, 0.0, -0.1, 2.0), 100.0).share == 1.0


def test_speed_is_lowered_where_acceleration_alone_does_not_help(sr6ia: Robot) -> None:
    """Both joints from end to end: the coupling of full speeds is more than joint 1 has."""
    load, joints = loaded(sr6ia, rated()), sr6ia.twin_joints
    planner = Planner(joints)
    planner.load = load
    start, target = JointMotion.at_rest((-1.64, -2.61, -0.1, 0.0)), (1.64, 2.61, -0.1, 0.0)
    quicker = plan_move(joints, start, target, 100.0, 0.45)
    path = planner.move(start, target, 100.0)
    assert finest(load, path) <= ROOM < finest(load, quicker)
    assert path.duration < quicker.duration


def test_stop_with_the_rated_load_stays_inside_the_efforts(robot: Robot) -> None:
    """From any point of a planned move, and never with less than half of the acceleration."""
    planner, random = Planner(robot.twin_joints), np.random.default_rng(3)
    planner.load = loaded(robot, rated())
    for start, target in hard_moves(robot, 30):
        path = planner.move(start, target, 100.0)
        stop = planner.stop(path.at(float(random.uniform(0.0, path.duration))))
        assert finest(planner.load, stop) <= ROOM and stop.share >= 0.5


def test_stop_that_no_acceleration_makes_light_enough_is_still_a_stop(sr6ia: Robot) -> None:
    """Whoever stands at the robot comes first: at least half of the accelerations."""
    planner = Planner(sr6ia.twin_joints)
    planner.load = loaded(sr6ia, Payload(1, "far too heavy", 60.0))
    motion = JointMotion((0.0, 1.5, -0.1, 0.0), (7.0, 12.0, 0.0, 0.0), (0.0,) * 4)
    stop = planner.stop(motion)
    assert stop.share == 0.5 and stop.at(stop.duration).qdot == (0.0,) * 4


def test_pause_of_a_loaded_move_stays_inside_the_efforts(sr6ia: Robot) -> None:
    """The time base keeps the share of the accelerations that the path was given."""
    planner, joints = Planner(sr6ia.twin_joints), sr6ia.twin_joints
    planner.load = loaded(sr6ia, rated())
    move = load_motion(CONFIG).move
    bounds, worst = ScaleBounds(move.time_scale_ramp, move.time_scale_jerk), 0.0
    for start, target in hard_moves(sr6ia, 45):
        path = planner.move(start, target, 100.0)
        for begun in (0.2, 0.4, 0.6):
            base = TimeBase(begun * path.duration)
            for _ in range(60):
                base = advance(path, base, 0.0, bounds, joints, 0.01)
                worst = max(worst, max(planner.load.shares(motion_at(path, base))))
            assert base.scale == 0.0 or base.tau >= path.duration
    assert worst <= ROOM


def test_unplanned_motion_gets_the_share_that_any_pose_leaves_it(robot: Robot) -> None:
    """All joints at once, in any direction, anywhere; a table that is not coupled keeps its own."""
    load, joints = loaded(robot, rated()), robot.twin_joints
    shares = unplanned_shares(load, joints)
    random = np.random.default_rng(11)
    for _ in range(300):
        q = tuple(float(random.uniform(joint.lower, joint.upper)) for joint in joints)
        a = tuple(
            float(random.choice([-1.0, 1.0])) * share * joint.acceleration
            for share, joint in zip(shares, joints)
        )
        assert max(load.shares(JointMotion(q, (0.0,) * len(joints), a))) <= 1.0
    assert all(0.0 < share <= 1.0 for share in shares)
    if robot.name == "fanuc_sr6ia":
        assert shares[0] == shares[1] < 0.9 and shares[2:] == (1.0, 1.0)


@pytest.mark.parametrize("count", [8, 9])
def test_an_arm_of_many_joints_is_looked_at_in_as_many_poses_as_take_half_a_second(
    sr6ia: Robot, count: int
) -> None:
    """Five of each would be minutes at each change of the payload."""
    looked: list[Sequence[float]] = []

    class Model:
        friction = damping = (0.0,) * count

        def inverse_dynamics(self, q: Sequence[float], *_: object) -> tuple[float, ...]:
            looked.append(q)
            return (0.0,) * count

        def mass_matrix(self, _: object) -> list[list[float]]:
            return np.eye(count).tolist()

    joints = [sr6ia.twin_joints[0]] * count
    shares = unplanned_shares(Load(Model(), (1e9,) * count), joints)  # type: ignore[arg-type]
    assert shares == (1.0,) * count and 2**count <= len(looked) <= 20_000


def test_goal_that_asks_for_more_than_the_effort_is_refused_with_joint_and_time(
    sr6ia: Robot,
) -> None:
    """Somebody else's plan is not made slower; without the payload it is fine. Table left out."""
    joints, rest = sr6ia.twin_joints, (-1.64, -2.3, -0.1, 0.3)
    path = plan_path(joints[:2], rest[:2], [JointMotion((1.64, 2.3), (), (), 0.80)])
    check_efforts(joints, loaded(sr6ia), path, [0, 1], rest, 0.01)
    text = r"joint_1 is asked for \d+\.?\d* N m 0\.\d\d s after the start, .* are 285: give it more"
    with pytest.raises(GoalError, match=text):
        check_efforts(joints, loaded(sr6ia, rated()), path, [0, 1], rest, 0.01)
    slower = plan_path(joints[:2], rest[:2], [JointMotion((1.64, 2.3), (), (), 1.6)])
    check_efforts(joints, loaded(sr6ia, rated()), slower, [0, 1], rest, 0.01)
