"""What the real robot is told: where the twin is going to be, and how far ahead."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from harness.pair import HOME, ROBOT, SETUP, Pair, idle_pair, ramp, shifted
from harness.parts import changed
from scara_control.joint_motion import AxisMotion
from twin_controller.core.actions import StreamReal
from twin_controller.core.follow.memory import RealFollows
from twin_controller.core.follow.real import setpoint_spacing, stream_real, target_of, twin_course
from twin_controller.core.lead.modes import Mode
from twin_controller.core.setup import Setup
from twin_controller.core.sides.side import TwinSide
from twin_controller.estimation.rhythm import Rhythm, heard

PLANNED, UNPLANNED = 2.0, 0.5
replace = msgspec.structs.replace


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
    ("leap", "why"), [(0.0, ""), (0.3, "joint_1 would step"), (-0.3, "joint_1")]
)
def test_a_plan_that_leaps_is_not_sent(pair: Pair, leap: float, why: str) -> None:
    """No motion of the twin makes such a step; what a plan says is no guess that may be off."""
    pair.move_twin(ramp(HOME, shifted(HOME, 20.0), 2.0), run=0.6)
    sides, follow = pair.state.sides, pair.state.follow
    plan = sides.twin.plan
    assert plan is not None
    points = [replace(each, q=(each.q[0] + leap, *each.q[1:])) for each in plan.setpoints.points]
    plan = replace(plan, setpoints=replace(plan.setpoints, points=tuple(points)))
    sides = changed(sides, twin__plan=plan)
    streamed = stream_real(SETUP, follow.real, sides, follow.response, 100.0, pair.now + 0.02)
    assert streamed.rejected.startswith(why) and bool(streamed.rejected) == bool(why)


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
