"""One closed form for every SCARA: 3 or 4 axes in any order, each sign, either way up."""

from __future__ import annotations

import math
from typing import NamedTuple

import msgspec
import numpy as np
import pytest
from harness.kdl_chain import KdlChain
from scara_config import Robot, load_robot
from scara_config.robot import Geometry
from scara_control.errors import (
    JointLimitError,
    JointVectorError,
    ScaraControlError,
    UnreachableError,
)
from scara_control.kinematics.jacobians import tip_jacobian
from scara_control.kinematics.scara import (
    Elbow,
    Scara,
    branches,
    solve,
    solve_elbow,
    tool_position,
    tool_yaw,
)
from scara_control.kinematics.scara_velocity import joint_velocities, tool_velocity
from scara_control.kinematics.screws import ScrewModel

POSES = 3000
L1, L2, H = 0.325, 0.225, 0.12
SHIPPED = load_robot()
STROKE = msgspec.structs.replace(SHIPPED.joint("joint_3"), lower_mm=-150.0, upper_mm=0.0)
ARM, WRIST = SHIPPED.joint("joint_2"), SHIPPED.joint("joint_4")


class Kind(NamedTuple):
    """A way to build a SCARA: the order of its joints, their signs, and how it stands at zero."""

    order: str = "1234"
    signs: tuple[float, ...] = (1.0, 1.0, 1.0, 1.0)
    base: tuple[float, float] = (0.0, 0.0)
    heading: float = 0.0
    bent: float = 0.0
    offset: tuple[float, float] = (0.0, 0.0)
    limit_deg: float = 150.0
    wrist_deg: float = 360.0


KINDS = {
    "three axes": Kind("123"),
    "R R P R": Kind(),
    "R R R P": Kind("1243"),
    "P R R R": Kind("3124"),
    "R P R R, quill below, positive down": Kind("1324", (1.0, 1.0, -1.0, 1.0)),
    "wrist against the arms": Kind("1234", (1.0, 1.0, 1.0, -1.0)),
    "elbow against the shoulder": Kind("1243", (1.0, -1.0, -1.0, -1.0)),
    "hung from the ceiling": Kind("1234", (-1.0, -1.0, -1.0, -1.0)),
    "three axes, hung": Kind("312", (-1.0, -1.0, 1.0)),
    "beside the base's origin, bent at zero": Kind(base=(0.2, -0.3), heading=2.0, bent=-1.2),
    "tool off the wrist": Kind("1243", (1.0, 1.0, -1.0, -1.0), offset=(0.03, -0.05)),
    "more than a turn": Kind(heading=-3.0, limit_deg=400.0, wrist_deg=800.0),
}


def made(kind: Kind) -> Robot:
    """Return a robot of 325 and 225 mm, built as ``kind`` says."""
    shoulder = complex(*kind.base)
    elbow = shoulder + L1 * np.exp(1j * kind.heading)
    wrist = elbow + L2 * np.exp(1j * (kind.heading + kind.bent))
    tip = wrist + complex(*kind.offset)
    joints = []
    for number in kind.order:
        sign = kind.signs[int(number) - 1]
        place = {"1": shoulder, "2": elbow, "4": wrist}.get(number)
        if place is None:
            screw, joint = (0.0, 0.0, 0.0, 0.0, 0.0, sign), STROKE
            if sign < 0.0:
                joint = msgspec.structs.replace(joint, lower_mm=0.0, upper_mm=150.0)
        else:
            screw = (0.0, 0.0, sign, sign * place.imag, -sign * place.real, 0.0)
            limit = kind.wrist_deg if number == "4" else kind.limit_deg
            joint = WRIST if number == "4" else ARM
            joint = msgspec.structs.replace(joint, lower_deg=-limit, upper_deg=limit)
        joints.append(
            msgspec.structs.replace(joint, name=f"joint_{number}", twin=True, screw_axis=screw)
        )
    home = ((0.0, -1.0, 0.0, tip.real), (-1.0, 0.0, 0.0, tip.imag), (0.0, 0.0, -1.0, H))
    return msgspec.structs.replace(
        SHIPPED,
        name="made_up",
        joints=joints,
        home_pose=(*home, (0.0, 0.0, 0.0, 1.0)),
        geometry=Geometry(1e3 * L1, 1e3 * L2, 1e3 * H),
    )


def poses(scara: Scara, count: int = POSES) -> np.ndarray:
    """Return joint positions all over the ranges, both elbows."""
    return np.random.default_rng(7).uniform(*np.array(scara.limits).T, (count, len(scara.joints)))


def turn(angle: float) -> np.ndarray:
    """Return the rotation about z."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS.keys())
def test_kdl_finds_the_tool_where_the_closed_form_says_and_puts_it(kind):
    """3000 poses of each kind and both elbows: 1e-12 m, and 1e-12 of every entry of the turn."""
    robot = made(kind)
    scara, kdl, home = (
        Scara.from_robot(robot),
        KdlChain(robot.joints, robot.home_pose),
        np.array(robot.home_pose)[:3, :3],
    )
    # Of a tool without a wrist the place alone can be asked for.
    part = slice(3, 4) if scara.axes.wrist is None else slice(0, 4)
    reached = dict.fromkeys(Elbow, 0)
    for q in poses(scara).tolist():
        pose, yaw = kdl.pose(q), tool_yaw(scara, q)
        said = np.column_stack([turn(yaw) @ home, tool_position(scara, *q)])
        assert np.abs(said - pose).max() < 1e-12
        wanted = None if scara.axes.wrist is None else yaw
        found = dict(zip(Elbow, branches(scara, *pose[:, 3].tolist(), q, wanted)))
        own = found[Elbow.of(scara.bend(q))]
        assert own is not None
        if abs(math.sin(scara.bend(q))) > 1e-3:
            assert max(abs(a - b) for a, b in zip(own, q)) < 1e-11
        for elbow, solution in found.items():
            if solution is None:
                continue
            reached[elbow] += 1
            assert np.abs(kdl.pose(solution) - pose)[:, part].max() < 1e-12
            for value, (low, high) in zip(solution, scara.limits):
                assert low <= value <= high
    assert min(reached.values()) > POSES / 3


@pytest.mark.parametrize("kind", KINDS.values(), ids=KINDS.keys())
def test_velocity_is_that_of_the_screws_and_comes_back(kind):
    """The tip Jacobian says the same; away from the straight arm the way back is exact."""
    robot = made(kind)
    scara, arm = Scara.from_robot(robot), ScrewModel.from_robot(robot)
    random = np.random.default_rng(5)
    for q in poses(scara, 100).tolist():
        qdot = random.uniform(-2.0, 2.0, len(q)).tolist()
        twist = tip_jacobian(arm, q) @ qdot
        linear, rate = tool_velocity(scara, q, qdot), tool_yaw(scara, qdot)
        assert np.abs(twist - (0.0, 0.0, rate, *linear)).max() < 1e-12
        wanted = rate if scara.axes.wrist is not None else 0.0
        answer = joint_velocities(scara, q, linear, wanted)
        if not answer.damped:
            assert np.abs(np.subtract(answer.qdot, qdot)).max() < 1e-9
        elif scara.axes.wrist is not None:
            assert tool_yaw(scara, answer.qdot) == pytest.approx(rate, abs=1e-12)


FOUR = Scara.from_robot(made(KINDS["R R P R"]))
POINT = tool_position(FOUR, 0.4, 1.1, -0.06, 0.0)
SEED = (0.4, 1.1, -0.06, 0.7)


def test_yaw_that_is_left_out_stays_as_it_is():
    """The wrist takes back what the arms turn, with either elbow; without a seed the yaw is 0."""
    for elbow in (None, *Elbow):
        q = solve(FOUR, 0.2, 0.35, 0.05, elbow, SEED).q
        assert tool_yaw(FOUR, q) == pytest.approx(tool_yaw(FOUR, SEED), abs=1e-12)
        assert tool_yaw(FOUR, solve(FOUR, 0.2, 0.35, 0.05, elbow).q) == pytest.approx(0.0)


@pytest.mark.parametrize("turns", range(-4, 5))
def test_of_the_wrists_turns_the_one_nearest_to_the_seed_is_taken(turns):
    """Whole turns of the yaw that is asked for do not count."""
    scara = Scara.from_robot(made(Kind(wrist_deg=800.0)))
    for seed in (-13.0, -7.0, -2.0, 0.0, 2.9, 8.0, 13.5):
        q = solve_elbow(
            scara, *POINT, Elbow.RIGHTY, (0.4, 1.1, -0.06, seed), 1.8 + turns * math.tau
        )
        choices = [0.3 + k * math.tau for k in range(-3, 4)]
        allowed = [value for value in choices if abs(value) <= math.radians(800.0)]
        assert q[3] == pytest.approx(min(allowed, key=lambda value: abs(value - seed)), abs=1e-12)


@pytest.mark.parametrize("end", [-1.0, 1.0])
def test_yaw_at_the_wrists_limit_is_reached_and_no_farther(end):
    """The limit to the last digit; beyond it the other end of a range of just a turn."""
    scara = Scara.from_robot(made(Kind(wrist_deg=180.0)))
    limit = end * math.pi
    q = solve_elbow(scara, *POINT, Elbow.RIGHTY, (0.0, 0.0, 0.0, limit), 1.5 + limit)
    assert q[3] == pytest.approx(limit, abs=1e-12) and abs(q[3]) <= math.pi
    q = solve_elbow(scara, *POINT, Elbow.RIGHTY, (0.0, 0.0, 0.0, limit), 1.5 + limit + end * 1e-3)
    assert q[3] == pytest.approx(-limit + end * 1e-3, abs=1e-12)


NARROW = Scara.from_robot(made(Kind(wrist_deg=100.0)))
nan, inf = math.nan, math.inf
AT = (0.3, 0.2, 0.05)
NASTY = [
    # target, seed, yaw, error, what it says
    ((nan, 0.2, 0.05), None, None, UnreachableError, "target x = nan is not finite"),
    ((0.3, nan, 0.05), None, None, UnreachableError, "target y = nan is not finite"),
    ((0.3, 0.2, nan), None, None, UnreachableError, "target z = nan is not finite"),
    ((inf, 0.2, 0.05), None, None, UnreachableError, "target x = inf is not finite"),
    ((0.3, -inf, 0.05), None, None, UnreachableError, "target y = -inf is not finite"),
    ((0.3, 0.2, inf), None, None, UnreachableError, "target z = inf is not finite"),
    ((nan, inf, nan), None, 0.0, UnreachableError, "target x = nan is not finite"),
    ((1e200, 0.0, 0.05), None, None, UnreachableError, "at radius inf m, outside the reach"),
    ((0.3, 0.2, 1e300), None, None, JointLimitError, r"joint_3 = 1e\+300 m is outside"),
    (AT, None, nan, UnreachableError, "target yaw = nan is not finite"),
    (AT, None, inf, UnreachableError, "target yaw = inf is not finite"),
    (AT, None, -inf, UnreachableError, "target yaw = -inf is not finite"),
    (AT, (), None, JointVectorError, "got 0 joint values, expected 4"),
    (AT, (0.0,) * 3, None, JointVectorError, "got 3 joint values, expected 4: joint_1, joint_2"),
    (AT, (0.0,) * 5, None, JointVectorError, "got 5 joint values, expected 4"),
    (AT, (0.0, nan, 0.0, 0.0), None, JointVectorError, "not finite: joint_2 = nan"),
    (AT, (0.0, 0.0, 0.0, inf), None, JointVectorError, "not finite: joint_4 = inf"),
    (AT, (0.0, 0.0, 0.0, nan), 0.3, JointVectorError, "not finite: joint_4 = nan"),
    ((0.6, 0.0, 0.05), None, None, UnreachableError, r"radius 0\.6 m, outside the reach \[0\.17"),
    ((0.55 + 2e-9, 0.0, 0.05), None, None, UnreachableError, r"outside the reach .*, 0\.55\] m"),
    ((0.12, 0.11, 0.05), None, None, UnreachableError, r"radius 0\.162788 m, outside the reach"),
    ((0.0, 0.0, 0.05), None, None, UnreachableError, "at radius 0 m, outside the reach"),
    ((0.0, 0.0, -0.5), None, 1.0, UnreachableError, "at radius 0 m, outside the reach"),
    ((-0.5, 0.0, 0.05), None, 0.0, JointLimitError, r"joint_1 = .* rad is outside \[-2\.618"),
    ((0.3, 0.2, 0.121), None, None, JointLimitError, r"joint_3 = 0\.001 m is outside \[-0\.15, 0"),
    ((0.3, 0.2, -0.031), None, None, JointLimitError, r"joint_3 = -0\.151 m is outside"),
    (AT, None, -2.5, JointLimitError, r"yaw -2\.5 rad: joint_4 = .* rad is outside \[-1\.745, 1"),
    (AT, (0.0, 0.0, 0.0, 1.7), 3.7, JointLimitError, "joint_4 = .* is outside"),
    ((0.55, 0.0, 0.05), None, math.pi, JointLimitError, "joint_4 = -?3.14159 rad is outside"),
    ((0.2, 0.3, 0.2), None, 4.1, JointLimitError, r"joint_3 = 0\.08 m .*; joint_4 = .* is outside"),
    ((0.05, -0.36, 0.05), (0.0, 0.0, 0.0, 1.7), None, JointLimitError, "joint_4 = .* is outside"),
]


@pytest.mark.parametrize(("target", "seed", "yaw", "error", "says"), NASTY)
def test_what_cannot_be_is_refused_with_the_value_and_the_range(target, seed, yaw, error, says):
    """Nothing is clamped, and nothing comes out as a number that is none."""
    with pytest.raises(error, match=says):
        solve(NARROW, *target, None, seed, yaw)


def test_what_is_only_just_possible_is_reached():
    """On the edge, at both ends of the stroke, at the elbow's limit, and straight."""
    bend = FOUR.limits[1][1]
    inner = tool_position(FOUR, 0.3, bend, 0.0, 0.0)
    for target in ((L1 + L2, 0.0, H), (L1 + L2 + 9e-10, 0.0, H), (0.3, 0.2, H - 0.15), inner):
        q = solve(FOUR, *target, None, None, 0.5).q
        assert tool_position(FOUR, *q) == pytest.approx(target, abs=1e-9)
        assert tool_yaw(FOUR, q) == pytest.approx(0.5, abs=1e-12)
    assert solve(FOUR, L1 + L2, 0.0, H, None, None, 0.5).q == (0.0, 0.0, 0.0, 0.5)


def test_yaw_of_an_arm_without_a_wrist_is_refused():
    """The forearm turns the tool there, and the place decides how far."""
    scara = Scara.from_robot(made(KINDS["three axes"]))
    for elbow in (None, *Elbow):
        with pytest.raises(ScaraControlError, match="yaw: this arm has no joint that turns its"):
            solve(scara, 0.3, 0.2, 0.05, elbow, None, 0.0)
    with pytest.raises(ScaraControlError, match="yaw_rate: this arm has no joint that turns its"):
        joint_velocities(scara, (0.0, 1.0, 0.0), (0.0, 0.0, 0.0), 0.1)
    with pytest.raises(ScaraControlError, match="yaw_rate = nan is not finite"):
        joint_velocities(FOUR, (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0), nan)


@pytest.mark.parametrize(
    ("screw", "number"),
    [
        ((0.0, 1.0, 0.0, 0.0, 0.0, 0.0), 1),
        ((0.0, 0.6, 0.8, 0.0, 0.0, 0.0), 3),
        ((0.0, 0.0, 1.0, 0.0, -0.325, 0.1), 1),
        ((0.0, 0.0, 0.0, 0.0, 1.0, 0.0), 2),
    ],
)
def test_axis_that_leans_or_screws_is_no_axis_of_a_scara(screw, number):
    """A leaning axis, or a spline that lifts as it turns, has another closed form."""
    robot = made(KINDS["R R P R"])
    joints = list(robot.joints)
    joints[number] = msgspec.structs.replace(joints[number], screw_axis=screw)
    name = joints[number].name
    with pytest.raises(ScaraControlError, match=rf"no SCARA: {name}\.screw_axis = .* not parallel"):
        Scara.from_robot(msgspec.structs.replace(robot, joints=joints))


def test_inner_radius_of_an_arm_that_folds_is_the_difference_of_its_links():
    """Where half a turn lies between the elbow's limits, bent at zero or not."""
    for kind in (Kind(limit_deg=200.0), Kind(bent=2.5, limit_deg=100.0)):
        assert Scara.from_robot(made(kind)).inner_radius == pytest.approx(L1 - L2, abs=1e-12)
    bent = Scara.from_robot(made(Kind(bent=0.5, limit_deg=90.0))).inner_radius
    cosine = math.cos(0.5 + math.pi / 2)
    assert bent == pytest.approx(math.sqrt(L1**2 + L2**2 + 2.0 * L1 * L2 * cosine))
