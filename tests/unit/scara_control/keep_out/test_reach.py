"""How far a watched point can move at most: never too little, and for a SCARA not much too far."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from harness.pair import SETUP
from harness.running.thorough import thorough
from harness.yaml_files import CONFIG
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace
from scara_config import KeepOut, load_robot
from scara_control.keep_out.points import positions, watched_points
from scara_control.keep_out.reach import largest_rates, may_reach
from scara_control.keep_out.zones import free_part, heads_into
from scara_control.kinematics.screws import ScrewModel, tool_positions

NAMES = ("fanuc_sr6ia", "fanuc_sr3ia", "scara_4axis", "articulated_six")
ROBOTS = {name: load_robot(CONFIG / "robots" / name) for name in NAMES}
SHARE = st.floats(0.0, 1.0)
CORNER = st.tuples(*[SHARE] * 8)


def _corners(name: str, shares: list[tuple[float, ...]]) -> np.ndarray:
    """Return joint positions, within twice the limits: a way may be reckoned beyond them."""
    low, high = np.array([(2 * j.lower, 2 * j.upper) for j in ROBOTS[name].twin_joints]).T
    return low + np.array(shares)[:, : len(low)] * (high - low)


@pytest.mark.parametrize("name", [NAMES[0], *thorough(*NAMES[1:])])
@given(shares=st.lists(CORNER, min_size=2, max_size=4))
def test_no_way_leads_further_than_the_rates_say(
    name: str, shares: list[tuple[float, ...]]
) -> None:
    """Each point, each axis, all along the way, of arms with parallel axes and of others."""
    corners = _corners(name, shares)
    part = np.linspace(0.0, 1.0, 40)[:, None]
    way = np.concatenate([a + part * (b - a) for a, b in pairwise(corners)])
    turned = np.abs(np.diff(corners, axis=0)).sum(axis=0)
    for point in watched_points(ROBOTS[name]):
        assert point.rates is not None
        path = positions(point, way)
        most = turned[list(point.columns)] @ np.array(point.rates)
        assert np.all(np.abs(path - path[0]) <= most + 1e-9)


def test_a_scara_keeps_its_height_and_its_radius() -> None:
    """Its tool turns about the base at 0.65 m at most, about the elbow at 0.3; one joint lifts."""
    tool = next(point for point in SETUP.points if point.name == "tool")
    base, elbow, spindle = tool.rates or ()
    assert base == pytest.approx((0.65, 0.65, 0.0))
    assert elbow == pytest.approx((0.3, 0.3, 0.0))
    assert spindle == pytest.approx((0.0, 0.0, 1.0))


def test_an_axis_a_rounding_too_long_has_rates_too() -> None:
    """Its component may be 1 and a digit: no root of less than nothing."""
    long = float(np.nextafter(1.0, 2.0))
    axes = np.array([[long, 0, 0, 0, 0, 0]], dtype=float).T
    home = np.eye(4)
    home[1, 3] = 0.5
    (rates,) = largest_rates(ScrewModel(axes, home)) or ()
    assert rates == pytest.approx((0.0, 0.5, 0.5))


def test_a_slide_across_an_axis_is_not_guessed() -> None:
    """Its stroke would be part of the radius."""
    axes = np.array([[0, 0, 1, 0, 0, 0], [0, 0, 0, 1, 0, 0]], dtype=float).T
    assert largest_rates(ScrewModel(axes, np.eye(4))) is None


@given(shares=st.lists(st.tuples(*[SHARE] * 7), min_size=2, max_size=4))
def test_an_arm_on_a_rail_leads_no_further_than_its_rates_say(
    shares: list[tuple[float, ...]],
) -> None:
    """The rail carries all that turns: no radius changes with it."""
    six = ScrewModel.from_robot(ROBOTS["articulated_six"])
    rail = np.array([[0.0, 0.0, 0.0, 0.6, 0.8, 0.0]]).T
    model = ScrewModel(np.hstack([rail, six.screw_axes]), six.home_pose)
    rates = largest_rates(model)
    assert rates is not None
    assert rates[0] == pytest.approx((0.6, 0.8, 0.0))
    assert rates[1:] == largest_rates(six)
    corners = np.array(shares) * 4.0 - 2.0
    part = np.linspace(0.0, 1.0, 40)[:, None]
    way = np.concatenate([a + part * (b - a) for a, b in pairwise(corners)])
    path = tool_positions(model, way)
    most = np.abs(np.diff(corners, axis=0)).sum(axis=0) @ np.array(rates)
    assert np.all(np.abs(path - path[0]) <= most + 1e-9)


@given(shares=st.lists(CORNER, min_size=2, max_size=3), at=st.tuples(*[SHARE] * 3))
def test_what_is_judged_does_not_depend_on_it(
    shares: list[tuple[float, ...]], at: tuple[float, ...]
) -> None:
    """Points that cannot come near are left out; the zone and the free part are the same."""
    corners = [tuple(row) for row in _corners("fanuc_sr6ia", shares).tolist()]
    low = -800.0 + 1600.0 * np.array(at)
    x, y, z = low.tolist()
    zones = (KeepOut("box", (x, y, z), (x + 120.0, y + 120.0, z + 120.0)), *SETUP.keep_out)
    unknown = [replace(point, rates=None) for point in SETUP.points]
    assert heads_into(SETUP.points, zones, *corners) == heads_into(unknown, zones, *corners)
    ends = corners[0], corners[-1]
    assert free_part(SETUP.points, zones, *ends) == free_part(unknown, zones, *ends)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_zone_that_is_far_along_one_axis_is_out_of_reach(axis: int, side: float) -> None:
    """However wide it is along the others."""
    tool = next(point for point in SETUP.points if point.name == "tool")
    low, high = [-9000.0] * 3, [9000.0] * 3
    low[axis], high[axis] = sorted((side * 2000.0, side * 9000.0))
    far = KeepOut("far", tuple(low), tuple(high))
    assert tool.rates is not None
    assert not may_reach(
        tool.model, tool.rates, (0.0, 0.0, -0.1), (0.1, 0.1, 0.1), [far], tool.half
    )


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("turn", [0.5, -2.5])
def test_a_zone_that_begins_where_the_tool_stands_is_within_reach(
    axis: int, side: float, turn: float
) -> None:
    """However little the joints turn, and on whichever side it lies."""
    tool = next(point for point in SETUP.points if point.name == "tool")
    here = (turn, 0.3, -0.1)
    at = 1e3 * positions(tool, np.array([(*here, 0.0)]))[0]
    low, high = at - 100.0, at + 100.0
    low[axis], high[axis] = sorted((at[axis], at[axis] + side * 100.0))
    zone = KeepOut("zone", tuple(low.tolist()), tuple(high.tolist()))
    assert tool.rates is not None
    assert may_reach(tool.model, tool.rates, here, (0.0, 0.0, 0.0), [zone], tool.half)


def test_a_number_that_is_none_is_looked_at_closely() -> None:
    """Nothing is left out for a position that is not known."""
    tool = next(point for point in SETUP.points if point.name == "tool")
    far = KeepOut("far", (5000.0, 5000.0, 5000.0), (6000.0, 6000.0, 6000.0))
    here = (0.0, 0.0, -0.1)
    assert tool.rates is not None
    assert not may_reach(tool.model, tool.rates, here, (0.1, 0.1, 0.1), [far], tool.half)
    assert may_reach(
        tool.model, tool.rates, (float("nan"), 0.0, -0.1), (0.1, 0.1, 0.1), [far], tool.half
    )


def test_a_zone_that_only_the_body_around_a_point_touches_is_within_reach() -> None:
    """The forearm stands still 10 mm beside it, and its middle is further away."""
    here = (0.0, 0.0, -0.1, 0.0)
    part = [point for point in SETUP.points if point.name == "link_2"][-1]
    middle, half = positions(part, np.array([here]))[0], np.array(part.half)
    low = 1e3 * (middle + np.array([-0.3, half[1] - 0.01, -0.3]))
    high = low + np.array([600.0, 400.0, 600.0])
    zone = KeepOut("zone", tuple(low.tolist()), tuple(high.tolist()))
    assert part.rates is not None
    turned = (0.0, 0.001)
    assert not may_reach(part.model, part.rates, here[:2], turned, [zone], (0.0, 0.0, 0.0))
    assert may_reach(part.model, part.rates, here[:2], turned, [zone], part.half)
    assert "deeper" in heads_into([part], [zone], here, (0.0, 0.5, -0.1, 0.0))
    assert free_part([part], [zone], (0.0, -0.5, -0.1, 0.0), here) < 1.0


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(("joint", "turn", "axis"), [(0, 0.1, 0), (0, 0.1, 1), (2, 0.05, 2)])
def test_a_zone_is_reached_by_the_way_of_one_joint_and_by_no_less(
    joint: int, turn: float, axis: int, side: float
) -> None:
    """To either side along each axis of the base, to a tenth of a millimetre."""
    tool = next(point for point in SETUP.points if point.name == "tool")
    assert tool.rates is not None
    here, turned = (0.0, 0.0, -0.1), [turn if k == joint else 0.0 for k in range(3)]
    place = 1e3 * positions(tool, np.array([[*here, 0.0]]))[0]
    for off_mm, reached in ((-0.1, True), (0.1, False)):
        low, high = place - 1000.0, place + 1000.0
        face = place[axis] + side * (1e3 * turn * tool.rates[joint][axis] + off_mm)
        (low if side > 0.0 else high)[axis] = face
        zone = KeepOut("wall", tuple(low), tuple(high))
        assert may_reach(tool.model, tool.rates, here, turned, [zone], tool.half) is reached
