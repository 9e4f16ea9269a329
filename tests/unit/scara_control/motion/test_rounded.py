"""Ways with places in between: near each of them, within all limits, and sooner than with stops."""

from __future__ import annotations

import math
from functools import cache
from itertools import pairwise
from random import Random

import numpy as np
import pytest
from harness.kdl_chain import KdlChain
from harness.running.thorough import examples, thorough
from scara_config import load_robot, package_folder
from scara_config.payload import load_payloads
from scara_control.config import load_motion
from scara_control.dynamics.arm_model_io import ArmModel
from scara_control.dynamics.effort import load_of
from scara_control.dynamics.planner import Planner
from scara_control.errors import ScaraControlError
from scara_control.joint_motion import JointMotion
from scara_control.kinematics.tool import tool_kinematics
from scara_control.kinematics.tool_path import check_way

WAYS = examples(6, 100)
"""Random ways of each robot and kind."""
STEP_S = 0.002
"""Between two looks at a path."""


@cache
def arm(name: str):
    """Return a shipped robot, its tool, and where another library has the tool, shape (3,)."""
    robot = load_robot(package_folder("scara_config") / "robots" / name)
    tool = tool_kinematics(robot)
    chain = KdlChain(tool.joints, robot.home_pose)
    columns = [robot.twin_joints.index(joint) for joint in tool.joints]
    return robot, tool, lambda q: chain.pose([q[column] for column in columns])[:, 3]


def drawn(robot, random: Random, count: int) -> list[tuple[float, ...]]:
    """Return joint positions somewhere, each near the one in front of it."""
    places = [[random.uniform(0.7 * j.lower, 0.7 * j.upper) for j in robot.twin_joints]]
    for _ in range(count - 1):
        by = [random.uniform(-0.15, 0.15) * (j.upper - j.lower) for j in robot.twin_joints]
        moved = zip(places[-1], by, robot.twin_joints)
        places.append([min(max(q + d, j.lower), j.upper) for q, d, j in moved])
    return [tuple(q) for q in places]


def seen(place, path) -> tuple[list[JointMotion], np.ndarray]:
    """Return the motion at many times, and where the tool is then, shape (m, 3)."""
    count = math.ceil(path.duration / STEP_S)
    motions = [path.at(path.duration * k / count) for k in range(count + 1)]
    return motions, np.array([place(m.q) for m in motions])


def assert_within_limits(robot, motions: list[JointMotion], percent: float) -> None:
    """Positions go on without a jump; no joint exceeds its limits, but between two looks."""
    q, qdot, qddot = (np.array([getattr(m, n) for m in motions]) for n in ("q", "qdot", "qddot"))
    for k, joint in enumerate(robot.twin_joints):
        fastest = joint.velocity * percent / 100.0
        assert np.abs(qdot[:, k]).max() <= 1.01 * fastest
        assert np.abs(qddot[:, k]).max() <= 1.01 * joint.acceleration
        assert np.abs(np.diff(qddot[:, k])).max() <= 1.1 * joint.jerk * STEP_S
        assert np.abs(np.diff(q[:, k])).max() <= 1.01 * fastest * STEP_S
        assert joint.lower - 1e-6 <= q[:, k].min() and q[:, k].max() <= joint.upper + 1e-6


@pytest.mark.parametrize(
    ("name", "path"),
    [
        ("fanuc_sr6ia", "linear"),
        ("scara_4axis", "joint"),
        ("articulated_six", "joint"),
        *thorough(
            ("fanuc_sr6ia", "joint"), ("scara_4axis", "linear"), ("articulated_six", "linear")
        ),
    ],
)
def test_the_tool_passes_each_place_within_the_stated_distance_and_sooner(name, path) -> None:
    """Random places; off the straight legs only near a corner, and never beyond a limit."""
    robot, tool, place = arm(name)
    planner, random, found, quicker = Planner(robot.twin_joints, tool), Random(5), 0, 0
    while found < WAYS:
        begin, *via, end = drawn(robot, random, 4)
        corner = random.uniform(2.0, 30.0)
        flat = [q for each in via for q in each]
        rounded, stopping = (
            check_way(robot.twin_joints, path, flat, corner_mm=mm) for mm in (corner, 0.0)
        )
        start = JointMotion.at_rest(begin)
        try:
            made = planner.move(start, end, 60.0, rounded)
            slow = planner.move(start, end, 60.0, stopping)
        except ScaraControlError:
            continue
        found += 1
        assert made.at(0.0).q == pytest.approx(begin, abs=1e-9)
        assert made.at(made.duration) == JointMotion.at_rest(end)
        motions, places = seen(place, made)
        assert_within_limits(robot, motions, 60.0)
        for passed in via:
            away = np.linalg.norm(places - place(passed), axis=1).min()
            assert away <= 1e-3 * corner + 1e-6
        assert made.duration <= slow.duration + 1e-9
        quicker += made.duration < 0.99 * slow.duration
    # A joint that turns back in a corner comes to rest there, whatever the corner.
    assert quicker > (WAYS // 2 if path == "linear" else 0)


def test_between_its_corners_the_tool_stays_on_the_lines() -> None:
    """A square of 100 mm: further than the distance from a corner, it is on a side."""
    robot, tool, place = arm("fanuc_sr6ia")
    planner = Planner(robot.twin_joints, tool)
    corners = [(0.40, -0.05), (0.50, -0.05), (0.50, 0.05), (0.40, 0.05)]
    table = tuple(0.0 for joint in robot.twin_joints if joint not in tool.joints)
    elbow = tool.elbow(tool.inverse(0.4, 0.0, 0.1, None, None).chosen.q)
    joints = [(*tool.inverse(x, y, 0.1, elbow, None).chosen.q, *table) for x, y in corners]
    way = check_way(
        robot.twin_joints, "linear", [q for each in joints[1:] for q in each], 100.0, 8.0
    )
    path = planner.move(JointMotion.at_rest(joints[0]), joints[0], 100.0, way)
    _, places = seen(place, path)
    square = np.array([*corners, corners[0]])
    for x, y, z in places:
        to_corner = min(math.dist((x, y), corner) for corner in corners)
        sides = [off(np.array([x, y]), a, b) for a, b in pairwise(square)]
        assert z == pytest.approx(0.1, abs=1e-5)
        assert min(sides) < 1e-5 or to_corner <= 8.0e-3
    passed = [min(np.linalg.norm(places[:, :2] - c, axis=1)) for c in np.array(corners[1:])]
    assert min(passed) > 5e-4, "the corners are rounded"
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / STEP_S
    assert speeds.max() <= 0.1 * 1.01
    # It never stops in a corner.
    inside = speeds[len(speeds) // 20 : -len(speeds) // 20]
    assert inside.min() > 0.03


def off(point: np.ndarray, begin: np.ndarray, end: np.ndarray) -> float:
    """Return the distance of a point from a straight piece."""
    whole = end - begin
    along = min(max(float((point - begin) @ whole / (whole @ whole)), 0.0), 1.0)
    return float(np.linalg.norm(point - begin - along * whole))


def test_a_joint_that_turns_back_comes_to_rest_in_the_corner() -> None:
    """To and fro by one joint: it cannot turn back sooner than its limits let it."""
    robot, tool, place = arm("fanuc_sr6ia")
    home = tuple(0.0 for _ in robot.twin_joints)
    there = (0.8, *home[1:])
    way = check_way(robot.twin_joints, "joint", there, corner_mm=50.0)
    path = Planner(robot.twin_joints, tool).move(JointMotion.at_rest(home), home, 100.0, way)
    motions, _ = seen(place, path)
    assert_within_limits(robot, motions, 100.0)


def test_a_stop_at_each_place_reaches_it() -> None:
    """Without a distance."""
    robot, tool, place = arm("fanuc_sr6ia")
    begin, via, end = drawn(robot, Random(3), 3)
    way = check_way(robot.twin_joints, "joint", via)
    path = Planner(robot.twin_joints, tool).move(JointMotion.at_rest(begin), end, 60.0, way)
    motions, _ = seen(place, path)
    rest = [m for m in motions if max(map(abs, m.qdot)) < 1e-3 * math.pi]
    assert any(m.q == pytest.approx(via, abs=1e-4) for m in rest)


def test_the_announced_way_holds_each_corner_as_it_is_driven() -> None:
    """The controller judges zones straight from one of its places to the next."""
    robot, tool, place = arm("scara_4axis")
    begin, via, end = drawn(robot, Random(4), 3)
    way = check_way(robot.twin_joints, "joint", via, corner_mm=20.0)
    path = Planner(robot.twin_joints, tool).move(JointMotion.at_rest(begin), end, 60.0, way)
    motions, _ = seen(place, path)
    corners = np.array(path.corners)
    for motion in motions:
        away = [off(np.array(motion.q), a, b) for a, b in pairwise(corners) if (a != b).any()]
        assert min(away) < 2e-3


@pytest.mark.parametrize("seed", range(4))
def test_a_heavy_tool_rounds_no_corner_beyond_its_efforts(seed: int) -> None:
    """What the legs may ask for is what the corner may ask for."""
    robot, tool, _ = arm("fanuc_sr6ia")
    config = package_folder("scara_config")
    planner = Planner(robot.twin_joints, tool)
    names = [joint.name for joint in robot.twin_joints]
    heaviest = load_payloads(config).payloads[-1]
    model = ArmModel(robot.description, names, robot.tool_frame, gravity=9.81, payloads=(heaviest,))
    load = load_of(model, robot.twin_joints, load_motion(config).move.effort_percent)
    planner.load = load
    begin, via, end = drawn(robot, Random(seed), 3)
    way = check_way(robot.twin_joints, "joint", via, corner_mm=40.0)
    path = planner.move(JointMotion.at_rest(begin), end, 100.0, way)
    count = math.ceil(path.duration / STEP_S)
    shares = [max(load.shares(path.at(path.duration * k / count))) for k in range(count + 1)]
    assert max(shares) <= 1.03
