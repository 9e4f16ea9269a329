"""Where a side was at equal steps of time, and how far along its way."""

from __future__ import annotations

import numpy as np
import pytest
from scara_config import load_robot
from twin_experiments.metrics.series import Motion, equal_steps, interpolate
from twin_experiments.metrics.tracks import (
    Mechanism,
    distance_from_path,
    first_to_move,
    onset,
    travelled,
)

STAMPS = np.linspace(0.0, 1.0, 11)
SLOPE = 0.5


@pytest.mark.parametrize(
    ("end", "count"), [(0.0, 1), (0.29, 30), (0.295, 30), (0.3, 31), (1.0, 101)]
)
def test_every_step_up_to_the_end_is_there(end: float, count: int) -> None:
    """0.29 s times 100 is a rounding less than 29: no step is lost by it, and none is behind."""
    motion = Motion("real", STAMPS, SLOPE * STAMPS[:, None], np.full((11, 1), SLOPE))
    positions, velocities = interpolate(motion, equal_steps(0.0, end, 100.0))
    assert positions[:, 0] == pytest.approx(SLOPE * 0.01 * np.arange(count), abs=1e-9)
    assert velocities[:, 0] == pytest.approx([SLOPE] * count)


def test_a_way_is_the_sum_of_its_steps_from_its_first_place() -> None:
    """Back and forth counts twice."""
    places = np.array([[1.0, 0.0, 0.0], [1.0, 3.0, 4.0], [1.0, 0.0, 0.0], [1.0, 0.0, 2.0]])
    assert travelled(places) == pytest.approx([0.0, 5.0, 10.0, 12.0])


@pytest.mark.parametrize("count", [2, 3, 10, 101])
@pytest.mark.parametrize("window", [0, 1, 5])
def test_a_path_is_nowhere_away_from_itself(count: int, window: int) -> None:
    """From its first place to its last, however near by the nearest one is looked for."""
    turned = np.linspace(0.0, 3.0, count)
    places = np.column_stack((np.cos(turned), np.sin(turned), turned))
    assert distance_from_path(places, places, window) == pytest.approx(np.zeros(count))
    aside = places + (0.0, 0.0, 1.0) * np.array([[1.0], [0.0]])[np.arange(count) % 2]
    found = distance_from_path(aside, places, 0)
    assert found[0] > 0.3 and found[1] == pytest.approx(0.0)


def test_a_place_is_looked_for_where_it_is_along_the_path() -> None:
    """Seven places of a zigzag of three steps, none of which is looked for on another step."""
    reference = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [2.0, 1.0]])
    places = np.array([np.interp(np.linspace(0, 3, 7), range(4), row) for row in reference.T]).T
    assert distance_from_path(places, reference, 0) == pytest.approx(np.zeros(7))


def test_the_end_of_a_closed_path_is_not_near_its_beginning() -> None:
    """On the way it is as far as can be; a place beside the beginning is away from that."""
    reference = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0], [0.0, 0.2]])
    places = reference + [[0.0, 0.3], *[[0.0, 0.0]] * 5]
    assert distance_from_path(places, reference, 1)[0] == pytest.approx(0.3)
    assert distance_from_path(places[::-1], reference[::-1], 1)[-1] == pytest.approx(0.3)


def test_joints_of_a_foreign_robot_are_shown_as_they_were_recorded() -> None:
    """In SI, and their places are their positions; a known robot's are in its border units."""
    foreign = Mechanism(("a", "b"), None, (), None)
    assert foreign.scales == pytest.approx([1.0, 1.0])
    assert (foreign.units, foreign.place_unit) == (("rad or m",) * 2, "rad or m")
    assert foreign.places(np.array([[0.1, 0.2]])) == pytest.approx(np.array([[0.1, 0.2]]))
    joints = load_robot().twin_joints
    known = Mechanism(tuple(joint.name for joint in joints), joints, (), None)
    assert known.scales == pytest.approx(np.array([joint.scale for joint in joints]))


def test_a_joint_moves_from_the_stated_percent_of_its_largest_speed_on() -> None:
    """Of a foreign robot a hundredth of what either side reached, and never nothing."""
    joints = tuple(load_robot().twin_joints)
    known = Mechanism(tuple(joint.name for joint in joints), joints, (), None)
    slow = known.moving_speeds((), 2.0)
    assert slow == pytest.approx([0.02 * joint.velocity for joint in joints])
    foreign = Mechanism(("a", "b"), None, (), None)
    fast, faster = (
        Motion(side, STAMPS, np.zeros((11, 2)), np.linspace(0.0, most, 11)[:, None] * (-1.0, 0.0))
        for side, most in (("real", 0.5), ("twin", 3.0))
    )
    assert foreign.moving_speeds((fast, faster), 2.0) == pytest.approx([0.03, 1e-4])


@pytest.mark.parametrize(
    ("real", "twin", "first"),
    [
        (0.3, 0.4, "real"),
        (0.4, 0.3, "twin"),
        (0.3, 0.3, "real"),
        (0.3, None, "real"),
        (None, 0.3, "twin"),
        (None, None, "real"),
    ],
)
def test_whoever_moves_first_leads_and_the_real_robot_where_nobody_is_first(
    real: float | None, twin: float | None, first: str
) -> None:
    """A motion begins at the first sample whose speed counts, were it the only one."""

    def moves(side: str, at: float | None) -> Motion:
        rows = np.zeros((11, 2))
        rows[np.isclose(STAMPS, -1.0 if at is None else at), 1] = -0.2
        motion = Motion(side, STAMPS, np.zeros((11, 2)), rows)
        assert onset(motion, speeds) == (None if at is None else pytest.approx(at))
        return motion

    speeds = np.array([0.1, 0.2])
    assert first_to_move(moves("real", real), moves("twin", twin), speeds) == first


@pytest.mark.parametrize("leader", ["real", "twin"])
@pytest.mark.parametrize(("led", "followed"), [((0, 5), (0, 6)), ((0, 1), (1, 2))])
def test_whose_sample_came_first_says_nothing_of_a_motion_that_had_begun_before(
    leader: str, led: tuple[int, ...], followed: tuple[int, ...]
) -> None:
    """Whoever moves first after both have rested leads; else who moved while the other rested."""

    def moves(side: str) -> Motion:
        # The follower's samples come sooner, by 1 ms.
        rows, shift = (led, 1e-3) if side == leader else (followed, 0.0)
        speeds = np.zeros((11, 1))
        speeds[list(rows)] = 0.2
        return Motion(side, STAMPS + shift, np.zeros((11, 1)), speeds)

    assert first_to_move(moves("real"), moves("twin"), np.array([0.1])) == leader
