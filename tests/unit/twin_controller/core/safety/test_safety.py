"""Speeds and braking ways by closed forms, and what people near the robot may not begin."""

from __future__ import annotations

import math

import msgspec
import pytest
from harness.pair import HOME, ROBOT, SETUP, Pair, idle_pair, ramp, seen_pair, shifted
from hypothesis import given
from hypothesis import strategies as st
from scara_config import KeepOut
from twin_controller.core.events import Joints, TwinMotion
from twin_controller.core.lead.modes import Mode
from twin_controller.core.safety.fastest import fastest_point, speed_cap
from twin_controller.core.safety.stopping import braking_way
from twin_controller.core.setup import Setup

replace = msgspec.structs.replace
POINTS = SETUP.speed_points
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
    """By the area under the speed: constant for the delay, then falling to zero."""
    stop = braking_way((1.0,), (v,), (a,), delay)[0]
    assert stop - 1.0 == pytest.approx(v * delay + 0.5 * v * (abs(v) / a))
    assert (stop - 1.0) * v >= 0.0


FAR, NEAR = 6.0, 0.9


@pytest.fixture
def pair() -> Pair:
    """Return a pair, IDLE at home, with a person far away whom a sensor sees."""
    return seen_pair(FAR)


def test_a_release_on_the_robots_side_does_not_go_round_a_person(pair: Pair) -> None:
    """Both are stopped instead."""
    pair.start_program(ramp(HOME, shifted(HOME, 40.0), 4.0))
    pair.see(FAR, 1.0)
    pair.see(NEAR, 0.5)
    pair.paused = False
    pair.see(NEAR, 0.3)
    assert pair.mode is Mode.STOPPED and not pair.own_program


def test_nothing_of_the_operator_begins_beside_a_person(pair: Pair) -> None:
    """A move and an alignment are refused with the distance, instead of begun and stopped."""
    pair.see(NEAR, 0.3)
    reply = pair.operate("MOVE_JOINTS", target=shifted(HOME, 10.0))
    assert not reply.success and "a person is 228 mm away" in reply.message
    pair.do("STOP")
    pair.see(NEAR, 0.3)
    reply = pair.operate("ALIGN")
    assert not reply.success and "a person is" in reply.message


WALL = KeepOut("wall", (-200.0, 500.0, -200.0), (200.0, 900.0, 600.0))


def announced(target: Joints, *places: Joints) -> Pair:
    """Return a pair beside the wall whose twin announces a way three times."""
    pair = idle_pair()
    pair.setup = Setup(msgspec.structs.replace(ROBOT, keep_out=(WALL,)), SETUP.config)
    way = (HOME, *places, target)
    for _ in range(3):
        pair.feed(
            TwinMotion(
                pair.now, "announcing", 100.0, 100.0, 100.0, 0, False, "", target=target, way=way
            )
        )
        pair.now = round(pair.now + 0.02, 6)
    return pair


@pytest.mark.parametrize("places", [(), (shifted(HOME, 60.0),)], ids=["straight", "by a place"])
def test_a_way_into_a_zone_is_stopped_once(places: tuple[Joints, ...]) -> None:
    """However often a twin that goes on tells of it."""
    assert announced(shifted(HOME, 120.0), *places).triggers().count("KEEP_OUT") == 1


@pytest.mark.parametrize(("places", "stops"), [((), 0), ((20.0,), 0), ((20.0, 90.0, 30.0), 1)])
def test_a_way_is_judged_by_its_places_and_not_by_its_end(
    places: tuple[float, ...], stops: int
) -> None:
    """A target beside the wall may be reached round about through it."""
    pair = announced(shifted(HOME, 10.0), *(shifted(HOME, place) for place in places))
    assert pair.triggers().count("KEEP_OUT") == stops
