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
from scara_control.keep_out.points import positions
from twin_controller.core.actions import Command, Send
from twin_controller.core.events import PersonSeen
from twin_controller.core.lead.modes import Mode
from twin_controller.core.safety.fastest import fastest_point, speed_cap
from twin_controller.core.safety.stopping import braking_way
from twin_controller.core.setup import Setup

replace = msgspec.structs.replace
POINTS = SETUP.points
SEPARATION = replace(SETUP.config.separation, enabled=True, sensors=("",))
L1, L2 = 0.35, 0.30
Q = st.tuples(
    st.floats(-2.5, 2.5), st.floats(-2.6, 2.6), st.floats(-0.21, 0.0), st.floats(-3.0, 3.0)
)


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
