"""Set points aim at where the leader is or is going to be."""

from __future__ import annotations

from collections.abc import Callable

import msgspec
import numpy as np
import pytest
from harness.pair import HOME, ROBOT, SETUP, Pair, idle_pair, ramp, shifted
from harness.parts import changed
from harness.running.thorough import thorough
from harness.sides import FOLLOW_TIMEOUT
from hypothesis import given
from hypothesis import strategies as st
from scara_control.joint_motion import AxisMotion, JointMotion
from twin_controller.core.actions import FollowTwin, StreamReal
from twin_controller.core.events import AnyEvent, RealMeasured, TwinGripper
from twin_controller.core.follow.blend import begin_blend, sample_blend
from twin_controller.core.follow.memory import RealFollows, TwinFollows
from twin_controller.core.follow.real import (
    PLANNED,
    UNPLANNED,
    setpoint_spacing,
    stream_real,
    target_of,
    twin_course,
)
from twin_controller.core.follow.remembered import SPACING_S
from twin_controller.core.follow.twin import (
    close_gap,
    estimate_acceleration,
    follow_twin,
    go_on,
)
from twin_controller.core.lead.modes import Mode
from twin_controller.core.setup import Setup
from twin_controller.core.sides.side import RealSide, TwinSide
from twin_controller.estimation.rhythm import Rhythm, heard

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


def moving_pair() -> tuple[Pair, float]:
    """Return a pair whose twin runs an announced move, and when that began."""
    pair = idle_pair()
    pair.move_twin(ramp(HOME, shifted(HOME, 40.0), 1.0))
    start = pair.now + pair.announce
    pair.run(0.4)
    return pair, start


def places(twin: TwinSide, now: float, at: float) -> tuple[float, ...]:
    """Return where the course of ``now`` has the joints at a time [s]."""
    course = twin_course(SETUP, twin, now)
    return tuple(course(k, at)[0] for k in range(len(HOME)))


def test_the_twins_plan_tells_where_it_is_going_to_be() -> None:
    """Within the plan's horizon the aim is where the path goes, not an extrapolation."""
    pair, start = moving_pair()
    for ahead in (0.0, 0.03, 0.08):
        q = places(pair.state.sides.twin, pair.now, pair.now + ahead)
        path = ramp(HOME, shifted(HOME, 40.0), 1.0)(pair.now + ahead - start)
        assert q == pytest.approx(path, abs=2e-4)


def test_without_a_plan_the_twins_last_state_is_carried_on_but_not_far() -> None:
    """Constant velocity, for 0.2 s at most; never back in time."""
    pair, _ = moving_pair()
    twin = replace(pair.state.sides.twin, plan=None)
    last = twin.last
    for local, ahead in ((last.time + 0.05, 0.05), (last.time + 5.0, 0.2), (last.time - 1.0, 0.0)):
        q = places(twin, local, local)
        assert q == pytest.approx(tuple(a + v * ahead for a, v in zip(last.q, last.qdot)))


def test_a_plan_counts_while_the_twin_was_last_seen_to_follow_it() -> None:
    """By when it was seen, however late it is now: it goes on to the plan's end and stays there."""
    pair, start = moving_pair()
    twin = pair.state.sides.twin
    assert twin.plan is not None and twin.seen is not None
    late = twin.clock.to_local(twin.plan.end) + 0.01
    end = ramp(HOME, shifted(HOME, 40.0), 1.0)(late - 0.01 - start)
    assert places(twin, late, late + 1.0)[0] >= end[0] - 1e-3
    unseen = replace(twin, seen=None)
    assert places(unseen, pair.now, pair.now) == places(twin, pair.now, pair.now)
    carried = places(replace(twin, plan=None), late, late)
    assert places(unseen, late, late) == carried != places(twin, late, late)


def test_a_plan_that_is_over_is_not_used() -> None:
    """After its last row the twin's measured state counts."""
    pair, _ = moving_pair()
    twin = pair.state.sides.twin
    assert twin.plan is not None
    over = replace(twin, plan=replace(twin.plan, stamp=twin.plan.stamp - 1.0))
    none = replace(twin, plan=None)
    assert places(over, pair.now, pair.now) == places(none, pair.now, pair.now)


def test_the_robots_own_limit_is_the_gates_whatever_its_override(pair: Pair) -> None:
    """R[2] times override is what set points may have: a late robot catches up no faster."""
    pair.move_twin(ramp(HOME, shifted(HOME, 20.0), 2.0), run=0.6)
    for override, expected in ((100.0, 79.0), (90.0, 790.0 / 9.0), (30.0, 100.0)):
        follow = pair.state.follow
        sides = changed(pair.state.sides, real__flags__override_percent=override)
        streamed = stream_real(SETUP, follow.real, sides, follow.response, 100.0, pair.now + 0.02)
        assert streamed.rejected == ""
        sent = {setpoint.speed_percent for setpoint in streamed.setpoints}
        assert len(sent) == 1 and sent.pop() == pytest.approx(expected)


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


@pytest.mark.parametrize(("jogs", "longer"), [(False, PLANNED), (True, UNPLANNED)])
def test_set_points_are_decided_until_the_next_answer_and_a_plans_further_ahead(
    jogs: bool, longer: float
) -> None:
    """So many spacings more; without a plan those further ahead would be guesses."""
    pair, ends = idle_pair(), list[float]()
    move = pair.jog_twin if jogs else lambda path, _: pair.move_twin(path)
    move(ramp(HOME, shifted(HOME, 40.0), 4.0), pair.now)
    pair.until(Mode.TWIN_LEADS)
    pair.run(0.5)
    since = len(pair.actions)
    for _ in range(500):
        pair.run(0.001)
        ends += [one.send_at - pair.now for one in pair.made(StreamReal, since)]
        since = len(pair.actions)
    real = pair.state.sides.real
    spacing = setpoint_spacing(SETUP, real) or 0.0
    most = max(1e-3 * SETUP.config.real.poll_period_ms, real.period) + longer * spacing
    assert len(ends) > 30 and most - 0.5 * spacing < max(ends) <= most + 1e-9


@pytest.mark.parametrize(
    ("wanted_ms", "robot_ms", "spacing_ms"),
    [
        *((8.0, 4, 8.0), (8.0, 8, 8.0), (8.0, 10, 10.0), (8.0, 16, 8.0)),
        # Six or twelve are too far away, and a clock's ticks are no rhythm.
        *((8.0, 12, 8.0), (8.0, 2, 8.0), (10.0, 8, 8.0), (16.0, 8, 16.0)),
    ],
)
def test_set_points_come_in_the_rhythm_of_the_robot_if_it_is_near(
    wanted_ms: float, robot_ms: int, spacing_ms: float
) -> None:
    """In its period, twice or half of that; else as far apart as is wanted."""
    setup = Setup(ROBOT, changed(SETUP.config, stream__period_ms=wanted_ms))
    pair = idle_pair()
    rhythm = Rhythm()
    for at_ms in np.random.default_rng(1).uniform(5.0, 13.0, 400).cumsum():
        rhythm = heard(rhythm, int(at_ms // robot_ms) * robot_ms, 100.0 + 1e-3 * float(at_ms))
    real = replace(pair.state.sides.real, rhythm=rhythm)
    assert 1e3 * (setpoint_spacing(setup, real) or 0.0) == pytest.approx(spacing_ms)


def test_a_robot_is_told_ahead_what_its_filters_take_away() -> None:
    """Later by its delay, and by its filters' variance times the acceleration; joint by joint."""
    speed, bend = np.array((0.4, -0.3, 0.02, 0.1)), np.array((2.0, -1.0, 0.1, 0.5))

    def course(k: int, t: float) -> AxisMotion:
        return HOME[k] + speed[k] * t + 0.5 * bend[k] * t * t, speed[k] + bend[k] * t, bend[k]

    delay, smoothing = (0.10, 0.05, 0.08, 0.0), (1e-3, 4e-4, 0.0, 2e-4)
    follows = RealFollows(delay=delay, smoothing=smoothing)
    told = target_of(SETUP, follows, course, 0.2)
    expected = [
        course(k, 0.2 + d)[0] - s * bend[k] for k, (d, s) in enumerate(zip(delay, smoothing))
    ]
    assert told == pytest.approx(expected, abs=1e-12)


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
