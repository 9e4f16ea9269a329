"""Measurements become samples on our clock; what is old, repeated or of unknown time does not."""

from __future__ import annotations

import itertools

import msgspec
import numpy as np
import pytest
from harness.pair import HOME, SETUP, Pair, idle_pair, ramp, shifted
from harness.parts import changed
from hypothesis import given
from hypothesis import strategies as st
from scara_control.joint_motion import JointMotion
from twin_controller.core.events import (
    ClockProbe,
    LinkChanged,
    RealAlarm,
    RealMeasured,
    TwinMeasured,
)
from twin_controller.core.sides import change
from twin_controller.core.sides.measure import (
    agree,
    clock_probed,
    real_lost,
    real_measured,
    take_in,
    twin_lost,
    twin_measured,
)
from twin_controller.core.sides.pairing import apart_text, interpolate, paired
from twin_controller.core.sides.side import RealSide, Sides, TwinSide
from twin_controller.estimation.latch import Latch

replace = msgspec.structs.replace
STILL = (0.0,) * len(HOME)
FRESH = Sides()


def real_answer(
    t: float, offset: float = 50.0, q: tuple[float, ...] = HOME, qdot: tuple[float, ...] = STILL
) -> RealMeasured:
    """Return an answer that was true at ``t`` on the controller's clock."""
    clock_ms = round((t + offset) * 1000)
    return RealMeasured(t, t - 0.001, t, clock_ms, JointMotion.measured(q, qdot, clock_ms * 1e-3))


def known_twin(offset: float = 1e9) -> TwinSide:
    """Return a twin whose clock is known."""
    return clock_probed(SETUP, TwinSide(), ClockProbe(1.0, 0.999, 1.0, 0.9995 + offset))


@given(coefficients=st.tuples(*[st.floats(-3.0, 3.0)] * 4), share=st.floats(0.0, 1.0))
def test_interpolation_is_exact_for_cubics(coefficients: tuple[float, ...], share: float) -> None:
    """Position and velocity at two instants determine a cubic."""
    curve = np.polynomial.Polynomial(coefficients)
    slope = curve.deriv()
    history = tuple(
        JointMotion.measured((float(curve(t)),), (float(slope(t)),), t) for t in (0.0, 0.3, 0.7)
    )
    t = 0.7 * share
    found = interpolate(history, t)
    assert found is not None
    assert found.q[0] == pytest.approx(curve(t), abs=1e-9)
    assert found.qdot[0] == pytest.approx(slope(t), abs=1e-9)


@pytest.mark.parametrize("t", [-0.1, 0.71])
def test_nothing_is_known_outside_the_history(t: float) -> None:
    """Interpolation never extrapolates."""
    history = tuple(JointMotion.measured((0.0,), (0.0,), x) for x in (0.0, 0.3, 0.7))
    assert interpolate(history, t) is None
    assert interpolate((), t) is None and interpolate(history[:1], 0.0) is None


def test_a_sample_of_the_real_robot_is_dated_by_its_own_clock() -> None:
    """Not by its arrival: the stamp converted by the estimated offset, within its uncertainty."""
    side = RealSide()
    for k in range(20):
        side = real_measured(SETUP, side, real_answer(1.0 + 0.01 * k))
    real = SETUP.config.real
    age = side.last.time - (1.19 - 1e-3 * real.sample_latency_ms)
    assert abs(age) <= side.clock.uncertainty + 1e-9 <= 0.0015 + 0.5 * side.rhythm.period
    assert (side.seen, side.clock_ms) == (pytest.approx(1.19, abs=2e-3), 51190)
    assert side.rhythm.ahead == pytest.approx(50000.5), "of the middle of question and answer"


def test_an_answer_that_repeats_an_instant_does_not_count() -> None:
    """A frozen robot clock brings no new sample and no freshness."""
    first = real_measured(SETUP, RealSide(), real_answer(1.0))
    again = real_measured(
        SETUP, first, replace(real_answer(1.0), now=1.2, sent=1.199, received=1.2)
    )
    assert again == replace(first, asked=1.199)


def test_a_reading_that_is_given_again_is_no_sample() -> None:
    """A plain clock counts on while a slow robot answers what it answered before."""
    latch = Latch(period_ms=16, phase_ms=4, settled=True)
    side = replace(RealSide(), latch=latch)
    for clock_ms in (100, 110, 120, 130, 140, 150):
        at = 1e-3 * clock_ms
        q = (HOME[0] + 1e-3 * ((clock_ms - 4) // 16), *HOME[1:])
        motion = JointMotion.measured(q, (), at)
        event = RealMeasured(at, at - 0.002, at, clock_ms, motion, plain_clock=True)
        side = real_measured(SETUP, side, event)
    steps = np.diff([sample.time for sample in side.history])
    assert steps == pytest.approx(0.016, abs=1e-4) and len(steps) == 3
    assert side.flags is not None and side.flags.clock_ms == 150


@pytest.mark.parametrize("phase", [0, 2, 4, 6])
@pytest.mark.parametrize("gaps", [(10, 12, 6, 6, 12), (6, 10, 6, 14, 10, 4), (4, 6, 12, 6, 16)])
def test_a_first_motion_is_seen_while_it_is_found_out_how_old_readings_are(
    gaps: tuple[int, ...], phase: int
) -> None:
    """Some answers give a reading again, and each guess of the robot's period moves the others.

    It renews its readings each 8 ms and speeds up from rest: it never seems to slow down, and a
    reading whose instant is known lies on its way.
    """

    def way(ms: float) -> float:
        return 0.5 * 35.0 * max(0.0, 1e-3 * (ms - 600.0)) ** 2

    side, clock_ms, before = RealSide(), 0, 0.0
    for gap in itertools.islice(itertools.cycle(gaps), 80):
        clock_ms += gap
        latched = clock_ms - (clock_ms - phase) % 8
        q, at = (HOME[0], HOME[1] + way(latched), *HOME[2:]), 1.0 + 1e-3 * clock_ms
        motion = JointMotion.measured(q, (), 1e-3 * clock_ms)
        event = RealMeasured(at, at - 0.001, at, clock_ms, motion, plain_clock=True)
        side = real_measured(SETUP, side, event)
        speed = side.last.qdot[1]
        assert speed >= 0.8 * before or before < 0.2, clock_ms
        before = speed
        if clock_ms > 750:
            break
    assert side.latch.grid[:2] == (8, phase)
    assert speed == pytest.approx(35.0 * 1e-3 * (latched - 600.0), rel=0.1)
    for reading in side.history[-6:]:
        assert reading.q[1] == pytest.approx(HOME[1] + way(1e3 * (reading.time - 1.0)), abs=0.01)


def test_what_stands_by_its_positions_has_no_speed() -> None:
    """Noise from one reading to the next would be one, of a robot that tells positions alone."""
    random, side, told = np.random.default_rng(5), RealSide(), list[tuple[float, ...]]()
    for k in range(60):
        q = shifted(HOME, *random.uniform(-0.005, 0.005, len(HOME)))
        side = real_measured(SETUP, side, real_answer(1.0 + 0.01 * k, q=q, qdot=()))
        told.append(side.last.qdot)
    assert any(map(any, told[:10])) and set(told[-30:]) == {STILL}


@pytest.mark.parametrize("jump", [3600.0, 0.2, -0.2])
def test_a_jump_of_the_real_clock_forgets_the_real_side(jump: float) -> None:
    """Nothing dated by the old clock may be compared with what is dated by the new one."""
    side = RealSide()
    for k in range(5):
        side = real_measured(SETUP, side, real_answer(1.0 + 0.01 * k))
    jumped = real_measured(SETUP, side, real_answer(1.05, offset=50.0 + jump))
    assert jumped.history == () and jumped.seen is None and jumped.flags is None
    assert jumped.clock.jumps == 1 and not jumped.clock.known
    assert "jumped" in jumped.reason


def at(now: float, stamp: float, q: tuple[float, ...] = HOME) -> TwinMeasured:
    """Return a joint state of a twin that stands."""
    return TwinMeasured(now, JointMotion.measured(q, STILL, stamp))


@pytest.mark.parametrize("jump", [3600.0, -3600.0, 0.2, -0.2])
def test_a_jump_of_the_twin_clock_forgets_the_twin(jump: float) -> None:
    """Likewise."""
    state = twin_measured(SETUP, known_twin(), at(1.01, 1.01 + 1e9))
    assert state.history
    jumped = clock_probed(SETUP, state, ClockProbe(1.02, 1.019, 1.02, 1e9 + 1.02 + jump))
    assert jumped.history == () and jumped.clock.jumps == 1
    assert "jumped" in jumped.reason


def test_a_joint_state_of_the_twin_waits_for_its_clock() -> None:
    """A stamp without a clock is no time."""
    unknown = TwinSide()
    assert twin_measured(SETUP, unknown, at(1.0, 1e9)) == unknown


def test_joint_states_out_of_order_are_dropped() -> None:
    """Reordered or repeated packets bring nothing new."""
    state = twin_measured(SETUP, known_twin(), at(1.02, 1.02 + 1e9))
    for stamp in (1.02, 1.01, 0.5):
        assert twin_measured(SETUP, state, at(1.03, stamp + 1e9, shifted(HOME, 1.0))) == state


@pytest.mark.parametrize(("beyond_ms", "lost"), [(-1.0, False), (1.0, True)])
def test_a_stamp_from_the_future_is_borne_as_far_as_the_clock_may_explain_it(
    beyond_ms: float, lost: bool
) -> None:
    """A tenth of a second, and what is not known of the twin's clock: a probe took 20 ms."""
    twin = clock_probed(SETUP, TwinSide(), ClockProbe(1.0, 0.980, 1.0, 0.990 + 1e9))
    assert twin.clock.uncertainty == pytest.approx(0.010, abs=1e-3)
    stamp = 1.0 + 0.1 + twin.clock.uncertainty + 1e-3 * beyond_ms
    state = twin_measured(SETUP, twin, at(1.0, stamp + 1e9))
    assert bool(state.history) is not lost
    assert ("ahead of its clock" in state.reason) is lost


@pytest.mark.parametrize("side", ["real", "twin"])
def test_a_link_that_changes_forgets_its_side_only(side: str) -> None:
    """Nothing old may count after a reconnect; the other side is not touched."""
    pair = idle_pair()
    event = LinkChanged(pair.now, side, False, "cut")  # type: ignore[arg-type]
    sides = take_in(SETUP, pair.state.sides, event)
    lost, kept = (sides.real, sides.twin) if side == "real" else (sides.twin, sides.real)
    assert (
        lost.connected,
        lost.reason,
        lost.history,
        lost.change.baseline,
        lost.tube.commands,
    ) == (False, "cut", (), (), ())
    assert not lost.clock.known
    assert kept.history and kept.clock.known
    assert (sides.real.flags is None, sides.twin.motion is None) == (side == "real", side == "twin")


def test_a_lost_side_keeps_its_connection_and_its_count_of_jumps() -> None:
    """Data that cannot be used are no broken link."""
    side = twin_lost(TwinSide(connected=True, clock=replace(known_twin().clock, jumps=3)), "silent")
    assert (side.connected, side.reason, side.clock.jumps) == (True, "silent", 3)


def test_pairs_are_of_one_instant(pair: Pair) -> None:
    """The twin is interpolated to the real sample's time, never newest against newest."""
    found = paired(pair.state.sides)
    assert found is not None and found[0].time == found[1].time
    assert paired(FRESH) is None


def test_a_twin_that_is_late_is_paired_with_an_older_sample_but_no_old_one(pair: Pair) -> None:
    """The fourth newest at most: what lies further back is no longer where both are."""
    sides = pair.state.sides
    real, twin = sides.real.history, sides.twin.history
    for back, found in ((1, True), (4, True), (5, False)):
        late = real[-back].time - twin[-1].time + 1e-6
        moved = tuple(replace(each, time=each.time + late) for each in twin)
        both = paired(replace(sides, twin=replace(sides.twin, history=moved)))
        assert (both is not None) is found
        assert both is None or both[0].time == both[1].time == real[-back].time


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_joint_that_is_farthest_away_is_named_on_either_side(pair: Pair, sign: float) -> None:
    """By how far, and where it is and should be."""
    sides = pair.state.sides
    q = shifted(HOME, 0.3 * sign, -0.9 * sign)
    moved = tuple(replace(each, q=q) for each in sides.twin.history)
    text = apart_text(SETUP, replace(sides, twin=replace(sides.twin, history=moved)))
    here, there = SETUP.to_border(q)[1], SETUP.to_border(HOME)[1]
    assert text.startswith(f"joint_2 is 0.90 deg away, at {here:.2f} instead of {there:.2f} deg")


def test_an_alarm_stops_and_a_warning_does_not_and_the_newer_one_stands() -> None:
    """One that is cleared leaves none."""
    sides, seen = FRESH, list[tuple[str, str]]()
    for text, stops in (("hot", False), ("torn", True), ("", True), ("worn", False), ("", False)):
        sides = take_in(SETUP, sides, RealAlarm(1.0, text, stops))
        seen.append((sides.real.alarm, sides.real.warning))
    assert seen == [("", "hot"), ("torn", ""), ("", ""), ("", "worn"), ("", "")]


def test_how_far_a_twin_is_away_counts_at_one_instant(pair: Pair) -> None:
    """The newest samples are of two; where the twin's are all older they have to do."""
    pair.start_program(ramp(HOME, shifted(HOME, 60.0), 2.0), run=1.0)
    sides = pair.state.sides
    real, twin = paired(sides) or (None, None)
    assert real is not None and twin is not None
    apart = abs(SETUP.to_border(real.q)[0] - SETUP.to_border(twin.q)[0])
    assert apart_text(SETUP, sides).startswith(f"joint_1 is {apart:.2f} deg away")
    old = tuple(replace(each, time=each.time - 9.0) for each in sides.twin.history)
    real, twin = sides.real.last, sides.twin.last
    apart = abs(SETUP.to_border(real.q)[0] - SETUP.to_border(twin.q)[0])
    text = apart_text(SETUP, replace(sides, twin=replace(sides.twin, history=old)))
    assert text.startswith(f"joint_1 is {apart:.2f} deg away")


def test_what_the_twin_says_of_itself_stands_behind_how_far_it_is_away(pair: Pair) -> None:
    """Its contact, or that it has none, with what its motion is; a twin may not have told yet."""
    motion = replace(pair.state.sides.twin.motion, state="idle", message="")
    for told, says in (
        (None, "; the twin reports no contact"),
        (motion, "; the twin reports no contact, its motion is idle"),
        (
            replace(motion, message="tired"),
            "; the twin reports no contact, its motion is idle tired",
        ),
    ):
        sides = changed(pair.state.sides, twin__motion=told)
        assert apart_text(SETUP, sides).endswith(says)


@pytest.mark.parametrize(("part", "goes_along"), [(0.5, True), (1.5, False)])
def test_an_agreed_position_goes_along_for_as_long_as_a_drive_may_settle(
    part: float, goes_along: bool
) -> None:
    """``part`` of the time of the file; what goes on after that is a motion."""
    side, after = RealSide(), part * SETUP.config.settle.timeout_ms * 1e-3
    for k in range(40):
        side = real_measured(SETUP, side, real_answer(1.0 + 0.01 * k))
    side = agree(SETUP, side)
    for k in range(40):
        q = shifted(HOME, 0.015)
        side = real_measured(SETUP, side, real_answer(1.4 + after + 0.01 * k, q=q))
    assert (side.change.baseline[0] > SETUP.to_border(HOME)[0]) is goes_along


@pytest.mark.parametrize(("noise", "widened"), [(0.0, False), (0.003, False), (0.01, True)])
def test_the_noise_of_a_side_at_rest_is_measured(noise: float, widened: bool) -> None:
    """The thresholds are five of its standard deviations, and never less than the file's."""
    random, side = np.random.default_rng(1), RealSide()
    for k in range(300):
        q = tuple(random.normal(0.0, noise, len(HOME)))
        side = real_measured(SETUP, side, real_answer(1.0 + 0.0097 * k, q=shifted(HOME, *q)))
    assert side.noise == pytest.approx(noise, rel=0.3, abs=1e-9)
    config = change.widened(SETUP.config.change, side.noise)
    assert (config.hysteresis > SETUP.config.change.hysteresis) == widened
    if widened:
        assert config.hysteresis == pytest.approx(5.0 * side.noise) == config.still_tolerance


def test_the_noise_of_a_side_outlives_its_loss() -> None:
    """It belongs to the robot; what moved meanwhile does not."""
    lost = real_lost(replace(RealSide(), noise=0.01), "silent")
    assert lost.noise == 0.01 and lost.history == ()
