"""Zones, Cartesian speed and people.

Judged on the whole way, by closed forms, and acted on by the pair.
"""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from harness.pair import HOME, ROBOT, SETUP, Pair, ramp, shifted
from harness.watch import Watch
from hypothesis import given
from hypothesis import strategies as st
from scara_config import ConfigError, KeepOut
from scara_control.keep_out.points import all_positions, positions, watched_points
from scara_control.keep_out.zones import entered, judge_way
from twin_controller.core.actions import Command, Send
from twin_controller.core.events import PersonSeen
from twin_controller.core.lead.modes import Mode
from twin_controller.core.safety.fastest import fastest_point, speed_cap
from twin_controller.core.safety.separation import (
    allowed_speed,
    judge_separation,
    protective_distance,
)
from twin_controller.core.safety.sightings import Person
from twin_controller.core.safety.stopping import braking_way
from twin_controller.core.setup import Setup

replace = msgspec.structs.replace
POINTS = SETUP.points
SEPARATION = replace(SETUP.config.separation, enabled=True, sensors=("",))
L1, L2, H = 0.35, 0.30, 0.16
Q = st.tuples(
    st.floats(-2.5, 2.5), st.floats(-2.6, 2.6), st.floats(-0.21, 0.0), st.floats(-3.0, 3.0)
)
ZONE = KeepOut("box", (400.0, -50.0, -100.0), (500.0, 50.0, 400.0))


@given(q=Q)
def test_the_watched_points_are_where_plane_geometry_puts_them(q: tuple[float, ...]) -> None:
    """Tool: L1 c1 + L2 c12, L1 s1 + L2 s12, h + q3. Elbow: L1 c1, L1 s1, at its height.

    Those of a link: on its straight line.
    """
    tool, elbow = (positions(point, np.array([q]))[0] for point in POINTS[:2])
    a, b = q[0], q[0] + q[1]
    assert tool == pytest.approx(
        [L1 * math.cos(a) + L2 * math.cos(b), L1 * math.sin(a) + L2 * math.sin(b), H + q[2]]
    )
    assert elbow[:2] == pytest.approx([L1 * math.cos(a), L1 * math.sin(a)])
    for point in POINTS[2:]:
        link, place = point.name.split(" at ")
        along = float(place.removesuffix(" mm")) * 1e-3
        begin, direction = (np.zeros(2), a) if link == "arm" else (elbow[:2], b)
        on_link = begin + along * np.array([math.cos(direction), math.sin(direction)])
        assert positions(point, np.array([q]))[0] == pytest.approx([*on_link, elbow[2]])
    assert all_positions(POINTS, np.array([q, HOME]))[:, 0] == pytest.approx(
        np.array([positions(point, np.array([q]))[0] for point in POINTS])
    )


def test_a_point_on_a_joint_that_moves_no_tool_is_refused() -> None:
    """The text names the point and the joints that carry points."""
    wrong = replace(
        ROBOT, watched_points=[replace(ROBOT.watched_points[0], carried_by="table_joint")]
    )
    with pytest.raises(
        ConfigError,
        match=r"watched_points.tool.carried_by = table_joint: Expected joint_1, joint_2, joint_3",
    ):
        watched_points(wrong)


@given(q=Q, qdot=st.tuples(*[st.floats(-5.0, 5.0)] * 2))
def test_point_speed_is_that_of_the_faster_point(
    q: tuple[float, ...], qdot: tuple[float, float]
) -> None:
    """By the planar Jacobian."""
    w1, w2 = qdot[0], qdot[0] + qdot[1]
    a, b = q[0], q[0] + q[1]
    tool = math.hypot(
        -L1 * math.sin(a) * w1 - L2 * math.sin(b) * w2,
        L1 * math.cos(a) * w1 + L2 * math.cos(b) * w2,
    )
    expected = max(tool, abs(L1 * w1))
    assert fastest_point(POINTS, q, (*qdot, 0.0, 0.0))[0] == pytest.approx(
        expected, rel=1e-4, abs=1e-6
    )


@pytest.mark.parametrize(
    ("path", "found"),
    [
        ([(0.3, 0.0, 0.0), (0.39, 0.0, 0.0)], False),
        ([(0.3, 0.0, 0.0), (0.45, 0.0, 0.0), (0.6, 0.0, 0.0)], True),
        ([(0.45, 0.0, 0.0), (0.6, 0.0, 0.0)], False),
        ([(0.45, 0.0, 0.0), (0.46, 0.0, 0.0)], False),
        ([(0.45, 0.0, 0.0), (0.6, 0.0, 0.0), (0.45, 0.0, 0.0)], True),
        ([(0.45, 0.06, 0.5), (0.45, 0.06, 0.0)], False),
        ([(0.45, 0.0, 0.5), (0.45, 0.06, 0.0)], True),
        ([(0.3, 0.0, 0.0), (0.6, 0.0, 0.0)], True),
        ([(0.3, 0.0, 0.0), (0.45, 0.15, 0.0), (0.6, 0.0, 0.0)], False),
        ([(0.3, 0.0, 0.0), (0.4, 0.0, 0.0)], True),
    ],
)
def test_a_zone_may_be_left_but_not_entered(
    path: list[tuple[float, float, float]], found: bool
) -> None:
    """Its faces belong to it; who is inside may move inside and out, not in again."""
    text = entered("tool", np.array(path), [ZONE])
    assert bool(text) is found
    if found:
        assert text.startswith("the tool would enter keep-out zone box at (")


def test_a_way_between_two_free_ends_is_judged_in_between() -> None:
    """From one side of the zone to the other, both ends free."""
    start, end = (0.6, 0.0, -0.1, 0.0), (-0.6, 0.0, -0.1, 0.0)
    in_front = KeepOut("post", (600.0, -30.0, -1000.0), (700.0, 30.0, 1000.0))
    assert not judge_way(POINTS, [in_front], start, start, SETUP.velocity).violation
    assert "post" in judge_way(POINTS, [in_front], start, end, SETUP.velocity).violation
    assert not judge_way(POINTS, [], start, end, SETUP.velocity).violation


@pytest.mark.parametrize(
    ("end", "expected"),
    [
        ((1.0, 0.0, -0.16, 0.0), 0.65 * math.radians(440.0)),
        ((0.0, 1.0, -0.16, 0.0), 0.30 * math.radians(700.0)),
        ((0.0, 0.0, -0.06, 0.0), 2.0),
        ((0.0, 0.0, -0.16, 1.0), 0.0),
        (HOME, 0.0),
    ],
)
def test_peak_speed_of_a_move_of_one_joint(end: tuple[float, ...], expected: float) -> None:
    """Radius times the joint's largest speed; the table moves no point of the arm."""
    assert judge_way(POINTS, [], HOME, end, SETUP.velocity).peak_speed == pytest.approx(
        expected, rel=1e-3, abs=1e-9
    )


@pytest.mark.parametrize(
    ("peak", "limit", "cap"),
    [(2.5, 250.0, 10.0), (0.2, 250.0, 100.0), (0.0, 250.0, 100.0), (9.0, None, 100.0)],
)
def test_the_speed_cap_makes_the_peak_the_limit(
    peak: float, limit: float | None, cap: float
) -> None:
    """250 mm/s of 2.5 m/s is 10 %."""
    assert speed_cap(peak, limit) == pytest.approx(cap)


@given(v=st.floats(-10.0, 10.0), a=st.floats(0.1, 100.0), delay=st.floats(0.0, 0.2))
def test_the_braking_way_is_the_integral_of_the_speed(v: float, a: float, delay: float) -> None:
    """Constant speed for the delay, then a constant deceleration to zero.

    By the area under the speed.
    """
    stop = braking_way((1.0,), (v,), (a,), delay)[0]
    assert stop - 1.0 == pytest.approx(v * delay + 0.5 * v * (abs(v) / a))
    assert (stop - 1.0) * v >= 0.0


@given(speed=st.floats(0.0, 5.0), age=st.floats(0.0, 0.3))
def test_allowed_speed_is_the_inverse_of_the_protective_distance(speed: float, age: float) -> None:
    """There and back, whenever the person was seen."""
    assert allowed_speed(
        protective_distance(speed, SEPARATION, age), SEPARATION, age
    ) == pytest.approx(speed, abs=1e-9)


def test_the_protective_distance_is_the_sum_of_its_terms() -> None:
    """ISO/TS 15066: the sum of five terms, by hand for 1 m/s.

    Person, robot until it reacts, robot while it stops, intrusion and uncertainties.
    """
    expected = 1.6 * (0.1 + 0.1) + 1.0 * 0.1 + 1.0 / 20.0 + 0.2 + 0.1 + 0.01
    assert protective_distance(1.0, SEPARATION) == pytest.approx(expected)
    assert protective_distance(1.0, SEPARATION, 0.25) == pytest.approx(expected + 1.6 * 0.25), (
        "since the sighting people walk on"
    )
    assert allowed_speed(0.3, SEPARATION) == 0.0


@pytest.mark.parametrize(("age", "too_close"), [(0.0, False), (0.1, False), (0.2, True)])
def test_between_two_sightings_the_person_may_come_nearer(age: float, too_close: bool) -> None:
    """0.47 m at rest and 1.6 m/s since the sighting: 0.7 m are enough for 0.14 s."""
    found, fresh = judged(0.7, age=age), judged(0.7)
    assert found.too_close is too_close  # type: ignore[attr-defined]
    assert found.protective == pytest.approx(0.47 + 1.6 * age)  # type: ignore[attr-defined]
    assert found.cap <= fresh.cap  # type: ignore[attr-defined]


def judged(distance: float, speed: float = 0.0, age: float = 0.0, enabled: bool = True) -> object:
    """Judge a person beside the tool at home."""
    person = Person(10.0 - age, (0.65 + distance, 0.0, 0.0))
    return judge_separation(
        POINTS, [person], HOME, speed, 10.0, replace(SEPARATION, enabled=enabled), SETUP.fastest
    )


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
    found = judged(distance, speed, age)
    assert found.too_close is too_close  # type: ignore[attr-defined]
    assert found.reason  # type: ignore[attr-defined]


def test_the_cap_falls_with_the_distance_and_is_off_when_disabled() -> None:
    """Monotonic from 0 to 100 %; without monitoring nobody is too close."""
    caps = [judged(0.3 + 0.1 * k).cap for k in range(80)]  # type: ignore[attr-defined]
    assert caps[0] == 0.0 and caps[-1] == 100.0 and caps == sorted(caps)
    off = judged(0.0, enabled=False)
    assert (off.too_close, off.cap, off.distance) == (False, 100.0, math.inf)  # type: ignore[attr-defined]
    silent = judge_separation(POINTS, [], HOME, 0.0, 10.0, SEPARATION, SETUP.fastest)
    assert silent.too_close and "silent" in silent.reason


@pytest.mark.parametrize("age", [0.31, None])
def test_a_silent_sensor_is_a_person_at_the_robot(age: float | None) -> None:
    """Nobody seen is not the same as nobody there: 0 m away, and no speed is slow enough."""
    people = [] if age is None else [Person(10.0 - age, (5.0, 0.0, 0.0))]
    found = judge_separation(POINTS, people, HOME, 0.0, 10.0, SEPARATION, SETUP.fastest)
    assert (found.distance, found.cap, found.too_close) == (0.0, 0.0, True)


# The pair.

WATCHED = Setup(ROBOT, replace(SETUP.config, separation=SEPARATION))


class Bystander:
    """A person whom a sensor sees every 50 ms."""

    def __init__(self, pair: Pair) -> None:
        """Stand far away."""
        self.pair, self.x = pair, 6.0

    def run(self, duration: float) -> None:
        """Let time pass while the sensor works."""
        for _ in range(round(duration / 0.05)):
            self.pair.feed(PersonSeen(self.pair.now, (self.x, 0.0, 0.0)))
            self.pair.run(0.05)


@pytest.fixture
def watched() -> tuple[Pair, Bystander]:
    """Return a connected pair with a person far away, and that person."""
    pair = Pair(setup=WATCHED)
    person = Bystander(pair)
    pair.link("real", True)
    pair.link("twin", True)
    person.run(2.5)
    assert pair.state.lead.mode is Mode.IDLE
    return pair, person


@pytest.mark.parametrize("leader", ["real", "twin"])
def test_a_person_stops_the_pair_and_resume_goes_on_when_gone(
    watched: tuple[Pair, Bystander], leader: str
) -> None:
    """Protective stop of both.

    RESUME is refused while the person is near, a release on a side does not go round it.
    """
    pair, person = watched
    away = shifted(HOME, 40.0)
    if leader == "real":
        pair.start_program(ramp(HOME, away, 4.0))
    else:
        pair.move_twin(ramp(HOME, away, 4.0))
    person.run(1.0)
    assert pair.state.lead.leader == leader
    person.x = 0.9
    person.run(0.5)
    assert pair.state.lead.mode is Mode.PAUSED and pair.paused
    here = pair.real_q
    refused = pair.operate("RESUME")
    assert not refused.success
    person.run(0.5)
    assert pair.real_q == here
    person.x = 6.0
    person.run(0.3)
    assert pair.state.lead.mode is Mode.PAUSED, "nothing goes on by itself"
    assert pair.operate("RESUME").success
    person.run(0.5)
    assert pair.state.lead.leader == leader and pair.state.lead.mode is not Mode.PAUSED
    assert pair.real_q != here


def test_a_release_on_the_robots_side_does_not_go_round_a_person(
    watched: tuple[Pair, Bystander],
) -> None:
    """Both are stopped instead."""
    pair, person = watched
    pair.start_program(ramp(HOME, shifted(HOME, 40.0), 4.0))
    person.run(1.0)
    person.x = 0.9
    person.run(0.5)
    pair.paused = False
    person.run(0.3)
    assert pair.state.lead.mode is Mode.STOPPED and not pair.own_program


def test_no_move_of_the_operator_begins_beside_a_person(watched: tuple[Pair, Bystander]) -> None:
    """Refused with the distance."""
    pair, person = watched
    person.x = 0.9
    person.run(0.3)
    reply = pair.operate("MOVE_JOINTS", target=shifted(HOME, 10.0))
    assert not reply.success and "a person is 250 mm away" in reply.message


def test_the_twin_does_not_align_beside_a_person(watched: tuple[Pair, Bystander]) -> None:
    """Refused with the distance, instead of begun and stopped."""
    pair, person = watched
    assert pair.operate("STOP").success
    person.x = 0.9
    person.run(0.3)
    reply = pair.operate("ALIGN")
    assert not reply.success and "a person is" in reply.message


def test_a_sensor_that_falls_silent_stops_the_pair(watched: tuple[Pair, Bystander]) -> None:
    """Not seen is not absent."""
    pair, _ = watched
    pair.start_program(ramp(HOME, shifted(HOME, 40.0), 4.0))
    pair.run(0.6)
    assert pair.state.lead.mode is Mode.PAUSED
    assert "silent" in pair.state.lead.why


def test_a_robot_that_heads_for_a_zone_is_stopped_before_it() -> None:
    """Its braking way is judged at each sample; both stop, and the tool has not entered."""
    pair = Pair()
    Watch(pair)
    pair.connect()
    pair.start_program(ramp(HOME, shifted(HOME, 0.0, 0.0, -45.0), 2.0))
    pair.run(2.2)
    assert (
        pair.state.lead.mode is Mode.STOPPED and "keep-out zone below_table" in pair.state.lead.why
    )
    lowest = SETUP.keep_out[0].upper_mm[2] * 1e-3
    assert positions(POINTS[0], np.array([pair.real_q]))[0][2] > lowest


def test_a_move_of_the_operator_through_a_zone_is_refused() -> None:
    """Before anything moves."""
    pair = Pair()
    pair.connect()
    before = len(pair.actions)
    reply = pair.operate("MOVE_JOINTS", target=shifted(HOME, 0.0, 0.0, -45.0))
    assert not reply.success and "would enter keep-out zone below_table" in reply.message
    assert Command.START_STREAM not in {
        a.command for a in pair.actions[before:] if isinstance(a, Send)
    }
