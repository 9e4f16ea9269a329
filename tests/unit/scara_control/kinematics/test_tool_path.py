"""Lines and arcs of the tool: on their curve by another library's kinematics, or refused."""

from __future__ import annotations

import math
import re
from random import Random

import msgspec
import numpy as np
import pytest
from harness.kdl_chain import KdlChain
from harness.running.thorough import examples, thorough
from scara_config import load_robot, package_folder
from scara_control.dynamics.planner import Planner
from scara_control.joint_motion import JointMotion
from scara_control.kinematics.tool import tool_kinematics
from scara_control.kinematics.tool_path import (
    STRIDE,
    ToolPathError,
    check_way,
    solve_path,
    wanted_elbow,
)
from scara_control.motion.tool_move import plan_tool_move

ROBOTS = ("fanuc_sr6ia", "scara_4axis", "epson_gx4", "articulated_six")
PLAYED = ("fanuc_sr6ia", "articulated_six", *thorough("scara_4axis", "epson_gx4"))
"""By day one SCARA, and the arm."""
LINES, ARCS, REFUSALS = examples(12, 250), examples(4, 50), examples(20, 100)
"""Lines and arcs of each robot; lines that no arm could follow."""
OFF_M = 1e-5
EVEN = 0.01
"""A speed is even within this part of it."""


class ShippedArm:
    """A shipped robot: our kinematics and another library's."""

    def __init__(self, name: str) -> None:
        """Load it."""
        robot = load_robot(package_folder("scara_config") / "robots" / name)
        self.joints, self.tool = robot.twin_joints, tool_kinematics(robot)
        self.columns = [self.joints.index(joint) for joint in self.tool.joints]
        self._kdl = KdlChain(self.tool.joints, robot.home_pose)
        self.home = tuple(robot.home[joint.name] * joint.scale for joint in self.joints)

    def of_tool(self, q) -> list[float]:
        """Return the joints that move the tool."""
        return [q[column] for column in self.columns]

    def pose(self, q) -> np.ndarray:
        """Return the tool's pose by KDL, shape (3, 4)."""
        return self._kdl.pose(self.of_tool(q))

    def at(self, x: float, y: float, z: float, seed=None, **how) -> tuple[float, ...]:
        """Return all joints with the tool at a place [m]."""
        near = list(seed or self.home)
        found = self.tool.inverse(x, y, z, how.get("elbow"), self.of_tool(near), how.get("yaw"))
        for column, value in zip(self.columns, found.chosen.q):
            near[column] = value
        return tuple(near)

    def solve(self, begin, target, **way):
        """Solve a path."""
        return solve_path(self.tool, self.joints, begin, target, **way)


ARMS = {name: ShippedArm(name) for name in ROBOTS}
ROBOT = ARMS["fanuc_sr6ia"]
WRIST = ARMS["scara_4axis"]


def drawn(arm: ShippedArm, random: Random, count: int) -> list[tuple[float, ...]]:
    """Return joint positions somewhere, and others near the first."""
    first = [random.uniform(joint.lower, joint.upper) for joint in arm.joints]
    near = [first]
    for _ in range(count - 1):
        by = [random.uniform(-0.15, 0.15) * (joint.upper - joint.lower) for joint in arm.joints]
        moved = zip(first, by, arm.joints)
        near.append([min(max(q + d, joint.lower), joint.upper) for q, d, joint in moved])
    return [tuple(q) for q in near]


def looked_at(arm: ShippedArm, path) -> tuple[np.ndarray, np.ndarray]:
    """Return the tool's places and its speeds on the way, at full program speed, by KDL."""
    move = plan_tool_move(arm.joints, path, 100.0)
    times = np.linspace(0.0, move.duration, 200)
    places = np.array([arm.pose(move.at_time(t)[0])[:, 3] for t in times])
    h = 1e-5
    middle = times[(times > h) & (times < move.duration - h)]
    ways = [
        arm.pose(move.at_time(t + h)[0])[:, 3] - arm.pose(move.at_time(t - h)[0])[:, 3]
        for t in middle
    ]
    return places, np.linalg.norm(ways, axis=1) / (2.0 * h)


@pytest.mark.parametrize("name", PLAYED)
def test_a_line_is_straight_and_its_speed_even_whatever_the_arm(name: str) -> None:
    """Off by less than 0.01 mm; refused are only lines that no arm could follow."""
    arm, random, solved = ARMS[name], Random(17), 0
    while solved < LINES:
        begin, target = drawn(arm, random, 2)
        try:
            path = arm.solve(begin, target)
        except ToolPathError:
            continue
        solved += 1
        places, speeds = looked_at(arm, path)
        first, last = (arm.pose(q)[:, 3] for q in (begin, target))
        length = float(np.linalg.norm(last - first))
        along = (places - first) @ (last - first) / length
        off = places - first - np.outer(along, (last - first) / length)
        assert np.linalg.norm(off, axis=1).max() < OFF_M
        assert np.linalg.norm(places[-1] - last) < OFF_M
        assert np.all(np.diff(along) > -1e-9), "it goes back on its line"
        # Between the ramps nothing is slower.
        full = np.flatnonzero(speeds > (1.0 - EVEN) * speeds.max())
        assert np.all(np.diff(full) == 1)


@pytest.mark.parametrize("name", PLAYED)
def test_an_arc_is_round_and_passes_its_place(name: str) -> None:
    """Its circle is that through three places, by geometry that shares nothing with ours."""
    arm, random, solved = ARMS[name], Random(18), 0
    while solved < ARCS:
        begin, via, target = drawn(arm, random, 3)
        try:
            path = arm.solve(begin, target, via=via)
        except ToolPathError:
            continue
        solved += 1
        places, _ = looked_at(arm, path)
        corners = np.array([arm.pose(q)[:, 3] for q in (begin, via, target)])
        middle = circle_middle(corners)
        radius = np.linalg.norm(corners[0] - middle)
        assert np.abs(np.linalg.norm(places - middle, axis=1) - radius).max() < OFF_M
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        assert np.abs((places - middle) @ normal).max() / np.linalg.norm(normal) < OFF_M
        ways = [float(s) for s in np.linspace(0.0, path.track.last_time, 4001)[:-1]]
        near = min(
            np.linalg.norm(arm.pose(path.track.sample(s)[0])[:, 3] - corners[1]) for s in ways
        )
        assert near < path.track.last_time / 4000.0, "it goes the other way round"


def circle_middle(corners: np.ndarray) -> np.ndarray:
    """Return the place as far from three others, in their plane, by linear equations."""
    a, b, c = corners
    rows = np.array([b - a, c - a, np.cross(b - a, c - a)])
    right = [0.5 * (b @ b - a @ a), 0.5 * (c @ c - a @ a), rows[2] @ a]
    return np.linalg.solve(rows, right)


@pytest.mark.parametrize("name", PLAYED)
def test_no_joint_exceeds_its_limits_on_the_way(name: str) -> None:
    """Speeds, accelerations and jerks by differences of the positions themselves."""
    arm, random, solved = ARMS[name], Random(19), 0
    while solved < ARCS:
        begin, target = drawn(arm, random, 2)
        try:
            move = plan_tool_move(arm.joints, arm.solve(begin, target), 60.0, 0.8)
        except ToolPathError:
            continue
        solved += 1
        # Steps of a jerk lie between two samples: not looked at are the two next to each.
        times, h = np.linspace(0.0, move.duration, 2000, retstep=True)
        rows = [move.at_time(t) for t in times]
        q, qdot, qddot = (np.array([row[k] for row in rows]) for k in range(3))
        assert np.abs(np.diff(q, axis=0) / h - 0.5 * (qdot[1:] + qdot[:-1])).max() < 1e-3
        for values, most in (
            (qdot, [0.6 * joint.velocity for joint in arm.joints]),
            (qddot, [0.8 * joint.acceleration for joint in arm.joints]),
            (np.diff(qddot, axis=0) / h, [joint.jerk for joint in arm.joints]),
        ):
            assert np.all(np.abs(values).max(axis=0) <= np.array(most) * (1.0 + 1e-3))


def first_trouble(q0, q1) -> tuple[float, str]:
    """Return where on the line between two poses a SCARA cannot go on first, and why.

    By the triangle of its arms, a step of half a thousandth at a time: nothing is shared.
    """
    l1, l2 = 0.35, 0.30
    begin, end = (ROBOT.pose(q)[:3, 3] for q in (q0, q1))
    side = 1.0 if q0[1] >= 0.0 else -1.0
    for k in range(2001):
        x, y, _ = begin + k / 2000.0 * (end - begin)
        r = math.hypot(x, y)
        cosine = (r * r - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)
        if abs(cosine) > 1.0 or abs(math.sqrt(1.0 - cosine**2)) < 0.0501:
            return k / 2000.0, "singular|radius"
        bend = side * math.acos(cosine)
        first = math.atan2(y, x) - math.atan2(l2 * math.sin(bend), l1 + l2 * math.cos(bend))
        for joint, value in zip(ROBOT.joints, (math.remainder(first, math.tau), bend)):
            if not joint.lower <= value <= joint.upper:
                return k / 2000.0, f"{joint.name} = |outside the reach|radius"
    return 1.0, "keeps its elbow"


def test_a_line_that_is_refused_names_the_place_and_the_cause_that_geometry_finds() -> None:
    """Random ends anywhere: a hundred lines that no arm could follow, each for the right reason."""
    random, refused = Random(20), 0
    while refused < REFUSALS:
        q0, q1 = (tuple(random.uniform(j.lower, j.upper) for j in ROBOT.joints) for _ in range(2))
        try:
            ROBOT.solve(q0, q1)
            continue
        except ToolPathError as error:
            words = str(error)
        refused += 1
        if "almost singular" in words:
            # Where it would need the other elbow next, or not: the arm is all but straight there.
            place = re.search(r"at \((-?[\d.]+), (-?[\d.]+), ", words)
            assert 650.0 - math.hypot(*map(float, place.groups())) < 5.0, words
            continue
        part, why = first_trouble(q0, q1)
        assert re.search(why, words), f"{words}, and geometry says: {why} after {part:.1%}"
        if "keeps" not in why:
            told = float(re.search(r"after (\d+)% of the way", words)[1])
            # The path is looked at every 10 mm.
            assert abs(told / 100.0 - part) < 0.03, f"{words}, and geometry says {part:.1%}"


REFUSED = {
    "out of reach in its middle": ((-0.2, 0.55, 0.10), (-0.2, -0.55, 0.10), "after"),
    "from the straight arm": (
        (0.65, 0.0, 0.10),
        (0.40, 0.1, 0.10),
        "after 0% of the way.*singular",
    ),
    "to the straight arm": (
        (0.40, 0.1, 0.10),
        (0.65, 0.0, 0.10),
        "after 100% of the way.*singular",
    ),
    "almost to the straight arm": (
        (-0.015, -0.629, 0.10),
        (0.6231, 0.1840, 0.10),
        r"after 100% of the way, at \(62.*almost singular.* 0\.\d+ mm off its way, allowed 0\.001",
    ),
}


@pytest.mark.parametrize("case", REFUSED.values(), ids=list(REFUSED))
def test_a_line_that_no_arm_can_follow_names_place_and_reason(case) -> None:
    """Before anything moves."""
    begin, target, why = case
    first = ROBOT.at(*begin)
    side = ROBOT.tool.elbow(ROBOT.of_tool(first))
    with pytest.raises(ToolPathError, match=why) as refused:
        ROBOT.solve(first, ROBOT.at(*target, seed=first, elbow=side))
    assert "mm" in str(refused.value)


def test_a_line_keeps_its_elbow() -> None:
    """The same place with the other elbow needs the straight arm."""
    begin = ROBOT.at(0.4, -0.1, 0.1, elbow=wanted_elbow(ROBOT.tool, "righty", "", ()))
    other = ROBOT.at(0.4, 0.1, 0.1, elbow=wanted_elbow(ROBOT.tool, "lefty", "", ()))
    with pytest.raises(ToolPathError, match="the arm is righty, the target is lefty"):
        ROBOT.solve(begin, other)
    side = wanted_elbow(ROBOT.tool, "", "linear", ROBOT.of_tool(begin))
    assert ROBOT.solve(begin, ROBOT.at(0.4, 0.1, 0.1, elbow=side)) is not None


@pytest.mark.parametrize("own", ["righty", "lefty"])
def test_the_elbow_that_is_named_is_wanted_and_without_one_a_line_wants_the_arms_own(own) -> None:
    """A joint move to a place may end with either."""
    begin = ROBOT.at(0.4, -0.1, 0.1, elbow=wanted_elbow(ROBOT.tool, own, "", ()))
    seed, other = ROBOT.of_tool(begin), {"righty": "lefty", "lefty": "righty"}[own]
    for path in ("linear", "joint", ""):
        assert wanted_elbow(ROBOT.tool, other, path, seed).value == other
    assert wanted_elbow(ROBOT.tool, "", "linear", seed).value == own
    for path in ("joint", ""):
        assert wanted_elbow(ROBOT.tool, "", path, seed) is None


def test_a_turn_that_the_wrist_would_make_the_long_way_is_refused_or_made_evenly() -> None:
    """A whole turn of the wrist on a line is a turn of the tool, at one rate."""
    begin = WRIST.at(0.4, -0.1, 0.1)
    target = list(WRIST.at(0.4, 0.1, 0.1, seed=begin))
    wrist = WRIST.joints.index(next(j for j in WRIST.joints if j.name == "joint_4"))
    target[wrist] += math.tau if target[wrist] < 0.0 else -math.tau
    path = WRIST.solve(begin, tuple(target))
    yaws = [WRIST.tool.yaw(WRIST.of_tool(q)) for q in path.corners]
    assert abs(yaws[-1] - yaws[0]) == pytest.approx(math.tau, abs=1e-6)
    assert np.diff(yaws) == pytest.approx((yaws[-1] - yaws[0]) / (len(yaws) - 1), abs=1e-9)


def test_a_tool_that_only_turns_turns_in_its_place() -> None:
    """And one that does neither has no path of its own."""
    begin = WRIST.at(0.4, -0.1, 0.1, yaw=0.0)
    path = WRIST.solve(begin, WRIST.at(0.4, -0.1, 0.1, seed=begin, yaw=1.0))
    places = np.array([WRIST.pose(q)[:, 3] for q in path.corners])
    assert np.abs(places - places[0]).max() < OFF_M
    assert WRIST.solve(begin, begin) is None


def test_joints_beside_the_arm_go_evenly() -> None:
    """The table turns with the way of the tool."""
    begin = ROBOT.at(0.45, -0.2, 0.1)
    target = (*ROBOT.at(0.45, 0.2, 0.1, seed=begin)[:-1], begin[-1] + 1.0)
    table = [q[-1] for q in ROBOT.solve(begin, target).corners]
    assert np.diff(table) == pytest.approx(1.0 / (len(table) - 1))


def test_places_are_solved_no_further_apart_than_a_stride() -> None:
    """A way that is no multiple of it gets one part more."""
    begin = ROBOT.at(0.4, -0.1005, 0.1)
    path = ROBOT.solve(begin, ROBOT.at(0.4, 0.1005, 0.1, seed=begin))
    places = np.array([ROBOT.pose(q)[:, 3] for q in path.corners])
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    assert len(steps) == math.ceil(0.201 / STRIDE) and steps.max() <= STRIDE


@pytest.mark.parametrize("length", [1e-3, 0.2])
def test_a_line_of_any_length_goes_from_place_to_place(length: float) -> None:
    """Each place is looked for where the way leads from the one before it."""
    arm = ARMS["articulated_six"]
    begin = arm.at(0.4, -0.1, 0.3)
    target = arm.at(0.4, -0.1 + length, 0.3, seed=begin)
    seen: list[float] = []

    class Guessed:
        def __getattr__(self, name):
            return getattr(arm.tool, name)

        def near(self, first, guess, place, turn):
            found = arm.tool.near(first, guess, place, turn)
            seen.append(max(abs(a - b) for a, b in zip(found, guess)))
            return found

    solve_path(Guessed(), arm.joints, begin, target)
    assert max(seen) < math.radians(0.1)


def test_the_end_of_a_way_is_as_bent_as_what_is_just_before_it() -> None:
    """Behind its last point a track ramps down: its speed there is planned for the way itself."""
    begin = ROBOT.at(0.4, -0.1, 0.1)
    path = ROBOT.solve(begin, ROBOT.at(0.4, 0.1, 0.1, seed=begin))
    before = path.track.sample(path.track.last_time * (1.0 - 1e-7))
    for told, wanted in zip(path.rows[:2], before[1:]):
        assert told[-1] == pytest.approx(wanted, rel=1e-4, abs=1e-9)


HERE = (0.0,) * len(ROBOT.joints)


@pytest.mark.parametrize(
    ("way", "why"),
    [
        ({"path": "spline"}, "path = 'spline': expected one of joint, linear, circular, or empty"),
        ({"path": "", "speed_mm_s": 200.0}, "a joint move has none"),
        ({"path": "linear", "speed_mm_s": -1.0}, "speed_mm_s = -1 is no speed"),
        ({"path": "linear", "speed_mm_s": math.nan}, "speed_mm_s = nan is no speed"),
        ({"path": "circular"}, "an arc passes one place and has no corner: via has 0"),
        ({"path": "circular", "via": 2 * HERE}, "via has 2"),
        ({"path": "circular", "via": HERE, "corner_mm": 5.0}, "corner_mm = 5"),
        ({"path": "linear", "via": HERE[:2]}, "got 2 joint values"),
        ({"path": "linear", "via": HERE, "corner_mm": -1.0}, "corner_mm = -1 is no distance"),
        ({"path": "joint", "via": 17 * HERE}, "via has 17 places: allowed are 16"),
        ({"path": "joint", "corner_mm": 5.0}, "without places in via there is no corner"),
        ({"path": "joint", "via": (9.0, *HERE[1:])}, "joint_1 = 9"),
    ],
)
def test_a_way_that_is_none_is_refused(way, why) -> None:
    """By the words of who asks."""
    with pytest.raises(ValueError, match=why):
        check_way(ROBOT.joints, **way)


@pytest.mark.parametrize("via", ["the same", "in line"])
def test_three_places_in_one_line_are_no_arc(via: str) -> None:
    """Neither are two that are the same."""
    begin, end = ROBOT.at(0.45, -0.2, 0.1), ROBOT.at(0.45, 0.2, 0.1)
    passed = begin if via == "the same" else ROBOT.at(0.45, 0.0, 0.1)
    with pytest.raises(ToolPathError, match="no arc"):
        ROBOT.solve(begin, end, via=passed)


@pytest.mark.parametrize("mm_s", [50.0, *thorough(5.0, 250.0)])
def test_the_tool_is_as_fast_as_asked(mm_s: float) -> None:
    """Between its ramps."""
    begin = ROBOT.at(0.45, -0.2, 0.1)
    path = ROBOT.solve(begin, ROBOT.at(0.45, 0.2, 0.1, seed=begin), speed_mm_s=mm_s)
    _, speeds = looked_at(ROBOT, path)
    assert speeds.max() == pytest.approx(1e-3 * mm_s, rel=1e-6)
    assert np.mean(np.abs(speeds / speeds.max() - 1.0) < EVEN) > 0.8


def test_the_same_place_with_the_other_elbow_is_no_line() -> None:
    """The joints would swing through the straight arm; another turn of the table is no way."""
    righty, lefty = (
        ROBOT.at(0.4, 0.1, 0.1, elbow=wanted_elbow(ROBOT.tool, side, "", ()))
        for side in ("righty", "lefty")
    )
    with pytest.raises(ToolPathError, match="the same place with other joints"):
        ROBOT.solve(righty, lefty)
    assert ROBOT.solve(righty, (*righty[:3], 1.0)) is None


def test_a_line_leads_away_from_a_little_beyond_a_limit() -> None:
    """A robot at its limit may read so: the joint comes back first, then the tool goes straight."""
    here, target = ROBOT.at(0.4, 0.1, 0.16), ROBOT.at(0.42, 0.05, 0.1)
    start = (*here[:2], ROBOT.joints[2].upper + 1e-5, here[3])
    path = Planner(ROBOT.joints, ROBOT.tool).move(
        JointMotion.at_rest(start), target, 50.0, check_way(ROBOT.joints, "linear")
    )
    assert path.at(0.0).q == pytest.approx(start) and path.end == pytest.approx(target)
    places = [ROBOT.pose(path.at(path.duration * k / 50).q)[:, 3] for k in range(51)]
    way = places[-1] - places[0]
    off = [
        np.linalg.norm(np.cross(place - places[0], way / np.linalg.norm(way))) for place in places
    ]
    assert max(off) < 2.0 * OFF_M


@pytest.mark.parametrize("joints", [4, 5])
def test_an_arm_whose_joints_a_place_does_not_fix_has_joint_moves_alone(joints: int) -> None:
    """Its line would end in other joints than the target's; the reason says what is left."""
    six = load_robot(package_folder("scara_config") / "robots" / "articulated_six")
    robot = msgspec.structs.replace(six, joints=six.joints[:joints])
    tool = tool_kinematics(robot)
    home = [robot.home[joint.name] * joint.scale for joint in tool.joints]
    begin = tool.inverse(0.36, 0.0, 0.35, None, home).chosen.q
    target = tool.inverse(0.36, 0.05, 0.37, None, begin).chosen.q
    with pytest.raises(ToolPathError, match=f"{joints} joints are not fixed by the tool's place"):
        solve_path(tool, robot.arm_joints, begin, target)
