"""Which joint positions a configuration chooses, held to closed forms of both kinds of arm."""

from __future__ import annotations

import math
from collections.abc import Iterator

import msgspec
import numpy as np
import pytest
from fanuc_emulator.alarms import RefusedError
from fanuc_emulator.drives.bend import BARELY, Bend
from fanuc_emulator.drives.planner import Limits, PathStep, Planner, Target
from fanuc_emulator.plant.config import axes_of, load_plant
from harness.workspace import ROOT
from scara_config import Robot, load_robot
from scara_config.programs.configuration import Configuration
from scara_config.programs.tp.listing import Indexed
from scara_config.programs.tp.motion import Asked
from scara_config.programs.tp.values import Pose

from fanuc_emulator import alarms

ROBOTS = ROOT / "config" / "robots"
BASE = Pose((0.0,) * 9, "")
SCARA, SIX = load_robot(ROBOTS / "fanuc_sr6ia"), load_robot(ROBOTS / "articulated_six")


def planner_of(robot: Robot) -> Planner:
    """Return the planner of a robot's stand-in."""
    plant = load_plant(robot, ROBOTS / robot.name, "ideal")
    axes = axes_of(plant, robot.joints, tuple(robot.home_positions))
    return Planner(robot, [axis.parameters for axis in axes])


PLANNERS = {robot.name: planner_of(robot) for robot in (SCARA, SIX)}


def asks(place: Pose, kind: str = "J") -> PathStep:
    """Return a motion to a position in the base frame, by the flange."""
    speed = {"percent": 50.0} if kind == "J" else {"mm_s": 100.0}
    motion = Asked(kind, (Indexed("P", (1.0,)),), **speed)
    return PathStep(1, motion, (Target(place, BASE, BASE),))


def goes_to(robot: Robot, place: Pose, begin: tuple[float, ...], kind: str = "J") -> np.ndarray:
    """Return the joint positions at the end of a motion [rad or m]."""
    return np.array(PLANNERS[robot.name].plan(asks(place, kind), begin).end)


def scara_joints(x: float, y: float, z: float, r: float, side: str, turn: int) -> np.ndarray:
    """Return the joints of the SR-6iA in closed form: by the law of cosines [m, rad]."""
    l1, l2, reach = 0.35, 0.30, math.hypot(x, y)
    sign = 1.0 if side == "R" else -1.0
    inner = math.acos((l1**2 + l2**2 - reach**2) / (2 * l1 * l2))
    outer = math.acos((reach**2 + l1**2 - l2**2) / (2 * reach * l1))
    q1, q2 = math.atan2(y, x) - sign * outer, sign * (math.pi - inner)
    q4 = math.remainder(r - q1 - q2, math.tau)
    # Its turn: half a turn to either side of 0 is turn 0.
    return np.array([q1, q2, z - 0.16, q4 + turn * math.tau, 0.0])


@pytest.mark.parametrize("turn", [-1, 0, 1])
@pytest.mark.parametrize("side", ["R", "L"])
def test_a_scara_is_bent_and_turned_as_it_is_told(side: str, turn: int) -> None:
    """From wherever it begins, with J4 in the turn that is named."""
    rng = np.random.default_rng(turn + 7)
    for _ in range(12):
        angle, reach = rng.uniform(-1.0, 1.0), rng.uniform(0.25, 0.6)
        x, y, z = reach * math.cos(angle), reach * math.sin(angle), rng.uniform(0.0, 0.15)
        r = rng.uniform(-3.0, 3.0)
        wanted = scara_joints(x, y, z, r, side, turn)
        values = (1e3 * x, 1e3 * y, 1e3 * z, 180.0, 0.0, math.degrees(r), 0.0, 0.0, 0.0)
        place = Pose(values, f"{side}, {turn}, 0, 0")
        for elbow in (1.2, -1.2):
            begin = (0.3, elbow, -0.1, rng.uniform(-9.0, 9.0), 0.0)
            assert goes_to(SCARA, place, begin) == pytest.approx(wanted, abs=1e-6)


def test_the_printout_of_a_real_robot_leads_to_its_joints() -> None:
    """X 281.58, Y 413.66, Z 141.83, R 0.96, configuration R, as a real SR-6iA showed them."""
    place = Pose((281.58, 413.66, 141.83, 180.0, 0.0, 0.96, 0.0, 0.0, 0.0), "R")
    found = goes_to(SCARA, place, (0.0, -1.0, -0.1, 0.0, 0.0))
    shown = np.degrees(found[[0, 1, 3]])
    assert shown == pytest.approx([19.62, 79.60, -98.26], abs=0.02)
    assert 1e3 * found[2] == pytest.approx(-18.17, abs=0.01)
    assert PLANNERS[SCARA.name].tip_pose(found, BASE, BASE).config == "R, 0, 0, 0"


def six_letters(q: np.ndarray) -> str:
    """Return the letters of articulated_six in closed form.

    Its wrist is ``0.3 sin q2 + 0.3 cos(q2 + q3)`` before the first axis, its elbow is above the
    line from shoulder to wrist where ``cos q3`` is positive, and its tool bends down by ``q5``.
    """
    ahead = math.sin(q[1]) + math.cos(q[1] + q[2])
    letters = ("NF"[math.sin(q[4]) < 0.0], "UD"[math.cos(q[2]) < 0.0], "TB"[ahead < 0.0])
    return "".join(letters)


def drawn() -> Iterator[np.ndarray]:
    """Yield joint positions of articulated_six throughout its ranges, none near a singularity."""
    rng = np.random.default_rng(3)
    lower, upper = np.array([(joint.lower, joint.upper) for joint in SIX.joints]).T
    found = 0
    while found < 40:
        q = rng.uniform(lower, upper)
        ahead = 0.3 * (math.sin(q[1]) + math.cos(q[1] + q[2]))
        if min(abs(ahead) / 0.3, abs(math.cos(q[2])), abs(math.sin(q[4]))) > 0.15:
            found += 1
            yield q


def test_six_joints_are_bent_and_turned_as_they_are_told() -> None:
    """Each of the eight configurations leads back to the joints that it was printed of."""
    planner, seen = PLANNERS[SIX.name], set[str]()
    for q in drawn():
        place = planner.tip_pose(q, BASE, BASE)
        letters = six_letters(q)
        seen.add(letters)
        turns = [round(math.copysign(abs(math.degrees(each)) >= 180.0, each)) for each in q[3:]]
        assert place.config == Configuration(letters, tuple(turns)).text
        begin = tuple(SIX.home_positions)
        assert goes_to(SIX, place, begin) == pytest.approx(q, abs=1e-6), place.config
    assert len(seen) == 8


def test_six_joints_are_looked_for_where_they_are() -> None:
    """In closed form: each guess but where the arm stands brings the flange to its goal.

    All ways to bend the arm are among them and their likes, with the wrist turned over.
    """
    arm = PLANNERS[SIX.name]._arm
    bend = Bend(SIX, arm)
    for q in drawn():
        goal, letters = arm.pose(q), set[str]()
        here, *guesses = bend.guesses(goal, SIX.home_positions)
        assert here == tuple(SIX.home_positions) and len(guesses) in (2, 4)
        for guess in guesses:
            both = list(bend.alike(guess))
            assert len(both) == 2
            for each in both:
                assert arm.pose(each) == pytest.approx(goal, abs=1e-7)
            letters |= {bend.at(each).letters for each in both}
        assert len(letters) == 2 * len(guesses)


def test_a_turn_that_leads_nowhere_is_refused() -> None:
    """J4 of articulated_six has no second turn at this place; of J6 one way alone is in range."""
    planner = PLANNERS[SIX.name]
    place = planner.tip_pose((0.1, 0.5, 0.1, 0.3, 0.6, 0.5), BASE, BASE)
    begin = tuple(SIX.home_positions)
    told = Pose(place.values, "N U T, 0, 0, -1")
    assert goes_to(SIX, told, begin)[5] == pytest.approx(0.5 - math.tau, abs=1e-6)
    with pytest.raises(RefusedError, match="with the arm bent N U T, 0, 0, 1") as refused:
        goes_to(SIX, Pose(place.values, "N U T, 0, 0, 1"), begin)
    assert refused.value.code is alarms.NOT_REACHABLE


@pytest.mark.parametrize(("told", "refused"), [("R, 1, 0, 0", False), ("L, 0, 0, 0", True)])
def test_a_line_keeps_the_elbow_and_chooses_the_turns_itself(told: str, refused: bool) -> None:
    """The manual: the turns at the end follow from the way; the joint placement cannot change."""
    place = Pose((400.0, 100.0, 60.0, 180.0, 0.0, 30.0, 0.0, 0.0, 0.0), told)
    begin = (0.0, 1.2, -0.1, 0.0, 0.0)
    if not refused:
        end = goes_to(SCARA, place, begin, "L")
        assert end[1] > 0.5 and abs(end[3]) < math.pi
        return
    with pytest.raises(RefusedError, match="bent otherwise than its target says") as found:
        goes_to(SCARA, place, begin, "L")
    assert found.value.code is alarms.CONFIG_CHANGE


def test_a_straight_arm_counts_for_both_sides() -> None:
    """It is on neither; it is printed as R."""
    planner = PLANNERS[SCARA.name]
    bend = Bend(SCARA, planner._arm)
    straight = (0.2, 0.0, -0.1, 0.0)
    assert bend.is_bent(straight, "R") and bend.is_bent(straight, "L")
    assert bend.at(straight).text == "R, 0, 0, 0"


@pytest.mark.parametrize("share", [0.95, 1.05])
@pytest.mark.parametrize(
    ("robot", "joint", "letters"), [(SCARA, 1, "RL"), (SIX, 4, "NF")], ids=["elbow", "wrist"]
)
def test_an_arm_that_is_barely_bent_counts_for_both_sides(
    robot: Robot, joint: int, letters: str, share: float
) -> None:
    """Up to a ten-thousandth of a radian."""
    bend = Bend(robot, PLANNERS[robot.name]._arm)
    q = [0.1, 0.5, -0.1, 0.2] if robot is SCARA else [0.1, 0.5, 0.1, 0.3, 0.6, 0.5]
    for k, letter in enumerate(letters):
        q[joint] = share * BARELY * (1.0 - 2.0 * k)
        shown = bend.at(q).letters
        assert shown[0] == letter and bend.is_bent(q, shown)
        assert bend.is_bent(q, letters[1 - k] + shown[1:]) is (share < 1.0)


FOOT = ("z", 0.0, 0.0, 0.0), ("y", 0.0, 0.0, 0.2), ("y", 0.0, 0.0, 0.5)
UNUSUAL = {
    "offset wrist": (*FOOT, ("y", 0.3, 0.0, 0.6), ("z", 0.3, 0.1, 0.6), ("y", 0.3, 0.1, 0.5)),
    "flat wrist": (*FOOT, ("y", 0.3, 0.0, 0.6), ("y", 0.4, 0.0, 0.6), ("y", 0.5, 0.0, 0.6)),
    "elbow that rolls": (
        *(("z", 0.0, 0.0, 0.0), ("y", 0.0, 0.0, 0.0), ("z", 0.0, 0.0, 0.0)),
        *(("y", 0.0, 0.0, 0.5), ("z", 0.0, 0.0, 0.5), ("y", 0.0, 0.0, 0.5)),
    ),
    "five joints": (*FOOT, ("x", 0.3, 0.0, 0.6), ("y", 0.3, 0.0, 0.6)),
}
"""Arms by their axes at 0: direction and a point [m]."""


@pytest.mark.parametrize("name", UNUSUAL)
def test_an_unusual_arm_goes_where_it_is_told_or_nowhere(name: str) -> None:
    """Back to LPOS, whether its axes make a wrist or not; another place would be a fault."""
    joints = []
    for joint, (letter, *point) in zip(SIX.joints, UNUSUAL[name]):
        omega = np.eye(3)["xyz".index(letter)]
        screw = tuple((*omega.tolist(), *np.cross(point, omega).tolist()))
        joints.append(msgspec.structs.replace(joint, screw_axis=screw))
    robot = msgspec.structs.replace(SIX, joints=tuple(joints))
    planner = Planner(robot, [Limits(joint.velocity, joint.acceleration) for joint in joints])
    rng, reached = np.random.default_rng(1), 0
    for _ in range(20):
        place = planner.tip_pose(rng.uniform(-1.0, 1.0, len(joints)).tolist(), BASE, BASE)
        try:
            end = planner.plan(asks(place), [0.1] * len(joints)).end
        except RefusedError:
            continue
        reached += 1
        there = planner.tip_pose(end, BASE, BASE)
        assert there.values[:3] == pytest.approx(place.values[:3], abs=1e-3)
    assert reached >= 10


@pytest.mark.parametrize("kind", ["J", "L"])
def test_an_external_axis_goes_where_its_position_says(kind: str) -> None:
    """Of a Cartesian one E1, of one in joints the joint; it is there with the tool."""
    joints = SCARA.joints
    planner = Planner(SCARA, [Limits(joint.velocity, joint.acceleration) for joint in joints])
    begin = (0.0, 1.2, -0.1, 0.0, 0.1)
    place = Pose((400.0, 100.0, 60.0, 180.0, 0.0, 30.0, 25.0, 0.0, 0.0), "R, 0, 0, 0")
    end = planner.plan(asks(place, kind), begin).end
    assert end[4] == pytest.approx(math.radians(25.0))
    taught = msgspec.structs.replace(asks(place, kind), targets=(Target(end, BASE, BASE),))
    assert planner.plan(taught, begin).end == pytest.approx(end, abs=1e-6)


@pytest.mark.parametrize("way", [(0.3, 0.3), (-0.1, 0.3), (0.3, -0.3), (0.0, -0.3)])
@pytest.mark.parametrize("elbow", [0.4, 1.4])
def test_a_stream_in_t1_keeps_to_250_mm_s_whichever_way_it_goes(
    elbow: float, way: tuple[float, float]
) -> None:
    """Over the longest period that a stand-in has, 12 ms: the joints go straight, not the tool."""
    planner, begin = PLANNERS[SCARA.name], (0.2, elbow, -0.1, 0.0, 0.0)
    end = (0.2 + way[0], elbow + way[1], *begin[2:])
    there = planner.toward(begin, end, 1.0, 0.012)
    tips = [planner.tip_pose(q, BASE, BASE).values[:3] for q in (begin, there)]
    assert 220.0 < math.dist(*tips) / 0.012 <= 250.0
    near = tuple(a + 0.001 * b for a, b in zip(begin, (*way, 0.0, 0.0, 0.0)))
    assert planner.toward(begin, near, 1.0, 0.012) == pytest.approx(near, abs=1e-12)
    slower = planner.tip_pose(planner.toward(begin, end, 0.5, 0.012), BASE, BASE).values[:3]
    assert math.dist(tips[0], slower) == pytest.approx(0.5 * math.dist(*tips), rel=0.03)


@pytest.mark.parametrize(("way", "gone"), [(0.01, 0.01), (2.0, 0.036), (0.0, 0.0)])
def test_a_stream_in_t1_turns_the_table_as_fast_as_that_can(way: float, gone: float) -> None:
    """The flange does not move: 3 rad/s over 12 ms, or what is left; and nowhere is nowhere."""
    planner = Planner(SCARA, [Limits(3.0, 10.0)] * 5)
    begin = (0.2, 0.4, -0.1, 0.0, 0.5)
    found = planner.toward(begin, (*begin[:4], 0.5 + way), 1.0, 0.012)
    assert found == pytest.approx((*begin[:4], 0.5 + gone), abs=1e-12)
