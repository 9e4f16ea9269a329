"""A prediction is paired with what the joints did, by the same measures on both sides."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from harness.yaml_files import CONFIG
from what_if.cell_files_io import find_program
from what_if.config import LearningConfig
from what_if.geometry.bodies import FloatArray
from what_if.judging import judge
from what_if.learning.course import PERIOD_S, course_of, predict, tool_points
from what_if.learning.drift import Drift
from what_if.learning.measures import moving_time, way_length
from what_if.learning.pairing import BEGIN_S, REST_S, End, MotionWatch, Outcome, Prediction
from what_if.motions import JointTarget, Motion
from what_if.timing.planning import plan
from what_if.world import World

FREE = JointTarget((0.4, -0.3, -0.1, 0.2), 50.0)
LIMITS = LearningConfig(motions=3, time_percent=5.0, way_percent=5.0, effort_percent=50.0)
RNG = np.random.default_rng(4)
NOISE_RAD = 1.7e-4
"""0.01 deg rms: the noisiest encoders of the plants."""


def motion_of(world: World, name: str) -> Motion:
    """Return a move, or a program by its name."""
    return find_program(world.cell, name, CONFIG) if name else FREE


def prediction(world: World, motion: Motion) -> Prediction:
    """Return what is said of a motion, with efforts that a test can know."""
    found = predict(world, motion, judge(world, motion), "test")
    assert found is not None
    return replace(found, effort=(0.4, 0.2, 0.1, 0.0))


def played(
    world: World, watch: MotionWatch, times: FloatArray, q: FloatArray, until: float
) -> Outcome | None:
    """Play a course 0.3 s after the start, then stand until ``until``; return the outcome."""
    for now in np.arange(0.0, until, 0.01):
        row = np.array([np.interp(now - 0.3, times, column) for column in q.T])
        watch.joints(float(now), (row + RNG.normal(0.0, NOISE_RAD, row.shape)).tolist())
        watch.effort((-0.5, 0.1, 0.0, 0.0))
        end = watch.end(float(now))
        if end is not None:
            return watch.outcome(end, tool_points(world.cell, watch.rows))
    return None


def test_motion_lasts_from_where_it_leaves_a_place_to_where_it_is_near_the_other() -> None:
    """By the share of the way between two rows, at both ends alike."""
    q = np.array([[0.0], [0.0], [0.01], [0.09], [0.1], [0.1]])
    assert moving_time(np.arange(6.0), q, q[-1]) == pytest.approx(3.8 - 1.2)


@pytest.mark.parametrize("name", ["", "ARTICLE", "TWO_POINT"])
def test_motion_made_as_predicted_has_ratios_of_one(world: World, name: str) -> None:
    """With the noise of an encoder; ARTICLE stands at its end in the middle, and goes on."""
    motion = motion_of(world, name)
    said = prediction(world, motion)
    times, q = course_of(world, motion)
    outcome = played(world, MotionWatch("", 0.0, said), times, q, times[-1] + 5.0)
    assert outcome is not None and outcome.end is End.REACHED
    assert outcome.ratios["time"] == pytest.approx(1.0, abs=0.02)
    assert outcome.ratios["way"] == pytest.approx(1.0, abs=0.02)
    assert outcome.ratios["effort"] == pytest.approx(1.25)


def test_a_course_is_told_in_steps_of_the_period_at_most(world: World) -> None:
    """From its beginning to its end, and in no more steps than that takes."""
    times, q = course_of(world, FREE)
    assert times[0] == 0.0 and len(times) == len(q)
    assert times[-1] / len(times) < np.diff(times).max() <= PERIOD_S + 1e-12
    assert np.diff(times).min() > PERIOD_S * (1.0 - 2.0 / len(times))


def test_slower_motion_has_its_ratio(world: World) -> None:
    """What takes a fifth longer is told so."""
    said = prediction(world, FREE)
    times, q = course_of(world, FREE)
    outcome = played(world, MotionWatch("", 0.0, said), 1.2 * times, q, 20.0)
    assert outcome is not None and outcome.ratios["time"] == pytest.approx(1.2, abs=0.03)


def test_motion_that_is_stopped_teaches_nothing(world: World) -> None:
    """Half-way is no target."""
    said = prediction(world, FREE)
    times, q = course_of(world, FREE)
    half = len(q) // 2
    outcome = played(world, MotionWatch("", 0.0, said), times[:half], q[:half], 20.0)
    assert outcome is not None and outcome.end is End.STOPPED
    assert outcome.ratios == {}
    drift = Drift(LIMITS)
    drift.take(outcome)
    assert drift.medians == {} and drift.alarms == ()


def test_motion_that_never_begins_is_given_up(world: World) -> None:
    """Somebody let it through, and something else stopped it before it began."""
    watch = MotionWatch("", 10.0, prediction(world, FREE))
    watch.joints(10.1, world.q)
    assert watch.end(15.1) is None and not watch.has_begun
    assert not watch.is_hopeless(15.0)
    assert watch.is_hopeless(15.1)


def test_motion_that_goes_on_for_ever_is_given_up(world: World) -> None:
    """A robot that is led to and fro by somebody else stands nowhere long enough."""
    said = prediction(world, FREE)
    watch = MotionWatch("", 0.0, said)
    longest = BEGIN_S + 3.0 * (said.moving_s + said.stand_s)
    for now in np.arange(0.0, longest + 1.0, 0.2):
        watch.joints(float(now), (float(now), *world.q[1:]))
        assert watch.end(float(now)) is None
        assert watch.is_hopeless(float(now)) == (now > longest)


def test_motion_whose_beginning_was_not_heard_is_given_up(world: World) -> None:
    """The rest of it, made as predicted, would be a short way in a short time."""
    said = prediction(world, FREE)
    times, q = course_of(world, FREE)
    late = len(q) // 2
    watch = MotionWatch("", 0.0, said)
    assert played(world, watch, times[: len(q) - late], q[late:], times[-1] + 5.0) is None
    assert watch.is_unheard and watch.is_hopeless(0.0)


@pytest.mark.parametrize(("stroke", "most"), [(0.5, 0.05), (3.0, 0.3), (0.0, 0.002)])
def test_a_motion_is_heard_if_a_tenth_of_its_way_is_missing_at_most(
    world: World, stroke: float, most: float
) -> None:
    """Either way, of the joint that is off most; before it is predicted nobody knows."""
    said = replace(prediction(world, FREE), stroke=stroke)
    for off in (0.99 * most, -0.99 * most, 1.01 * most, -1.01 * most):
        watch = MotionWatch("", 0.0)
        watch.joints(0.0, (*world.q[:2], world.q[2] + off, world.q[3] + 0.001))
        assert not watch.is_unheard
        watch.predicted = said
        assert watch.is_unheard == (abs(off) > most)
    assert not MotionWatch("", 0.0, said).is_unheard


@pytest.mark.parametrize("name", ["", "TWO_POINT"])
def test_the_stroke_is_the_way_of_the_joint_that_goes_farthest(world: World, name: str) -> None:
    """There and back counts twice; a single move is as long as its longest joint's."""
    motion = motion_of(world, name)
    _, q = course_of(world, motion)
    ends = [world.q, *(leg.course.q[-1] for leg in plan(world, motion).legs if leg.course)]
    least = sum(np.abs(np.subtract(b, a)).max() for a, b in itertools.pairwise(ends))
    found = prediction(world, motion)
    assert found.start == pytest.approx(world.q) and found.target == pytest.approx(q[-1])
    assert least * (1.0 - 1e-6) <= found.stroke <= 1.02 * least


def test_program_is_watched_once() -> None:
    """The page's question comes first, the twin controller's when the robot says that it runs."""
    assert MotionWatch("ARTICLE", 0.0).is_same("ARTICLE")
    assert not MotionWatch("ARTICLE", 0.0).is_same("TWO_POINT")
    assert not MotionWatch("", 0.0).is_same("")


def test_stand_at_the_end_is_waited_for(world: World) -> None:
    """As long as the longest stand of the prediction, and a rest more."""
    said = prediction(world, FREE)
    watch = MotionWatch("", 0.0, replace(said, stand_s=2.0))
    watch.joints(0.0, world.q)
    watch.joints(1.0, said.target)
    assert watch.end(1.0 + 2.0 + REST_S) is None
    assert watch.end(1.01 + 2.0 + REST_S) is End.REACHED


def outcome_of(time: float = 1.0, way: float = 1.0, effort: float = 1.0) -> Outcome:
    """Return an outcome with chosen ratios."""
    said = Prediction("test", (0.5,), (0.0,), 0.5, 2.0, 0.5, (0.4,), 0.0)
    return Outcome(said, End.REACHED, 2.0 * time, 0.5 * way, (0.4 * effort,))


@pytest.mark.parametrize(
    ("end", "time", "way"),
    [(End.STOPPED, 2.0, 0.5), (End.REACHED, 0.0, 0.5), (End.REACHED, 2.0, 0.0)],
)
def test_what_was_not_reached_or_moves_no_tool_teaches_nothing(
    end: End, time: float, way: float
) -> None:
    """A turn of the table takes time, but its way is no length to compare another to."""
    said = Prediction("test", (0.5,), (0.0,), 0.5, time, way, (0.4,), 0.0)
    assert Outcome(said, end, 2.0, 0.5, (0.4,)).ratios == {}


@pytest.mark.parametrize(
    ("last", "said"),
    [
        ([outcome_of(time=1.08)] * 3, "moving time of the last 3 motions is +8.0 % off"),
        ([outcome_of(way=0.9)] * 3, "way of the tool of the last 3 motions is -10.0 % off"),
        ([outcome_of(effort=1.6)] * 3, "largest effort of the last 3 motions is +60.0 % off"),
        ([outcome_of(time=1.08)] * 2, ""),
        ([outcome_of(time=1.08)] * 3 + [outcome_of()] * 2, ""),
        ([outcome_of(time=0.96), outcome_of(time=1.04), outcome_of(effort=1.4)], ""),
        ([outcome_of(time=2.75), outcome_of(), outcome_of(time=1.01)], ""),
    ],
)
def test_median_outside_its_limit_is_an_alarm_with_advice(last: list[Outcome], said: str) -> None:
    """One odd motion is none, however odd, and what went well again ends it."""
    drift = Drift(LIMITS)
    for outcome in last:
        drift.take(outcome)
    assert "; ".join(drift.alarms).startswith(said) and bool(drift.alarms) == bool(said)


def test_way_of_a_robot_at_rest_has_no_length() -> None:
    """Noise adds nothing, however long it lasts."""
    points = np.array([0.65, 0.0, 0.0]) + RNG.normal(0.0, 1e-4, (10000, 3))
    assert way_length(points) == 0.0
    straight = np.linspace([0.0, 0.0, 0.0], [0.3, 0.4, 0.0], 2000)
    assert way_length(straight) == pytest.approx(0.5, abs=2e-3)


@pytest.mark.parametrize(
    ("said", "measured"),
    [((), (0.4,)), ((0.0, 0.0), (0.4, 0.0)), ((0.4,), ()), ((0.4, 0.1), (0.0, 0.0))],
)
def test_an_effort_that_one_side_does_not_know_is_not_compared(
    said: tuple[float, ...], measured: tuple[float, ...]
) -> None:
    """Time and way are; nothing is divided by nothing."""
    whole = outcome_of()
    known = replace(whole, predicted=replace(whole.predicted, effort=said), effort=measured)
    assert set(known.ratios) == {"time", "way"}


@pytest.mark.parametrize("name", ["ARTICLE", "PALLETISE"])
def test_the_course_is_at_the_end_of_each_leg_where_the_leg_leads(world: World, name: str) -> None:
    """Each leg begins when the ones before have ended, and keeps its own pace."""
    motion = motion_of(world, name)
    times, q = course_of(world, motion)
    moves = [leg for leg in plan(world, motion).legs if leg.course is not None]
    assert len(moves) > 1
    for leg in moves:
        half = 0.5 * float(leg.course.times[-1])
        for at in (half, leg.duration):
            found = [np.interp(leg.begin + at, times, column) for column in q.T]
            there = [np.interp(at, leg.course.times, column) for column in leg.course.q.T]
            assert found == pytest.approx(there, abs=2e-3)
