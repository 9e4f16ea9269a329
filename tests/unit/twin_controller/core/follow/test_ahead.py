"""Numbers and times of the set points that a robot takes ahead of their time."""

from __future__ import annotations

from itertools import count, pairwise
from random import Random

import msgspec
import numpy as np
import pytest
from harness.pair import HOME, SETUP, idle_pair, ramp, shifted
from twin_controller.core.actions import StreamAhead
from twin_controller.core.events import AnyEvent, RealMeasured
from twin_controller.core.follow.ahead import arrives_within, reaches_ahead
from twin_controller.core.lead.modes import Mode

LONGEST_S, SHORTEST_S, UNPLANNED = 0.03, 0.005, 0.5
replace = msgspec.structs.replace

AWAY = shifted(HOME, 20.0, -30.0, 40.0, 10.0)
SLOW_S, QUICK_S = 0.02, 0.0005
"""Round trips: a set point is reckoned to arrive within 30 or within 5 ms."""
JITTER_S = 3e-4
"""The estimate of the robot's clock moves by so much from one reading to the next."""


def test_no_number_gets_another_time(monkeypatch: pytest.MonkeyPatch) -> None:
    """However round trips and the robot's clock change.

    The robot would lose the set points in between, or take one at the time of the other while it
    has heard but half of the change.
    """
    pair = idle_pair(places=10)
    feed, number, rng = pair.feed, count(), Random(1)
    clock = pair.state.sides.real.clock

    def late(event: AnyEvent) -> None:
        if isinstance(event, RealMeasured):
            trip = SLOW_S if next(number) % 3 == 0 else QUICK_S
            event = replace(event, sent=event.received - trip)
            sides = pair.state.sides
            shift = rng.uniform(-JITTER_S, JITTER_S)
            near = replace(clock, lower=clock.lower + shift, upper=clock.upper + shift)
            real = replace(sides.real, clock=replace(near, at=sides.real.clock.at))
            pair.state = replace(pair.state, sides=replace(sides, real=real))
        feed(event)

    monkeypatch.setattr(pair, "feed", late)
    pair.move_twin(ramp(HOME, AWAY, 2.0))
    period, given, seen = SETUP.config.stream.ahead_period_ms, dict[int, int](), len(pair.actions)
    newest = 0
    for _ in range(1500):
        pair.run(0.001)
        for action in pair.actions[seen:]:
            if isinstance(action, StreamAhead):
                assert action.points or action.newest != newest, "what says nothing is not sent"
                newest = action.newest
            for point in action.points if isinstance(action, StreamAhead) else ():
                old = given.get(point.number, point.clock_ms)
                assert old == point.clock_ms, (point, old)
                before = given.get(point.number - 1)
                if before is not None:
                    assert point.clock_ms - before == period, (point, before)
                given[point.number] = point.clock_ms
        seen = len(pair.actions)
    assert len(given) > 50 and pair.mode == Mode.TWIN_LEADS


def test_without_a_plan_set_points_reach_until_the_next_answer_and_half_a_spacing_more() -> None:
    """Those further ahead would be guesses; fewer would leave the robot without one."""
    pair, ends = idle_pair(places=10), list[float]()
    stream, answers_s = SETUP.config.stream, 1e-3 * SETUP.config.real.poll_period_ms
    spacing_s = 1e-3 * stream.ahead_period_ms
    pair.jog_twin(ramp(HOME, AWAY, 4.0), pair.now)
    pair.until(Mode.TWIN_LEADS)
    since = len(pair.actions)
    for _ in range(800):
        pair.run(0.001)
        follows, real = pair.state.follow.real, pair.state.sides.real
        if follows is not None and pair.made(StreamAhead, since):
            since = len(pair.actions)
            ends.append(follows.told[-1].t - pair.now - arrives_within(real))
    # The robot's clock is read in steps of 2 ms.
    most = answers_s + UNPLANNED * spacing_s
    assert len(ends) > 30 and most - 0.0021 < max(ends) <= most + 1e-9


@pytest.mark.parametrize(
    ("round_trip", "within"), [(0.0, SHORTEST_S), (0.004, 0.012), (1.0, LONGEST_S)]
)
def test_a_set_point_is_under_way_for_some_round_trips(round_trip: float, within: float) -> None:
    """One that comes too soon would still be changed, and one for too late is a guess."""
    real = idle_pair().state.sides.real
    late = replace(real, clock=replace(real.clock, round_trip=round_trip))
    assert arrives_within(late) == pytest.approx(within)


@pytest.mark.parametrize(("places", "spacings"), [(0, 0), (1, 0), (2, 1), (10, 9)])
def test_a_robot_is_told_as_far_ahead_as_its_places_but_one_reach(
    places: int, spacings: int
) -> None:
    """It may still have to take the one that counted last."""
    pair = idle_pair(places=places)
    reach = 1e-3 * SETUP.config.stream.ahead_period_ms * spacings
    assert reaches_ahead(SETUP, pair.state.sides.real) == pytest.approx(reach)


def test_the_first_number_is_the_one_behind_what_the_robot_has_taken() -> None:
    """It would take any other for one that it has missed, or that is far ahead."""
    pair = idle_pair(places=10)
    pair.ring_read = 7
    pair.run(0.1)
    pair.move_twin(ramp(HOME, AWAY, 2.0), run=0.5)
    first = pair.made(StreamAhead)[0].points[0]
    assert first.number == 8


def test_one_that_is_held_back_counts_until_the_robot_has_it() -> None:
    """Those behind it may be free again: its reason stays.

    Nothing is measured while the robot has one that is held back, whatever waits behind it. Those
    that are held back need a little less than the robot's program speed: one that needed a rounding
    more would take it one interpolation period longer, and it would stay late.
    """
    pair = idle_pair(places=10)
    pair.move_twin(ramp(HOME, AWAY, 0.1))
    held, seen, fastest = 0, set[bool](), 0.0
    for _ in range(300):
        pair.run(0.001)
        follows = pair.state.follow.real
        if follows is None or not follows.told:
            continue
        back = [told.q != told.asked for told in follows.told]
        assert bool(follows.slowed) == any(back), follows
        assert follows.held == back[0], follows
        for before, after in pairwise(follows.told):
            steps = np.abs(np.subtract(after.q, before.q)) / np.array(SETUP.velocity)
            fastest = max(fastest, steps.max() / (1e-3 * (after.clock_ms - before.clock_ms)))
        held += any(back) and not back[-1]
        seen.add(any(back))
    assert held and seen == {True, False}
    program = 1e-2 * SETUP.config.limit.told_percent
    assert 0.99 * program < fastest < 0.997 * program


def test_a_number_is_told_a_few_times_and_not_with_each_reading() -> None:
    """Of a plan that goes on as announced: only what is learnt of the robot's answers moves it."""
    pair = idle_pair(places=10)
    pair.move_twin(ramp(HOME, AWAY, 2.0), run=0.5)
    since = len(pair.actions)
    pair.run(1.0)
    told = [point.number for action in pair.made(StreamAhead, since) for point in action.points]
    assert len(set(told)) > 50 and len(told) < 4 * len(set(told))
