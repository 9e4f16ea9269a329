"""A peak of the tools' distance is told at once, and once."""

from __future__ import annotations

import msgspec
import pytest
from harness.pair import HOME, SETUP, Pair, idle_pair, shifted
from scara_control.joint_motion import JointMotion
from twin_controller.core.sides.side import Sides
from twin_controller.core.state import CoreState
from twin_controller.reporting.peak import LONGEST_S, Peak
from twin_controller.view import state_view

replace = msgspec.structs.replace
DEG_MM = 11.34
"""One degree of joint 1 at the straight arm."""


@pytest.fixture(scope="module")
def known() -> CoreState:
    """Return the state of a pair that stands, both sides known at one instant."""
    pair = idle_pair()
    return pair.state


def led(state: CoreState, apart_mm: float, leader: str = "real") -> CoreState:
    """Return the same with the twin so far away, and somebody who leads."""
    q = shifted(HOME, apart_mm / DEG_MM)
    history = tuple(replace(motion, q=q) for motion in state.sides.twin.history)
    sides = replace(state.sides, twin=replace(state.sides.twin, history=history))
    return replace(state, sides=sides, lead=replace(state.lead, leader=leader))


def test_what_is_further_apart_than_told_by_a_step_is_told(known: CoreState) -> None:
    """A fall is not, nor a rise that comes back to what was told; the next lead begins anew."""
    peak = Peak(SETUP)
    seen = [0.05, 0.15, 0.2, 0.31, 0.1, 0.35, 7.0, 3.0, 7.05, 7.11]
    told = [apart for apart in seen if peak.rises(led(known, apart))]
    assert told == [0.15, 0.31, 7.0, 7.11]
    assert not peak.rises(led(known, 0.0, ""))
    assert peak.rises(led(known, 0.5))
    assert peak.rises(led(known, 0.5, "twin"))


def test_nothing_is_told_while_nobody_leads_or_a_side_is_unknown(known: CoreState) -> None:
    """A robot that is turned on beside its twin is no peak."""
    assert not Peak(SETUP).rises(led(known, 100.0, ""))
    fresh = Pair().state
    assert not Peak(SETUP).rises(replace(fresh, lead=replace(fresh.lead, leader="real")))


def test_a_peak_between_two_samples_of_the_robot_is_told_with_both_sides_as_they_were_then(
    known: CoreState,
) -> None:
    """The twin swings away and back between two readings, at which both agree."""
    apart, late = 1.0 / DEG_MM, 0.016
    real, twin = known.sides.real, known.sides.twin
    start = real.last.time
    at = [start + share * late for share in (0.0, 0.25, 0.5, 0.75, 1.0)]
    swing = [shifted(HOME, apart * share) for share in (0.0, 0.5, 1.0, 0.5, 0.0)]
    rest = (0.0,) * len(HOME)
    there = tuple(JointMotion.measured(q, rest, time) for q, time in zip(swing, at))
    readings = tuple(JointMotion.measured(HOME, rest, time) for time in (start, start + late))
    lead = replace(known.lead, leader="real")
    first = Sides(replace(real, history=readings[:1]), replace(twin, history=there))
    both = Sides(replace(real, history=readings), replace(twin, history=there))
    peak = Peak(SETUP)
    assert peak.rises(replace(known, sides=first, lead=lead)) is None
    state = replace(known, sides=both, lead=lead)
    widest = peak.rises(state)
    assert widest is not None and widest[0].time == widest[1].time
    assert widest[0].time == pytest.approx(at[2], abs=1e-3)
    shown = state_view(SETUP, state, widest[0].time, widest)
    assert shown.deviation_mm == pytest.approx(1.0, abs=0.02)
    assert state_view(SETUP, state, widest[0].time).deviation_mm == 0.0
    assert peak.rises(state) is None, "told twice"


def test_nothing_is_made_up_across_a_hole(known: CoreState) -> None:
    """Nobody knows how a side moved that was silent for longer than LONGEST_S."""
    real, twin = known.sides.real, known.sides.twin
    start, end = real.last.time, real.last.time + LONGEST_S + 0.01
    rest, fast = (0.0,) * len(HOME), shifted((0.0,) * len(HOME), 30.0)
    swung = (JointMotion.measured(HOME, fast, start), JointMotion.measured(HOME, rest, end))
    readings = tuple(JointMotion.measured(HOME, rest, time) for time in (start, end))
    lead = replace(known.lead, leader="real")
    peak = Peak(SETUP)
    for count in (1, 2):
        sides = Sides(replace(real, history=readings[:count]), replace(twin, history=swung))
        assert peak.rises(replace(known, sides=sides, lead=lead)) is None
