"""Set points aim at where the leader is or is going to be."""

from __future__ import annotations

from collections.abc import Callable

import msgspec
import numpy as np
import pytest
from harness.pair import HOME, SETUP, Pair, idle_pair, ramp, shifted
from harness.parts import changed
from harness.running.thorough import thorough
from harness.sides import FOLLOW_TIMEOUT
from hypothesis import given
from hypothesis import strategies as st
from scara_control.joint_motion import JointMotion
from twin_controller.core.actions import FollowTwin
from twin_controller.core.events import AnyEvent, RealMeasured, TwinGripper
from twin_controller.core.follow.blend import begin_blend, sample_blend
from twin_controller.core.follow.memory import TwinFollows
from twin_controller.core.follow.twin import (
    aligned,
    close_gap,
    estimate_acceleration,
    follow_twin,
    go_on,
)
from twin_controller.core.lead.modes import Mode
from twin_controller.core.sides.side import RealSide

SPACING_S = 0.025
replace = msgspec.structs.replace
WIDE = (1e9,)


@given(
    coefficients=st.tuples(*[st.floats(-5.0, 5.0)] * 3),
    steps=st.tuples(st.floats(0.005, 0.03), st.floats(0.005, 0.03)),
)
def test_acceleration_is_exact_for_velocities_of_second_order(
    coefficients: tuple[float, ...], steps: tuple[float, float]
) -> None:
    """The slope at the newest sample of the parabola through three velocities."""
    velocity = np.polynomial.Polynomial(coefficients)
    times = (1.0, 1.0 + steps[0], 1.0 + steps[0] + steps[1])
    history = tuple(JointMotion.measured((0.0,), (float(velocity(t)),), t) for t in times)
    assert estimate_acceleration(history, WIDE)[0] == pytest.approx(
        velocity.deriv()(times[-1]), abs=1e-6
    )


@pytest.mark.parametrize(("samples", "expected"), [(0, 0.0), (1, 0.0), (2, 100.0), (3, 100.0)])
def test_acceleration_needs_two_samples_and_is_bounded(samples: int, expected: float) -> None:
    """A robot cannot accelerate faster than its joints' limits."""
    history = tuple(JointMotion.measured((0.0,), (1e6 * k,), 0.01 * k) for k in range(samples))
    assert estimate_acceleration(history, (100.0,)) == (expected,)
    backwards = tuple(replace(sample, qdot=(-sample.qdot[0],)) for sample in history)
    assert estimate_acceleration(backwards, (100.0,)) == (-expected,)


def turning(
    jerk: float, told: bool = False, period: float = 0.01
) -> tuple[RealSide, np.polynomial.Polynomial]:
    """Return a robot of which joint_1 has this jerk [rad/s^3], and its way; it has been read."""
    way = np.polynomial.Polynomial((0.1, 2.0, 5.0, jerk / 6.0))
    rest = (0.0,) * (len(HOME) - 1)
    rows = [
        JointMotion.measured((way(t), *rest), (way.deriv()(t), *rest), t)
        for t in period * np.arange(-7.0, 1.0)
    ]
    motion = rows[-1] if told else replace(rows[-1], qdot=())
    return RealSide(history=tuple(rows), flags=RealMeasured(0.0, 0.0, 0.0, 0, motion)), way


@pytest.mark.parametrize("period", [0.004, 0.01, 0.016])
def test_a_robot_that_tells_positions_alone_goes_on_with_its_jerk(period: float) -> None:
    """Through a turn from speeding up to braking the acceleration alone would go too far."""
    side, way = turning(-300.0, period=period)
    qddot, (point,) = go_on(SETUP, side)
    assert qddot[0] == pytest.approx(10.0) and point.time == SPACING_S
    assert point.q[0] == pytest.approx(way(SPACING_S))
    assert point.qdot[0] == pytest.approx(way.deriv()(SPACING_S))
    assert point.qddot[0] == pytest.approx(way.deriv(2)(SPACING_S))


def test_what_stands_goes_on_standing() -> None:
    """Whatever the speeds before say, of a damaged reading."""
    side, _ = turning(-300.0)
    stands = replace(side.history[-1], qdot=(0.0,) * len(HOME))
    side = replace(side, history=(*side.history[:-1], stands))
    assert go_on(SETUP, side) == ((0.0,) * len(HOME), ())


def test_speeds_that_are_told_or_of_uncertain_age_have_no_jerk() -> None:
    """It would be noise alone; nor does a jerk come from speeds that lie too close."""
    assert go_on(SETUP, turning(-300.0, told=True)[0])[1] == ()
    assert go_on(SETUP, turning(-300.0, period=0.002)[0])[1] == ()
    side, _ = turning(-300.0)
    assert side.flags is not None
    ticked = replace(side, flags=replace(side.flags, plain_clock=True))
    assert ticked.age_doubt > 0.0 and go_on(SETUP, ticked)[1] == ()


def test_the_acceleration_of_readings_of_any_age_is_the_last_slope_alone() -> None:
    """What the slope changed by is their ages more than the motion."""
    side, _ = turning(-300.0)
    assert side.flags is not None
    ticked = replace(side, flags=replace(side.flags, plain_clock=True))
    last, before = side.history[-1], side.history[-2]
    slope = (last.qdot[0] - before.qdot[0]) / (last.time - before.time)
    assert go_on(SETUP, ticked)[0][0] == pytest.approx(slope, rel=1e-9)
    assert abs(go_on(SETUP, side)[0][0] - slope) > 1.0


@pytest.mark.parametrize("jerk", [1e5, -1e5])
def test_no_joint_is_thought_faster_to_speed_up_than_it_can_be(jerk: float) -> None:
    """A difference of differences of readings is noisy; nor is a set point beyond a limit."""
    side, _ = turning(jerk)
    qddot, (point,) = go_on(SETUP, side)
    assert point.qddot[0] == pytest.approx(np.copysign(SETUP.acceleration[0], jerk))
    assert abs(qddot[0]) <= SETUP.acceleration[0]
    at_end = replace(side.history[-1], q=(SETUP.upper[0], *HOME[1:]), qdot=(9.0, 0.0, 0.0, 0.0))
    side = replace(side, history=(*side.history[:-1], at_end))
    assert go_on(SETUP, side)[1][0].q[0] <= SETUP.upper[0]


def test_where_the_twin_was_told_to_go_on_to_counts_when_it_is_due(
    pair: Pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not at once: what the twin does about it is an echo then, and a motion of its own before."""
    feed = pair.feed

    def without_speeds(event: AnyEvent) -> None:
        if isinstance(event, RealMeasured):
            event = replace(event, motion=replace(event.motion, qdot=()))
        feed(event)

    monkeypatch.setattr(pair, "feed", without_speeds)
    pair.start_program(ramp(HOME, shifted(HOME, 60.0), 2.0), run=1.0)
    here, there = pair.made(FollowTwin)[-1].points
    (first, place), (then, goes_on) = pair.state.sides.twin.tube.commands[-2:]
    assert then - first == pytest.approx(there.time - here.time) and there.time > here.time
    for point, told in ((here, place), (there, goes_on)):
        assert told == pytest.approx(SETUP.to_border(point.q))


@pytest.mark.parametrize(("part", "rests"), [(0.9, True), (1.1, False)])
def test_a_speed_counts_by_where_it_would_lead_the_twin(
    pair: Pair, part: float, rests: bool
) -> None:
    """Until it would stop without another set point: ``part`` of what is no rest."""
    sides, change = pair.state.sides, SETUP.config.change
    fastest = 2.0 * change.still_tolerance / FOLLOW_TIMEOUT
    follows: TwinFollows | None = TwinFollows(since=0.0)
    for late, rate in ((0.0, 0.0), (0.01, part * fastest)):
        qdot = (rate * SETUP.scale[0], *(0.0,) * (len(HOME) - 1))
        history = tuple(replace(each, qdot=qdot) for each in sides.real.history)
        real = replace(sides.real, history=history, noise=0.0)
        remembered, now = pair.state.follow.remembered, pair.now + late
        follows, _ = follow_twin(SETUP, follows, replace(sides, real=real), remembered, now)
    assert follows is not None
    assert (follows.told.still_since < pair.now) is rests


@pytest.mark.parametrize("state", ["announcing", "moving", "stopping", "idle", "following"])
def test_nothing_is_sent_to_a_twin_before_its_own_motion_has_ended(pair: Pair, state: str) -> None:
    """It would take none of it; the gap is closed from where it is then. Once begun it goes on."""
    sides = changed(pair.state.sides, twin__motion__state=state)
    remembered, waits = pair.state.follow.remembered, TwinFollows(since=0.0)
    own = state in ("announcing", "moving", "stopping")
    follows, told = follow_twin(SETUP, waits, sides, remembered, pair.now)
    assert (told is None) is own and (follows == waits) is own
    begun = replace(waits, blend=begin_blend((0.0,) * len(HOME), pair.now, SETUP.align_speeds()))
    assert follow_twin(SETUP, begun, sides, remembered, pair.now)[1] is not None


@pytest.mark.parametrize("end", [SETUP.lower[0], SETUP.upper[0]])
def test_a_joint_that_the_gap_takes_beyond_its_end_waits_there(pair: Pair, end: float) -> None:
    """The others go on as the robot does, with what is left of the gap closing."""
    sides, outward = pair.state.sides, float(np.sign(end))
    q = (end - 0.05 * outward, *HOME[1:])
    qdot = (0.3 * outward, 0.2, 0.0, 0.0)
    rows = [replace(each, q=q, qdot=qdot) for each in sides.real.history]
    gap = begin_blend((0.1 * outward, 0.1, 0.0, 0.0), rows[-1].time, SETUP.align_speeds())
    gap = replace(gap, start=gap.start - 0.2 * gap.duration)
    (_, left, *_), (_, rate, *_), (_, curve, *_) = sample_blend(gap, rows[-1].time)
    assert left > 0.05 and rate < 0.0 and curve < 0.0
    real = replace(sides.real, history=tuple(rows))
    follows = TwinFollows(since=0.0, slowly=True, blend=gap)
    _, told = follow_twin(
        SETUP, follows, replace(sides, real=real), pair.state.follow.remembered, pair.now
    )
    assert told is not None
    here = told.points[0]
    assert (here.q[0], here.qdot[0], here.qddot[0]) == (end, 0.0, 0.0)
    assert (here.q[1], here.qdot[1]) == pytest.approx((q[1] + left, 0.2 + rate))
    assert here.qddot[1] == pytest.approx(curve)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_small_gap_is_closed_at_once_and_a_large_one_at_alignment_speed(sign: float) -> None:
    """What late detection leaves would else be carried through the whole motion."""
    config = SETUP.config.align
    catch_up = tuple(sign * config.catch_up * scale for scale in SETUP.scale)
    small = close_gap(SETUP, tuple(0.9 * gap for gap in catch_up), 0.0)
    assert small.duration <= config.catch_up_ms * 1e-3 + 1e-12
    gap = tuple(20.0 * gap for gap in catch_up)
    large = close_gap(SETUP, gap, 0.0)
    slowest = max(1.875 * abs(g) / v for g, v in zip(gap, SETUP.align_speeds()))
    assert large.duration == pytest.approx(slowest)


@pytest.mark.parametrize(
    ("joint", "border"),
    [
        *((joint, (-1) ** joint * 2.0) for joint in range(4)),
        *thorough(*((joint, (-1) ** joint * -2.0) for joint in range(4))),
    ],
)
def test_a_pair_apart_in_either_direction_is_not_aligned(joint: int, border: float) -> None:
    """A twin that does not obey stays two degrees or millimetres off: the pair never gets ready."""
    apart = tuple(border if k == joint else 0.0 for k in range(4))
    pair = Pair(twin=shifted(HOME, *apart))
    pair.take_follow = lambda action, now: None  # type: ignore[method-assign]
    pair.link("real", True)
    pair.link("twin", True)
    pair.run(6.0)
    assert "IDLE" not in [each.mode_after for each in pair.decisions()]
    assert pair.decisions()[-1].mode_after == "ALIGNING"


@pytest.mark.parametrize(("after", "ends"), [(0.0, False), (0.9, False), (1.1, True)])
def test_what_stood_before_the_alignment_began_is_no_rest_of_it(after: float, ends: bool) -> None:
    """Both have stood for long; it ends a still time after its beginning, and not before."""
    pair = idle_pair()
    pair.run(2.0)
    blend = begin_blend((0.0,) * 4, pair.now - 2.0, SETUP.align_speeds())
    follows = TwinFollows(0.0, blend=blend, told=pair.state.sides.twin.change)
    still = SETUP.config.change.still_time_ms * 1e-3
    since = pair.now - after * still
    assert aligned(SETUP, follows, pair.state.sides, since, pair.now) is ends


def stray_once(pair: Pair, joint: int, border: float) -> None:
    """Let one answer of the robot say that a joint moves, so many border units a second."""
    told_of, left = pair.real_at, [True]

    def real_at(t: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
        q, qdot = told_of(t)
        rates = list(qdot)
        if left:
            left.pop()
            rates[joint] += border * SETUP.scale[joint]
        return q, tuple(rates)

    pair.real_at = real_at  # type: ignore[method-assign]


def links_again() -> Pair:
    """Return a pair that aligns again after its link to the robot was cut."""
    pair = idle_pair()
    pair.link("real", False)
    pair.run(0.2)
    pair.link("real", True)
    pair.until(Mode.ALIGNING)
    return pair


def program_ended() -> Pair:
    """Return a pair whose robot has just ended a program of its own."""
    pair = idle_pair()
    pair.start_program(ramp(HOME, shifted(HOME, 0.0, 10.0), 0.8), 0.8)
    pair.end_program()
    assert pair.mode is Mode.REAL_LEADS
    return pair


@pytest.mark.parametrize("begin", [links_again, program_ended])
@pytest.mark.parametrize("late_s", [0.03, *thorough(0.0, 0.015, 0.06)])
@pytest.mark.parametrize(
    ("joint", "border"), [(2, 32.0), *thorough((0, 5.0), (1, -40.0), (3, -200.0), (2, -3.0))]
)
def test_one_damaged_speed_before_the_pair_rests_leads_nobody(
    begin: Callable[[], Pair], late_s: float, joint: int, border: float
) -> None:
    """The set point it makes may be on its way to a twin that stands: no motion of the twin's."""
    for after in np.arange(0.0, 0.5, 0.009):
        pair = begin()
        pair.command_delay = late_s
        pair.run(after)
        if pair.mode is Mode.IDLE:
            break
        decided = len(pair.decisions())
        stray_once(pair, joint, border)
        pair.run(0.8)
        assert set(pair.triggers(decided)) <= {"ALIGNED", "AT_REST"}
        pair.until(Mode.IDLE)
        assert pair.far() < 0.05
    assert 0.1 < after < 0.49


@pytest.mark.parametrize("touches", ["part_1 touches stand_1", ""])
def test_an_alignment_that_cannot_end_says_which_joint_by_how_much_and_what_touches(
    touches: str,
) -> None:
    """A twin that stands on something stays short of the real robot's pose for good."""
    pair = Pair(twin=shifted(HOME, 0.0, 0.0, 0.62))
    pair.take_follow = lambda action, now: None  # type: ignore[method-assign]  # it cannot move
    pair.link("real", True)
    pair.link("twin", True)
    pair.run(1.0)
    assert pair.mode is Mode.ALIGNING
    pair.feed(TwinGripper(pair.now, on=False, holding=False, touches=touches))
    pair.run(SETUP.config.align.timeout_ms * 1e-3)
    (failed,) = [each for each in pair.decisions() if each.trigger == "ALIGN_FAILED"]
    at, there = (HOME[2] * 1e3 + 0.62, HOME[2] * 1e3)
    assert f"joint_3 is 0.62 mm away, at {at:.2f} instead of {there:.2f} mm" in failed.why
    away = "lead the real robot away by its pendant, where a paused program is aborted first"
    way_out = f"{touches}: {away}"
    assert (way_out if touches else "the twin reports no contact") in failed.why
