"""The separation distance as a function: what its speed cap keeps, and which sensor counts."""

from __future__ import annotations

import math
from itertools import permutations

import numpy as np
import pytest
from harness.pair import HOME, SETUP
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace
from scara_control.keep_out.points import all_positions
from twin_controller.core.safety.separation import (
    Distance,
    allowed_speed,
    judge_separation,
    protective_distance,
)
from twin_controller.core.safety.sightings import Sighting

TERMS = replace(SETUP.config.separation, enabled=True, sensors=())
STALE_S = TERMS.stale_ms * 1e-3
NOW = 100.0
TOOL = all_positions(SETUP.points, np.array([HOME]))[:, 0]
"""Where the watched points are, shape (p, 3)."""


def person(away: float, age: float = 0.0, sensor: str = "") -> Sighting:
    """Return somebody ``away`` [m] from the outermost skin, straight away from the robot."""
    halves = np.array([point.half for point in SETUP.points])
    outermost = np.argmax(TOOL[:, 0] + halves[:, 0])
    x, y, z = TOOL[outermost].tolist()
    return Sighting(NOW - age, (x + halves[outermost, 0] + away, y, z), sensor)


def judge(*people: Sighting, speed: float = 0.0, margin_mm: float = TERMS.margin_mm) -> Distance:
    """Judge people by the shipped terms, and another margin."""
    terms = replace(TERMS, margin_mm=margin_mm)
    return judge_separation(SETUP.points, people, HOME, speed, NOW, terms, SETUP.fastest)


def bad(found: Distance) -> tuple[bool, float]:
    """Return by what a distance is worse than another."""
    return found.too_close, found.cap


@given(st.floats(0.0, 5.0), st.floats(0.0, 1.0))
def test_at_the_allowed_speed_the_protective_distance_is_the_distance(
    speed: float, age: float
) -> None:
    """One formula is the other's inverse, whatever the age."""
    assert allowed_speed(protective_distance(speed, TERMS, age), TERMS, age) == pytest.approx(
        speed, abs=1e-6
    )


@pytest.mark.parametrize("margin_mm", [1.0, 30.0, 200.0])
@pytest.mark.parametrize("away", [1.2, 1.6, 2.0])
def test_the_cap_keeps_the_margin_beyond_the_protective_distance(
    away: float, margin_mm: float
) -> None:
    """A person who comes nearer by less than the margin does not stop a robot at its cap."""
    found = judge(person(away), margin_mm=margin_mm)
    at_cap = found.cap * 1e-2 * SETUP.fastest
    assert 0.0 < found.cap < 100.0
    assert protective_distance(at_cap, TERMS) == pytest.approx(away - margin_mm * 1e-3)
    assert not judge(person(away - 0.99 * margin_mm * 1e-3), speed=at_cap).too_close


@pytest.mark.parametrize("age", [0.0, 0.5 * STALE_S])
def test_a_robot_at_rest_may_have_somebody_as_near_as_its_distance_at_rest(age: float) -> None:
    """Nearer, none may begin to move; noise in its speed is no motion."""
    kept, noise = protective_distance(0.0, TERMS, age), 0.99e-3 * TERMS.standstill_mm_s
    for speed in (0.0, noise):
        assert not judge(person(kept + 1e-3, age), speed=speed).too_close
        assert judge(person(kept - 1e-3, age), speed=speed).too_close
    faster = 1.01e-3 * TERMS.standstill_mm_s
    near = 0.5 * (kept + protective_distance(faster, TERMS, age))
    assert judge(person(near, age), speed=faster).too_close
    assert not judge(person(near, age), speed=noise).too_close


def test_a_sighting_of_a_clock_that_is_ahead_is_one_of_now() -> None:
    """The way that the person may go meanwhile is never taken for a way back."""
    kept = protective_distance(0.0, TERMS, 0.0)
    assert judge(person(kept - 1e-3, age=-0.5)).too_close
    assert judge(person(2.0, age=-0.5)) == judge(person(2.0))


def test_nobody_near_and_nobody_watched_for_slow_nothing_down() -> None:
    """The cap is all of the program's speed, never more, and no distance is asked for."""
    assert judge(person(50.0)).cap == 100.0
    off = replace(TERMS, enabled=False)
    assert judge_separation(SETUP.points, (), HOME, 1.0, NOW, off, SETUP.fastest) == Distance(
        math.inf, protective=0.0, cap=100.0, too_close=False, reason=""
    )


@pytest.mark.parametrize("sensor", ["", "left"])
def test_a_sensor_that_is_silent_or_was_never_heard_stops_everything(sensor: str) -> None:
    """As somebody at the robot would; the text names the sensor if it has a name."""
    for found in (judge(), judge(person(9.0, 1.01 * STALE_S, sensor))):
        assert (found.distance, found.protective, found.cap) == (0.0, 0.0, 0.0)
        assert found.too_close and found.silent
        assert "silent" in found.reason
    assert not judge(person(9.0, 0.99 * STALE_S, sensor)).too_close
    assert sensor in judge(person(9.0, 1.01 * STALE_S, sensor)).reason


def test_of_the_named_sensors_the_first_that_was_never_heard_is_named() -> None:
    """Whoever stands far away from the others; somebody looks after one sensor at a time."""
    terms = replace(TERMS, sensors=("left", "middle", "right"))
    people = [person(9.0, sensor="left")]
    found = judge_separation(SETUP.points, people, HOME, 0.0, NOW, terms, SETUP.fastest)
    assert found.too_close and "the sensor middle that" in found.reason


@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_of_several_sensors_the_worst_counts_whatever_their_order(speed: float) -> None:
    """One that is silent, or sees somebody near, or saw somebody long ago; never the mildest."""
    late, kept = 0.9 * STALE_S, protective_distance(0.0, TERMS)
    people = [
        person(6.0, sensor="far"),
        person(1.4, sensor="near"),
        person(1.7, late, "late"),
        person(protective_distance(0.0, TERMS, late) - 1e-3, late, "late and near"),
        person(kept + 0.5e-3 * TERMS.margin_mm, sensor="in the margin"),
        person(0.1, sensor="beside"),
        person(6.0, 2.0 * STALE_S, "silent"),
    ]
    alone = {each.sensor: judge(each, speed=speed) for each in people}
    for count in (1, 2, 3):
        for some in permutations(people, count):
            found = judge(*some, speed=speed)
            those = [alone[each.sensor] for each in some]
            assert found in those
            assert found.too_close == any(each.too_close for each in those)
            assert found.cap == min(each.cap for each in those)
            same = [each for each in those if bad(each) == bad(found)]
            assert found.distance == min(each.distance for each in same)


def test_the_protective_distance_is_the_sum_of_its_terms() -> None:
    """ISO/TS 15066: the five terms for 1 m/s, by hand, and their sum."""
    expected = 1.6 * (0.1 + 0.1) + 1.0 * 0.1 + 1.0 / 20.0 + 0.2 + 0.1 + 0.01
    assert protective_distance(1.0, TERMS) == pytest.approx(expected)
    assert protective_distance(1.0, TERMS, 0.25) == pytest.approx(expected + 1.6 * 0.25), (
        "since the sighting people walk on"
    )
    assert allowed_speed(0.3, TERMS) == 0.0


@pytest.mark.parametrize(("age", "too_close"), [(0.0, False), (0.1, False), (0.2, True)])
def test_between_two_sightings_the_person_may_come_nearer(age: float, too_close: bool) -> None:
    """0.47 m at rest and 1.6 m/s since the sighting: 0.7 m are enough for 0.14 s."""
    found, fresh = judge(person(0.7, age)), judge(person(0.7))
    assert found.too_close is too_close
    assert found.protective == pytest.approx(0.47 + 1.6 * age)
    assert found.cap <= fresh.cap


@pytest.mark.parametrize(
    ("distance", "speed", "age", "too_close"),
    [
        (2.0, 1.0, 0.0, False),
        (0.7, 1.0, 0.0, True),
        (0.7, 0.0, 0.0, False),
        (0.4, 0.0, 0.0, True),
        (2.0, 1.0, 0.31, True),
        (2.0, 1.0, 0.29, False),
    ],
)
def test_a_person_too_close_or_not_seen_any_more_stops(
    distance: float, speed: float, age: float, too_close: bool
) -> None:
    """Less than the protective distance at the present speed, or a sensor that is silent."""
    found = judge(person(distance, age), speed=speed)
    assert found.too_close is too_close
    kept = 1e3 * protective_distance(speed, TERMS, age)
    said = f"a person is {distance * 1e3:.0f} mm away, the protective distance is {kept:.0f} mm"
    assert found.reason == said or found.silent


def test_the_cap_falls_with_the_distance() -> None:
    """Monotonic from 0 to 100 %."""
    caps = [judge(person(0.3 + 0.1 * k)).cap for k in range(80)]
    assert caps[0] == 0.0 and caps[-1] == 100.0 and caps == sorted(caps)


def test_the_distance_is_that_of_the_arms_skin() -> None:
    """A person beside the middle of the second link, nearer to its skin than allowed at rest."""
    names = [point.name if any(point.half) else "" for point in SETUP.points]
    k = names.index("link_2")
    x, y, z = TOOL[k].tolist()
    away = protective_distance(0.0, TERMS) + 0.5 * SETUP.points[k].half[1]
    beside = Sighting(NOW, (x, y + away, z))
    assert judge(beside).too_close
    farther = Sighting(NOW, (x, y + away + SETUP.points[k].half[1], z))
    assert not judge(farther).too_close
