"""Lines and arcs of the tool: their slopes, their accuracy, how fast they are gone."""

from __future__ import annotations

import math

import numpy as np
import pytest
from fanuc_emulator.alarms import RefusedError
from fanuc_emulator.drives import path
from fanuc_emulator.drives.arm import Arm, inverse
from fanuc_emulator.drives.path import PathMove, Speed, ToolPath
from scara_config import Robot
from unit.fanuc_emulator.drives.test_arm import BOTH, SCARA, SIX, pose_of, twist_between

FLANGE = inverse(pose_of(10.0, 20.0, 50.0, 0.0, 0.0, 0.0))
"""The flange by a tool's tip."""
PLACES = {
    SCARA.name: [(450, -150, 60, 180, 0, 10), (520, 0, 20, 180, 0, 20), (400, 200, 90, 180, 0, 60)],
    SIX.name: [
        (330, -150, 300, 160, 10, 0),
        (380, 0, 260, 170, 0, 20),
        (300, 160, 330, 180, 10, 40),
    ],
}
"""Where each robot's path begins, leads through if it is an arc, and ends [mm, deg]."""
FREE, UNTOLD = (1e9,) * 6, Speed()


def path_of(robot: Robot, kind: str) -> ToolPath:
    """Return a line or an arc in the robot's reach."""
    begin, via, end = (pose_of(*place) for place in PLACES[robot.name])
    return ToolPath(begin, end, via if kind == "arc" else None)


def move_of(
    robot: Robot,
    path: ToolPath,
    speed: Speed = UNTOLD,
    velocities: tuple[float, ...] = FREE,
    accelerations: tuple[float, ...] = FREE,
    table: float = 0.0,
) -> PathMove:
    """Return the motion along a path; a joint that does not move the tool goes by ``table``."""
    arm = Arm(robot)
    guess = (-0.9, 0.8, -0.05, 0.0) if robot is SCARA else (-0.4, 0.4, 0.2, 0.0, 0.6, 0.0)
    first = arm.solve(path.at(0.0) @ FLANGE, guess)
    assert first is not None
    rest = [0.1] * (len(robot.joints) - len(first))
    start, end = (*first, *rest), (*first, *(each + table for each in rest))
    return PathMove(arm, robot.joints, start, end, path, FLANGE, speed, velocities, accelerations)


@pytest.mark.parametrize("kind", ["line", "arc"])
@BOTH
def test_the_slope_of_a_path_is_how_its_pose_changes(robot: Robot, kind: str) -> None:
    """Its ends too; the length is the sum of small steps, the angle that between its ends."""
    path, h = path_of(robot, kind), 1e-5
    for part in (0.0, 0.35, 1.0):
        found = twist_between(path.at(part - h), path.at(part + h)) / (2.0 * h)
        assert path.slope(part) == pytest.approx(found, abs=1e-6)
    places = np.array([path.at(part)[:3, 3] for part in np.linspace(0.0, 1.0, 2001)])
    length = float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())
    assert path.length == pytest.approx(length, rel=1e-6)
    turn = path.at(0.0)[:3, :3].T @ path.at(1.0)[:3, :3]
    assert math.cos(path.angle) == pytest.approx(0.5 * (np.trace(turn) - 1.0), abs=1e-9)
    begin, via, end = (pose_of(*place) for place in PLACES[robot.name])
    assert path.at(0.0) == pytest.approx(begin, abs=1e-12)
    assert path.at(1.0) == pytest.approx(end, abs=1e-9)
    missed = float(np.linalg.norm(places - via[:3, 3], axis=1).min())
    assert (missed < 2e-4) is (kind == "arc")


@pytest.mark.parametrize("bulge", [-150.0, 150.0])
def test_an_arc_of_more_than_half_a_circle_goes_the_long_way(bulge: float) -> None:
    """Through its middle point, wherever that lies."""
    begin, via, end = (
        pose_of(x, y, 0.0, 180.0, 0.0, 0.0) for x, y in ((400, 50), (400 + bulge, 0), (400, -50))
    )
    path = ToolPath(begin, end, via)
    assert path.length > math.pi * np.linalg.norm(end - begin) / 2.0
    places = [path.at(part)[:3, 3] for part in np.linspace(0.0, 1.0, 501)]
    assert min(float(np.linalg.norm(place - via[:3, 3])) for place in places) < 1e-3


@pytest.mark.parametrize("kind", ["line", "arc"])
@BOTH
def test_between_its_points_a_path_is_off_by_less_than_a_micrometre(
    robot: Robot, kind: str
) -> None:
    """A joint that does not move the tool goes evenly, whatever the path does."""
    path = path_of(robot, kind)
    move, arm = move_of(robot, path, table=0.5), Arm(robot)
    parts = np.linspace(0.0, 1.0, 333)
    rows = move.places(parts)
    for part, q in zip(parts, rows):
        tip = arm.pose(q[list(arm.columns)]) @ inverse(FLANGE)
        assert tip == pytest.approx(path.at(part), abs=1e-6)
    others = [k for k in range(len(robot.joints)) if k not in arm.columns]
    for k in others:
        assert rows[:, k] == pytest.approx(0.1 + 0.5 * parts, abs=1e-9)
    assert move.end == pytest.approx(rows[-1], abs=1e-12)


@pytest.mark.parametrize("kind", ["line", "arc"])
@BOTH
def test_points_solved_at_once_are_those_solved_one_after_the_other(
    robot: Robot, kind: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To a tenth of a nanometre; where one of them may not be, nothing is solved at once."""
    solved: list[bool] = []

    def watched(*given: object) -> object:
        found = together(*given)  # type: ignore[arg-type]
        solved.append(found is not None)
        return found

    together = path._together
    monkeypatch.setattr(path, "_together", watched)
    one = move_of(robot, path_of(robot, kind), table=0.5)
    monkeypatch.setattr(path, "_together", lambda *given: None)
    other = move_of(robot, path_of(robot, kind), table=0.5)
    assert solved == [True]
    assert one._nodes == pytest.approx(other._nodes, abs=1e-10)
    assert one._slopes == pytest.approx(other._slopes, rel=1e-7, abs=1e-9)
    monkeypatch.setattr(path, "_together", watched)
    stretched = [pose_of(x, 0, 60, 180, 0, 10) for x in (600, 690)]
    if robot is SCARA:
        with pytest.raises(RefusedError):
            move_of(robot, ToolPath(*stretched))
        assert solved == [True, False]


def slopes_of(move: PathMove) -> np.ndarray:
    """Return the steepest slope of each joint by the path's parameter."""
    rows = move.places(np.linspace(0.0, 1.0, 4001))
    return np.abs(np.diff(rows, axis=0)).max(axis=0) * 4000.0


@BOTH
def test_a_path_is_gone_as_fast_as_it_is_told(robot: Robot) -> None:
    """By the way, by the turn, by the time; the slowest of them counts."""
    path = path_of(robot, "line")
    by_way, by_turn = 0.2 / path.length, math.radians(30.0) / path.angle
    assert move_of(robot, path, Speed(mm_s=200.0)).law[0] == pytest.approx(by_way)
    assert move_of(robot, path, Speed(deg_s=30.0)).law[0] == pytest.approx(by_turn)
    both = move_of(robot, path, Speed(mm_s=200.0, deg_s=30.0))
    assert both.law[0] == pytest.approx(min(by_way, by_turn))
    timed = move_of(robot, path, Speed(seconds=2.0), accelerations=(20.0,) * 6)
    rate, change = timed.law
    assert 1.0 / rate + rate / change == pytest.approx(2.0)


@BOTH
@pytest.mark.parametrize("slow", range(3))
def test_no_joint_is_faster_on_a_path_than_it_can_be(robot: Robot, slow: int) -> None:
    """The joint that would be first at its limit decides, by speed and by acceleration."""
    path = path_of(robot, "line")
    limits = tuple(0.5 if k == slow else 1e3 for k in range(6))
    rate, change = move_of(robot, path, Speed(), limits, limits).law
    steepest = slopes_of(move_of(robot, path))[slow]
    assert rate == change == pytest.approx(0.5 / steepest, rel=0.01)


def test_a_turn_on_the_spot_and_a_way_of_nothing() -> None:
    """A turn has a length of 0 and takes its time; where nothing moves a path is over at once."""
    begin, _, end = PLACES[SCARA.name]
    turned = ToolPath(pose_of(*begin), pose_of(*begin[:5], 100.0))
    rate = move_of(SCARA, turned, Speed(mm_s=1.0, deg_s=45.0)).law[0]
    assert turned.length == 0.0 and rate == pytest.approx(0.5)
    shifted = ToolPath(pose_of(*begin), pose_of(*end[:3], *begin[3:]))
    rate = move_of(SCARA, shifted, Speed(mm_s=100.0, deg_s=1.0)).law[0]
    assert shifted.angle == 0.0 and rate == pytest.approx(0.1 / shifted.length)
    nowhere = ToolPath(pose_of(*begin), pose_of(*begin))
    move = move_of(SCARA, nowhere, Speed(mm_s=1.0, deg_s=1.0, seconds=9.0))
    assert move.done and move.law == (0.0, 0.0)
