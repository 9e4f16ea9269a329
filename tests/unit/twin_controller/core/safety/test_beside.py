"""How fast a robot may begin that stands beside a zone."""

from __future__ import annotations

import itertools

import msgspec
import numpy as np
import pytest
from harness.pair import ROBOT, SETUP, idle_pair
from harness.parts import changed
from harness.yaml_files import CONFIG
from scara_config import KeepOut, load_robot
from scara_control.joint_motion import JointMotion
from scara_control.keep_out.points import WatchedPoint, all_positions
from scara_control.keep_out.reach import largest_rates
from scara_control.kinematics.screws import ScrewModel
from twin_controller.core.lead.reports import note_in_zone
from twin_controller.core.safety.beside import Beside, judge_start, start_share, start_ways
from twin_controller.core.safety.guard import Guard, _reached, judge_guard
from twin_controller.core.safety.stopping import Braking
from twin_controller.core.setup import Setup

LEAST_PERCENT, CRAWL = 2, 0.01
replace = msgspec.structs.replace

HOME = (0.0, 0.0, -0.1, 0.0)
TOOL_Z_MM = 60.0


def below(gap_mm: float) -> Setup:
    """Return a cell with a zone so far below the tool, and nowhere else."""
    setup = Setup(ROBOT, SETUP.config)
    top = TOOL_Z_MM - gap_mm
    setup.keep_out = (KeepOut("box", (500.0, -200.0, top - 50.0), (800.0, 200.0, top)),)
    return setup


def stop_way(speed: float, acceleration: float, jerk: float, braking: float, delay: float) -> float:
    """Return how far a joint comes, by steps of a microsecond: the same rule by another route."""
    step, v, way = 1e-6, 0.0, 0.0
    for k in range(round(delay / step)):
        way += v * step
        v = min(v + min(jerk * k * step, acceleration) * step, speed)
    return way + v * v / (2.0 * braking)


@pytest.mark.parametrize("joint", [0, 1, 2])
@pytest.mark.parametrize("share", [0.05, 0.3, 1.0])
def test_no_joint_comes_farther_than_it_is_reckoned(joint: int, share: float) -> None:
    """And the reckoning is at most by 30 % too far, or 4 mm."""
    way = start_ways(SETUP, share)[joint]
    tables = (SETUP.acceleration, SETUP.jerk, SETUP.braking)
    limits = [table[joint] for table in tables]
    true = stop_way(share * SETUP.velocity[joint], *limits, SETUP.braking_delay)
    assert true - 1e-6 <= way <= max(1.3 * true, true + 4e-3)


@pytest.mark.parametrize("joint", [0, 1, 2])
@pytest.mark.parametrize("delay", [0.01, 0.05, 0.09])
def test_a_start_that_nobody_slows_is_reckoned_exactly(joint: int, delay: float) -> None:
    """Also where a joint has its acceleration long before it brakes."""
    setup = Setup(ROBOT, SETUP.config)
    setup.braking_delay = delay
    limits = [table[joint] for table in (setup.acceleration, setup.jerk, setup.braking)]
    true = stop_way(setup.velocity[joint], *limits, delay)
    assert start_ways(setup, 1.0)[joint] == pytest.approx(true, rel=1e-3)


@pytest.mark.parametrize("gap_mm", [6.0, 10.0, 14.0])
def test_a_start_in_any_direction_ends_before_the_zone(gap_mm: float) -> None:
    """With the speed that is allowed, by the arm's own kinematics; and it is not idle."""
    setup = below(gap_mm)
    share = start_share(setup, HOME)
    assert LEAST_PERCENT * 1e-2 < share < 1.0
    ways = np.array(start_ways(setup, share))
    signs = np.array(list(itertools.product((-1.0, 0.0, 1.0), repeat=len(ways))))
    ends = all_positions(setup.points, np.array(HOME) + signs * ways) * 1e3
    halves = np.array([point.half for point in setup.points])[:, None] * 1e3
    zone = setup.keep_out[0]
    inside = (ends + halves > zone.lower_mm) & (ends - halves < zone.upper_mm)
    assert not inside.all(axis=2).any()


def test_the_nearer_the_slower_and_far_away_not_at_all() -> None:
    """A robot that stands 50 mm above the table begins as fast as ever."""
    shares = [start_share(below(gap), HOME) for gap in (0.1, 6.0, 10.0, 14.0, 50.0)]
    assert shares == sorted(shares)
    assert (shares[0], shares[-1]) == (LEAST_PERCENT * 1e-2, 1.0)


def test_a_standstill_is_judged_once() -> None:
    """Each sample of a robot at rest would cost a search; other zones are another question."""
    setup = below(6.0)
    judged = judge_start(setup, Beside(), HOME, 1.0)
    assert judge_start(setup, judged, HOME, 1.0) is judged
    assert judge_start(setup, judged, HOME, 2.0) is not judged
    assert judge_start(below(50.0), judged, HOME, 1.0).share == 1.0


def test_a_robot_that_stands_beside_a_zone_begins_slowly_and_one_that_moves_does_not() -> None:
    """One that is on its way is judged by that, and so is one far from any zone."""
    real = idle_pair().state.sides.real
    near, last = Setup(ROBOT, SETUP.config), real.last
    x, y, z = (1e3 * all_positions(SETUP.points, np.array([last.q]))[-1, 0]).tolist()
    box = KeepOut("box", (x - 100.0, y - 100.0, z - 60.0), (x + 100.0, y + 100.0, z - 10.0))
    near.keep_out = (box,)
    for share, slow in ((0.0, True), (0.009, True), (0.011, False)):
        qdot = (share * SETUP.velocity[0], *(0.0,) * (len(last.q) - 1))
        shown = replace(real, history=(*real.history, replace(last, qdot=qdot)))
        for setup, slowed in ((near, slow), (SETUP, False)):
            guard = judge_guard(setup, Guard(), shown, (0.0, ""), led=False)
            assert (guard.start < 1.0) is slowed


@pytest.mark.parametrize(
    ("own_program", "override", "speed", "asked"),
    [
        (True, 50.0, 25.0, 0.5),
        (True, 100.0, 80.0, 0.8),
        # One that is faster than its override, which it has just been given, asks for all of it.
        (True, 50.0, 80.0, 1.0),
        (True, 100.0, 0.2, CRAWL),
        (True, 0.0, 25.0, 1.0),
        (True, 50.0, None, 1.0),
        (False, 50.0, 25.0, 1.0),
    ],
)
def test_a_program_asks_for_a_part_of_its_override(
    own_program: bool, override: float, speed: float | None, asked: float
) -> None:
    """Of what the joints can at full override; all of it where nobody says."""
    real = idle_pair().state.sides.real
    told = {"own_program": own_program, "override_percent": override, "speed_percent": speed}
    shown = changed(real, **{f"flags__{name}": value for name, value in told.items()})
    guard = judge_guard(SETUP, Guard(), shown, (0.0, ""), led=False)
    assert guard.asked == pytest.approx(asked)


@pytest.mark.parametrize(
    ("own_program", "override", "speed", "most"),
    [
        (True, 10.0, None, 0.1),
        (True, 50.0, 8.0, 0.088),
        (True, 100.0, None, 0.205),
        (False, 10.0, None, 0.205),
    ],
)
def test_a_program_gets_no_faster_than_it_may(
    own_program: bool, override: float, speed: float | None, most: float
) -> None:
    """By the time at which it brakes: by its override, or what it says with a tenth more."""
    real, rest = idle_pair().state.sides.real, (0.0,) * (len(HOME) - 1)
    top, braking = SETUP.velocity[0], Braking(SETUP.braking, 0.15, together=own_program)
    # At 8 % of its largest speed at last, and each 10 ms by a part of 0.83 % more.
    rows = [
        JointMotion.measured(HOME, ((0.08 - 0.0083333 * k) * top, *rest), 1.0 - 0.01 * k)
        for k in (3, 2, 1, 0)
    ]
    told = {"own_program": own_program, "override_percent": override, "speed_percent": speed}
    shown = changed(real, history=tuple(rows), **{f"flags__{k}": v for k, v in told.items()})
    found = _reached(SETUP, shown, braking)
    assert found[0] / top == pytest.approx(most, rel=2e-3) and found[1:] == rest


@pytest.mark.parametrize("led", [False, True])
def test_what_hardly_moves_heads_into_a_zone_only_where_somebody_leads(led: bool) -> None:
    """A robot at rest that its noise moves towards the table is no reason to stop the pair."""
    setup, real = below(0.1), idle_pair().state.sides.real
    qdot = (0.0, 0.0, -0.5e-3 * SETUP.config.separation.standstill_mm_s, 0.0)
    shown = replace(real, history=(*real.history, replace(real.last, q=HOME, qdot=qdot)))
    guard = judge_guard(setup, Guard(), shown, (-qdot[2], "tool"), led)
    assert bool(guard.violation) is led


def test_a_robot_that_came_to_rest_in_a_zone_says_what_to_measure() -> None:
    """Once: its profile says how late it begins to brake at most, and it was later."""
    lead, setup = idle_pair().state.lead, Setup(ROBOT, SETUP.config)
    setup.braking_delay = 0.123
    said, (decision,) = note_in_zone(setup, lead, "", "it stands 4 mm deep in table", 1.0)
    assert decision.trigger == "IN_ZONE" and decision.why == said.why
    assert said.why.startswith("it stands 4 mm deep in table: it brakes later than 123 ms, ")
    for before, inside in (("deep", "deeper"), ("deep", ""), ("", "")):
        assert note_in_zone(setup, lead, before, inside, 1.0) == (lead, [])


@pytest.mark.parametrize(("free", "stops"), [(False, True), (True, False)])
def test_a_known_way_into_a_zone_stops_the_robot_and_slows_none(free: bool, stops: bool) -> None:
    """Who knows the way need not guess a speed: it is stopped in time, or goes on as it does."""
    setup, real = below(6.0), idle_pair().state.sides.real
    down = (0.0, 0.0, HOME[2] - 0.02, 0.0)
    moving = replace(real.last, q=HOME, qdot=(0.0, 0.0, -0.1, 0.0))
    shown = replace(real, history=(*real.history, moving))
    ahead = ((HOME,) if free else (down,), (down,))
    guard = judge_guard(setup, Guard(), shown, (0.1, "tool"), True, ahead)
    assert bool(guard.violation) is stops and guard.share == 1.0


def on_a_slide(carried: int, gap_mm: float) -> Setup:
    """Return the six-joint arm, a slide behind ``carried`` of its joints; a zone below its tool."""
    setup = Setup(load_robot(CONFIG / "robots" / "articulated_six"), SETUP.config)
    screws = np.insert(setup.arm.screw_axes, carried, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0], axis=1)
    model = ScrewModel(screws, setup.arm.home_pose)
    setup.points = (WatchedPoint("tool", model, tuple(range(7)), largest_rates(model)),)
    for name, value in (("velocity", 1.0), ("acceleration", 4.0), ("jerk", 60.0), ("braking", 2.0)):
        setattr(setup, name, (*getattr(setup, name), value))
    x, y, z = (1e3 * setup.arm.home_pose[:3, 3]).tolist()
    top = z - gap_mm
    low = (x - 200.0, y - 200.0, top - 50.0)
    setup.keep_out = (KeepOut("box", low, (x + 200.0, y + 200.0, top)),)
    return setup


def test_an_arm_on_a_rail_begins_slowly_beside_a_zone_and_far_away_does_not() -> None:
    """One with a slide behind a turning joint may be anywhere, and begins slowly always."""
    shares = [start_share(on_a_slide(0, gap), (0.0,) * 7) for gap in (1.0, 30.0, 5000.0)]
    assert shares[0] < shares[1] < shares[2] == 1.0
    assert start_share(on_a_slide(1, 5000.0), (0.0,) * 7) == LEAST_PERCENT * 1e-2
