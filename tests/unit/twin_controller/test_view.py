"""What the core knows is shown: rounded positions, reasons, links, alarms with what to do."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from harness.pair import HOME, SETUP, Pair, ramp, shifted
from harness.parts import changed
from scara_control.kinematics.screws import forward_kinematics
from scara_ros.diagnosis import Level
from twin_controller.core.actions import Decided
from twin_controller.core.events import Tick
from twin_controller.core.lead.modes import Mode
from twin_controller.core.lead.table import LEADING
from twin_controller.core.safety.divergence import DelayState
from twin_controller.core.sides.pairing import paired
from twin_controller.core.state import CoreState
from twin_controller.core.step import step
from twin_controller.reporting.robot_status import scaling_factor
from twin_controller.view import alarm_text, decision_text, state_view, statuses

replace = msgspec.structs.replace
AWAY = shifted(HOME, 20.0, -30.0, 40.0, 10.0)


def level(pair_state: CoreState, name: str, now: float = 0.0) -> int:
    """Return the level of one diagnostic."""
    return next(
        status.level
        for status in statuses(SETUP, pair_state, {}, now)
        if status.name.endswith(name)
    )


def test_positions_are_rounded_and_their_difference_is_of_what_is_shown(pair: Pair) -> None:
    """Two decimals in degrees and millimetres, real minus twin, home as the file says."""
    pair.real_q = shifted(HOME, 0.0149)
    pair.run(0.02)
    view = state_view(SETUP, pair.state, pair.now)
    assert view.name == ("joint_1", "joint_2", "joint_3", "table_joint")
    assert view.unit == ("deg", "deg", "mm", "deg")
    assert view.twin_position == (0.0, 0.0, -160.0, 0.0)
    assert view.real_position == (0.01, 0.0, -160.0, 0.0)
    assert view.deviation == (0.01, 0.0, 0.0, 0.0)


def test_both_sides_are_shown_at_one_instant_with_nothing_removed(pair: Pair) -> None:
    """Joints, tools and distance agree, while the twin is late and the sides are read apart."""
    pair.start_program(ramp(HOME, AWAY, 1.0))
    for _ in range(20):
        pair.run(0.031)
        view = state_view(SETUP, pair.state, pair.now)
        real, twin = paired(pair.state.sides) or (None, None)
        assert real is not None and twin is not None and real.time == twin.time
        assert view.real_position == tuple(round(q, 2) for q in SETUP.to_border(real.q))
        assert view.twin_position == tuple(round(q, 2) for q in SETUP.to_border(twin.q))
        places = [
            forward_kinematics(SETUP.arm, np.array([side.q[k] for k in SETUP.arm_columns]))[:3, 3]
            for side in (real, twin)
        ]
        apart = 1e3 * float(np.linalg.norm(places[0] - places[1]))
        assert view.deviation_mm == pytest.approx(apart, abs=1e-6)
        assert view.real_tool == pytest.approx(places[0], abs=1e-9)
        assert view.twin_tool == pytest.approx(places[1], abs=1e-9)
    assert view.leader == "real"


def test_lag_is_that_of_the_follower(pair: Pair) -> None:
    """Behind is above zero, whoever follows; nobody follows: not known."""
    late = replace(pair.state.safety, delay=DelayState(late=0.02))
    state = replace(pair.state, safety=late)
    for leader, lag in (("real", -0.02), ("twin", 0.02), ("operator", 0.02)):
        led = replace(state, lead=replace(state.lead, leader=leader))
        assert state_view(SETUP, led, pair.now).lag == lag
    assert math.isnan(state_view(SETUP, state, pair.now).lag)


def test_before_anything_is_known_nothing_is_claimed() -> None:
    """Empty lists, links down with a reason, infinite age."""
    state = Pair().state
    view = state_view(SETUP, state, 1.0)
    assert (view.mode, view.leader) == ("OFFLINE", "")
    assert view.real_position == view.twin_position == view.deviation == ()
    assert [link.connected for link in view.links] == [False, False]
    assert all(link.reason for link in view.links)
    assert math.isnan(view.deviation_mm) and math.isnan(view.real_tool[0])
    assert view.links[0].age == float("inf")
    assert not view.real_standing_still and not view.twin_standing_still


def test_links_show_clock_and_round_trip(pair: Pair) -> None:
    """Offset, uncertainty and samples of each side's clock, and how old its newest sample is."""
    real, twin = state_view(SETUP, pair.state, pair.now).links
    assert (real.name, twin.name) == ("real", "twin")
    assert real.connected and twin.connected and not real.reason and not twin.reason
    latency = SETUP.config.real.sample_latency_ms * 1e-3
    assert real.clock_offset == pytest.approx(5000.0, abs=0.002 + latency)
    assert twin.clock_offset == pytest.approx(1.7e9, abs=0.002)
    assert 0.0 < real.clock_uncertainty < 0.002 and 0.0 <= twin.clock_uncertainty < 0.002
    assert real.round_trip == pytest.approx(0.0005) and twin.round_trip == pytest.approx(0.0008)
    assert 0.0 <= real.age < 0.02 and 0.0 <= twin.age < 0.02
    assert min(real.samples, twin.samples) >= 5


def test_who_leads_and_what_is_limited_is_shown(pair: Pair) -> None:
    """The leader, the speed asked for and allowed, and why."""
    pair.move_twin(ramp(HOME, AWAY, 2.0), run=0.8)
    view = state_view(SETUP, pair.state, pair.now)
    assert (view.mode, view.leader) == ("TWIN_LEADS", "twin")
    assert view.speed_limited and view.speed_applied_percent < view.speed_requested_percent
    assert view.speed_reason
    assert not view.twin_standing_still
    assert view.real_override_percent == pair.state.sides.real.flags.override_percent > 0.0
    assert view.follower_lag == max(pair.state.follow.response.delay)


def mode(state: CoreState, name: Mode, **changes: object) -> CoreState:
    """Return the state in another mode."""
    return changed(state, lead__mode=name, **changes)


def test_an_alarm_says_what_to_do(pair: Pair) -> None:
    """The robot's own text first; else what the mode needs; else nothing."""
    state = pair.state

    def alarm(of: CoreState) -> str:
        return alarm_text(SETUP, of, pair.now)

    assert alarm(state) == ""
    assert alarm(changed(state, sides__real__alarm="SRVO-050 collision")) == "SRVO-050 collision"
    assert "RESET, then ALIGN" in alarm(mode(state, Mode.ESTOP))
    fault = mode(state, Mode.FAULT, lead__why="the stream does not start")
    assert alarm(fault) == "the stream does not start"
    assert "ACKNOWLEDGE" in alarm(mode(state, Mode.PAUSED, lead__needs_acknowledge=True))


def test_an_alarm_outlives_a_link_that_blinks(pair: Pair) -> None:
    """The robot says when it ends, not that it goes on; meanwhile the lost link is the cause."""
    pair.alarm("SRVO-050")
    pair.link("real", False)
    pair.run(0.5)
    away = alarm_text(SETUP, pair.state, pair.now)
    pair.link("real", True)
    pair.run(0.5)
    assert pair.mode is Mode.FAULT and "SRVO-050" not in away
    assert alarm_text(SETUP, pair.state, pair.now) == "SRVO-050"


def test_a_side_that_came_back_is_not_named_when_the_other_is_lost(pair: Pair) -> None:
    """Its pose controller was silent once: nobody looks there hours later."""
    report, pair.report_motion = pair.report_motion, lambda: None  # type: ignore[method-assign]
    pair.until(Mode.OFFLINE, 1.0)
    assert "its pose controller was silent" in alarm_text(SETUP, pair.state, pair.now)
    pair.report_motion = report  # type: ignore[method-assign]
    pair.until(Mode.IDLE)
    pair.link("real", False)
    assert alarm_text(SETUP, pair.state, pair.now) == "real: cut"


def test_the_reason_of_a_lost_link_is_shown(pair: Pair) -> None:
    """Which side, and why, as text and as diagnostics of that link."""
    pair.link("twin", False)
    assert alarm_text(SETUP, pair.state, pair.now) == "twin: cut"
    assert level(pair.state, "link twin") == Level.ERROR
    assert level(pair.state, "link real") == Level.OK
    assert "cut" in next(
        s.message for s in statuses(SETUP, pair.state, {}, pair.now) if s.name.endswith("link twin")
    )


@pytest.mark.parametrize("name", list(Mode))
def test_each_mode_has_a_diagnostic_level(pair: Pair, name: Mode) -> None:
    """What needs a person is a warning or an error; a new mode has to be thought about."""
    levels = {
        Level.OK: {Mode.IDLE, Mode.ALIGNING, *LEADING},
        Level.WARN: {Mode.PAUSED, Mode.STOPPED, Mode.STANDSTILL},
        Level.ERROR: {Mode.OFFLINE, Mode.ESTOP, Mode.FAULT},
    }
    (expected,) = (each for each, modes in levels.items() if name in modes)
    assert level(mode(pair.state, name), "mode") == expected


def test_alarm_and_divergence_are_errors(pair: Pair) -> None:
    """Each has its own diagnostic."""
    state = pair.state
    assert (level(state, "real robot"), level(state, "pair")) == (Level.OK, Level.OK)
    assert level(changed(state, sides__real__alarm="SRVO-050"), "real robot") == Level.ERROR
    assert level(changed(state, sides__real__warning="SYST-011"), "real robot") == Level.WARN
    assert level(changed(state, safety__divergence__alarm=True), "pair") == Level.ERROR


@pytest.mark.parametrize("name", list(Mode))
def test_a_delay_is_told_only_while_the_tools_are_compared(pair: Pair, name: Mode) -> None:
    """Behind a STOP or a lost link nobody ends its alarm until ALIGN, and nobody is behind."""
    state = mode(pair.state, name, safety__delay__judged__alarm=True)
    expected = Level.WARN if name in (Mode.IDLE, *LEADING) else Level.OK
    assert level(state, "delay") == expected


def test_counters_of_the_links_are_among_their_values(pair: Pair) -> None:
    """What was received, rejected, reconnected."""
    found = statuses(SETUP, pair.state, {"real": {"rejected": 3}}, pair.now)
    assert (
        next(status.values["rejected"] for status in found if status.name.endswith("link real"))
        == "3"
    )


BASE = Decided(
    7,
    12.3456,
    "IDLE",
    "REAL_MOVED",
    "REAL_LEADS",
    "real",
    (),
    "the real robot moved first: the twin follows",
)


@pytest.mark.parametrize(
    ("real", "twin", "expected"),
    [
        (
            None,
            None,
            "#7 12.346 s IDLE -> REAL_LEADS: the real robot moved first: the twin follows",
        ),
        (12.3, None, "(real moved at 12.3000 s, twin did not move, uncertainty 1.5 ms)"),
        (None, 12.3, "(real did not move, twin moved at 12.3000 s, uncertainty 1.5 ms)"),
        (
            12.3,
            12.305,
            "(real moved at 12.3000 s, twin moved at 12.3050 s, difference +5.0 ms, "
            "uncertainty 1.5 ms)",
        ),
        (12.3, 12.298, "difference -2.0 ms"),
    ],
)
def test_a_decision_is_told_in_plain_words(
    real: float | None, twin: float | None, expected: str
) -> None:
    """Who led, both onsets, their uncertain difference; positive: the real robot was first."""
    text = decision_text(replace(BASE, onset_real=real, onset_twin=twin, onset_uncertainty=0.0015))
    assert expected in text and text.startswith("#7 12.346 s IDLE -> REAL_LEADS")


def test_a_speed_that_the_robot_does_not_tell_is_unknown(pair: Pair) -> None:
    """Not 0 %, and not the override, which is told."""
    pair.start_program(ramp(HOME, AWAY, 2.0), run=0.5)
    state = changed(pair.state, sides__real__flags__speed_percent=None)
    state, _ = step(SETUP, state, Tick(pair.now + 0.001))
    view = state_view(SETUP, state, pair.now)
    assert view.leader == "real" and view.real_override_percent == 100.0
    assert math.isnan(view.speed_requested_percent) and math.isnan(view.speed_applied_percent)
    assert scaling_factor(state) == 1.0
