"""Inverse kinematics by numbers: it arrives, within the limits, and says why not."""

from __future__ import annotations

import itertools
import math
import re
from functools import cache

import msgspec
import numpy as np
import pytest
from harness.workspace import ROOT
from hypothesis import given, settings
from hypothesis import strategies as st
from scara_config import Robot, load_robot
from scara_config.profile import CHOICE
from scara_control.errors import JointVectorError, ScaraControlError, UnreachableError
from scara_control.kinematics import numeric
from scara_control.kinematics.jacobians import tip_jacobian
from scara_control.kinematics.numeric import NumericArm, inverse, tool_velocity_of, velocities_for
from scara_control.kinematics.screws import ScrewModel, forward_kinematics
from scara_control.kinematics.tool import NumericTool, ScaraTool, tool_kinematics


@pytest.fixture(scope="module")
def robot() -> Robot:
    """Return the six-joint robot."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(CHOICE, "articulated_six")
        return load_robot(ROOT / "config")


@pytest.fixture(scope="module")
def arm(robot: Robot) -> NumericArm:
    """Return its arm."""
    return NumericArm.from_robot(robot)


def test_the_profile_decides_how_the_arm_is_solved(robot: Robot) -> None:
    """With geometry in closed form, without by numbers."""
    assert isinstance(tool_kinematics(robot), NumericTool)
    assert isinstance(tool_kinematics(load_robot(ROOT / "config")), ScaraTool)


@settings(max_examples=30)
@given(st.floats(0.25, 0.5), st.floats(-1.0, 1.0), st.floats(0.12, 0.45))
def test_a_point_in_front_of_the_arm_is_reached_with_the_tool_as_at_home(
    arm: NumericArm, radius: float, angle: float, z: float
) -> None:
    """Forward kinematics of the answer is the question, to 0.1 um and within the limits."""
    target = (radius * math.cos(angle), radius * math.sin(angle), z)
    if math.dist((radius, z + 0.08), (0.0, 0.3)) > 0.58:
        return
    q = inverse(arm, target)
    pose = forward_kinematics(arm.chain, q)
    np.testing.assert_allclose(pose[:3, 3], target, atol=1e-7)
    np.testing.assert_allclose(pose[:3, :3], arm.rotation, atol=1e-6)
    assert all(joint.lower <= value <= joint.upper for joint, value in zip(arm.joints, q))


def test_the_answer_stays_near_its_seed(arm: NumericArm) -> None:
    """A small step of the tool is a small step of the joints."""
    first = inverse(arm, (0.40, 0.0, 0.24))
    second = inverse(arm, (0.401, 0.002, 0.24), seed=first)
    assert max(abs(a - b) for a, b in zip(first, second)) < math.radians(1.0)


def test_a_seed_beyond_the_limits_leads_to_an_answer_within(arm: NumericArm) -> None:
    """A drive may stand a little outside, and a person may type anything."""
    for seed in (arm.upper + 0.1, arm.lower - 0.1):
        answer = inverse(arm, (0.40, 0.0, 0.24), seed=seed)
        assert arm.tool_position(answer) == pytest.approx((0.40, 0.0, 0.24), abs=1e-6)
        assert (arm.lower <= answer).all() and (answer <= arm.upper).all()


@pytest.mark.parametrize(
    ("target", "options", "error", "text"),
    [
        (
            (1.5, 0.0, 0.3),
            {},
            UnreachableError,
            r"target \(1\.5, 0, 0\.3\) m, the tool as at home: not reached .* mm away",
        ),
        ((math.nan, 0.0, 0.3), {}, UnreachableError, "is not finite"),
        ((0.4, 0.0, 0.24), {"elbow_wanted": True}, ScaraControlError, "no righty and lefty"),
        (
            (0.4, 0.0, 0.24),
            {"seed": (0.0, 0.0)},
            JointVectorError,
            "got 2 joint values, expected 6",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_its_reason(
    arm: NumericArm,
    target: tuple[float, ...],
    options: dict[str, object],
    error: type[Exception],
    text: str,
) -> None:
    """Out of reach with how near it came; a question for another arm; a wrong seed."""
    with pytest.raises(error, match=text):
        inverse(arm, target, **options)  # type: ignore[arg-type]


@cache
def arm_of(name: str) -> NumericArm:
    """Return the arm of a robot, as if it had no closed form."""
    return NumericArm.from_robot(load_robot(ROOT / "config" / "robots" / name))


@pytest.mark.parametrize("name", ["articulated_six", "scara_4axis"])
@given(shares=st.lists(st.floats(0.0, 1.0), min_size=6, max_size=6))
def test_no_pose_is_beyond_the_stretched_arm(name: str, shares: list[float]) -> None:
    """A bound below the true reach would refuse what can be reached; one has a slide."""
    arm = arm_of(name)
    place, radius = arm.reach
    q = arm.lower + np.array(shares[: len(arm.joints)]) * (arm.upper - arm.lower)
    assert math.dist(arm.tool_position(q), place) <= radius + 1e-12


def test_a_point_beyond_the_stretched_arm_is_refused_without_a_search(
    arm: NumericArm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """All starts take tenths of a second, in which a controller's engine does nothing else."""
    place, radius = arm.reach
    tip = arm.tool_position([0.0, 0.0, -math.pi / 2, 0.0, 0.0, 0.0])
    assert math.dist(tip, place) == pytest.approx(radius), "the bound is that of the stretched arm"
    monkeypatch.setattr(numeric, "_descend", pytest.fail)
    x, y, z = place
    with pytest.raises(UnreachableError, match="the stretched arm ends 100 mm away"):
        inverse(arm, (x + radius + 0.1, y, z))


def test_how_near_it_came_is_no_farther_than_a_point_that_it_reaches(arm: NumericArm) -> None:
    """With the tool as at home: a pose that turns it is not the better one for it."""
    within = (0.58, 0.0, 0.3)
    inverse(arm, within)
    target = (0.8, 0.0, 0.3)
    with pytest.raises(UnreachableError) as refused:
        inverse(arm, target)
    (told,) = re.findall(r"ends (\S+) mm away", str(refused.value))
    assert 0.0 < float(told) <= 1e3 * math.dist(within, target)


def test_joint_velocities_give_the_wanted_tool_velocity(arm: NumericArm) -> None:
    """Away from a singularity exactly, there damped and said so."""
    q = inverse(arm, (0.36, 0.1, 0.3))
    answer = velocities_for(arm, q, (0.05, -0.02, 0.03))
    assert not answer.damped
    np.testing.assert_allclose(
        tool_velocity_of(arm, q, answer.qdot), (0.05, -0.02, 0.03), atol=1e-9
    )
    turning = (tip_jacobian(arm.chain, q) @ np.array(answer.qdot))[:3]
    np.testing.assert_allclose(turning, 0.0, atol=1e-9, err_msg="the tool keeps its orientation")
    straight = velocities_for(arm, [0.0, 0.0, -math.pi / 2, 0.0, 0.0, 0.0], (0.05, 0.0, 0.05))
    assert straight.damped and all(math.isfinite(value) for value in straight.qdot)


def test_damping_costs_little_of_what_the_arm_can_do(arm: NumericArm) -> None:
    """Stretched straight up, it still moves sideways, but for a percent."""
    q = [0.0, 0.0, -math.pi / 2, 0.0, 0.0, 0.0]
    answer = velocities_for(arm, q, (0.05, 0.0, 0.0))
    assert answer.damped
    np.testing.assert_allclose(tool_velocity_of(arm, q, answer.qdot)[0], 0.05, rtol=0.01)


def test_of_three_solutions_by_chance_the_nearest_to_the_seed_is_given(
    arm: NumericArm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where neither the seed nor home leads there; the first found is seldom the nearest."""
    seed = np.array(arm.home)
    far, near, nearest = seed + 0.3, seed + 0.2, seed + 0.1
    starts = [seed, seed, far, nearest, near, seed + 0.05]
    target = (0.4, 0.0, 0.2)

    def pose(chain: ScrewModel, q: np.ndarray) -> np.ndarray:
        there = np.eye(4)
        there[:3, :3], there[:3, 3] = arm.rotation, target if q is not seed else (1.0, 0.0, 0.0)
        return there

    monkeypatch.setattr(numeric, "_starts", lambda arm, start: iter(starts))
    monkeypatch.setattr(numeric, "_descend", lambda arm, place, begin: begin)
    monkeypatch.setattr(numeric, "forward_kinematics", pose)
    assert inverse(arm, target, seed=seed) == pytest.approx(tuple(nearest))


def test_the_same_question_is_looked_at_from_the_same_starts(
    arm: NumericArm, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An arm gives the same answer to it each time, also where the seed does not lead there."""
    asked: list[np.ndarray] = []

    def stay(arm: NumericArm, place: np.ndarray, begin: np.ndarray) -> np.ndarray:
        asked.append(begin)
        return begin

    monkeypatch.setattr(numeric, "_descend", stay)
    for _ in range(2):
        with pytest.raises(UnreachableError):
            inverse(arm, (0.4, 0.1, 0.3))
    first, again = np.split(np.array(asked), 2)
    assert len(np.unique(first, axis=0)) > arm.starts
    np.testing.assert_array_equal(first, again)


def test_yaw_turns_the_tool_about_the_vertical_from_how_it_is_at_home(robot: Robot) -> None:
    """The place is kept, the tool turned about z of the base; the arm tells the same yaw."""
    tool, home = tool_kinematics(robot), tuple(robot.home_positions)
    place = tool.position(home)
    q = tool.inverse(*place, None, home, 0.4).chosen.q
    assert tool.position(q) == pytest.approx(place, abs=2e-7)
    assert tool.turns and tool.yaw(q) == pytest.approx(0.4, abs=2e-6)
    assert tool.yaw(home) == pytest.approx(0.0, abs=1e-12)
    turned = tool.joint_velocities(home, (0.0, 0.0, 0.0), 0.3).qdot
    ahead = [at + 1e-6 * rate for at, rate in zip(home, turned)]
    assert tool.yaw(ahead) / 1e-6 == pytest.approx(0.3, rel=1e-3)
    with pytest.raises(UnreachableError, match="target yaw = nan is not finite"):
        tool.inverse(*place, None, home, math.nan)


@pytest.mark.parametrize("joints", [3, 4, 5])
def test_an_arm_of_fewer_joints_comes_to_the_place_turned_as_it_may(
    robot: Robot, joints: int
) -> None:
    """It has no joint for the tool's turn: a yaw is refused, a place and a speed are not."""
    fewer = msgspec.structs.replace(robot, joints=robot.joints[:joints])
    tool = tool_kinematics(fewer)
    assert not tool.turns
    seed = [fewer.home[joint.name] * joint.scale for joint in tool.joints]
    for angle, height in itertools.product((-0.6, 0.0, 0.7), (0.3, 0.4)):
        target = (0.36 * math.cos(angle), 0.36 * math.sin(angle), height)
        q = tool.inverse(*target, None, seed).chosen.q
        assert math.dist(tool.position(q), target) < 1e-7
        wanted = (0.1, -0.05, 0.08)
        given = tool.joint_velocities(q, wanted)
        assert not given.damped
        assert tool.velocity(q, given.qdot) == pytest.approx(wanted, abs=1e-9)
    with pytest.raises(ScaraControlError, match=f"yaw: an arm of {joints} joints cannot choose it"):
        tool.inverse(0.36, 0.0, 0.3, None, seed, 0.1)
    with pytest.raises(ScaraControlError, match=f"yaw: an arm of {joints} joints cannot choose it"):
        tool.joint_velocities(seed, wanted, 0.1)
    with pytest.raises(UnreachableError, match="the tool turned as it may be: not reached"):
        tool.inverse(2.0, 0.0, 0.3, None, seed)


def test_starts_lie_within_the_limits_and_all_over_them(arm: NumericArm) -> None:
    """Behind the seed and home, in each third of each joint's range."""
    starts = np.array(list(numeric._starts(arm, arm.home))[2:])
    shares = (starts - arm.lower) / (arm.upper - arm.lower)
    assert shares.min() >= 0.0 and shares.max() <= 1.0
    assert all(
        len(np.unique(column)) == 3 for column in np.minimum(3.0 * shares, 2.9).astype(int).T
    )


def test_the_place_near_a_guess_is_found_from_some_degrees_away(arm: NumericArm) -> None:
    """Newton goes to all six numbers of a place at once, in a few steps."""
    q = tuple(0.5 * (arm.lower + arm.upper) + 0.2)
    point = forward_kinematics(arm.chain, q)[:3, 3]
    guess = np.array(q) + math.radians(5.0) * np.array([1, -1, 1, -1, 1, -1])
    found = numeric.near(arm, q, guess, point, (0.0, 0.0, 0.0))
    assert found == pytest.approx(q, abs=1e-6)


def test_only_an_arm_that_is_singular_is_damped(arm: NumericArm) -> None:
    """Beside that it moves its tool exactly as it is told."""
    velocity = (0.01, 0.02, -0.01)
    beside = 0
    for bend in np.linspace(0.0, 0.6, 121):
        q = [0.0, 0.0, -math.pi / 2 + bend, 0.4, bend, 0.0]
        answer = velocities_for(arm, q, velocity)
        assert answer.damped == (answer.manipulability < numeric.SINGULAR_BELOW)
        if not answer.damped:
            beside += answer.manipulability < 1.5 * numeric.SINGULAR_BELOW
            assert tool_velocity_of(arm, q, answer.qdot) == pytest.approx(velocity, abs=1e-9)
    assert beside
