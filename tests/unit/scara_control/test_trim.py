"""The end of move_to: from a few millimetres to the tolerance, also where the arm is straight."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scara_config import load_robot
from scara_control.config import load_motion
from scara_control.motion.trim import Requests, tool_error, trim_step
from scara_control.scara import Elbow, Scara, solve
from scara_control.scara_velocity import tool_velocity

CONFIG = load_motion()
SCARA = Scara.from_robot(load_robot())
POINTS = {"P1": (0.65, 0.0, 0.0), "P2": (0.51, 0.16, 0.10), "P3": (0.51, -0.16, 0.16)}
OFFSET = st.tuples(*[st.floats(-0.002, 0.002)] * 3)
DT = CONFIG.period


@settings(max_examples=40, deadline=None)
@pytest.mark.parametrize("point", POINTS.values(), ids=POINTS)
@given(OFFSET)
def test_a_small_rest_is_driven_out_in_time(point, offset):
    """From 2 mrad and 2 mm beside each of the article's points, P1 being singular."""
    target = solve(SCARA, *point, Elbow.RIGHTY).q
    q = np.array(target) + np.array(offset) - (0.0, 0.0, 0.002)
    for _ in range(int(CONFIG.trim.timeout / DT)):
        step = trim_step(SCARA, tuple(q), target, point, CONFIG)
        if step.qdot == (0.0, 0.0, 0.0):
            break
        q = q + np.array(step.qdot) * DT
    assert step.error <= CONFIG.trim.tolerance_mm * 1e-3 and step.error == pytest.approx(tool_error(SCARA, tuple(q), point))


@settings(max_examples=60, deadline=None)
@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-0.2, 0.0), OFFSET)
def test_a_trim_is_slow(q1, q2, q3, offset):
    """Neither the tool nor a joint is faster than allowed, wherever the arm is."""
    q = (q1, q2, q3)
    target = tuple(a + 10.0 * b for a, b in zip(q, offset))
    point = tuple(p + 10.0 * d for p, d in zip(solve_point(q), offset))
    step = trim_step(SCARA, q, target, point, CONFIG)
    assert math.hypot(*tool_velocity(SCARA, q, step.qdot)) <= CONFIG.trim.speed_mm_s * 1e-3
    for joint, velocity in zip(SCARA.joints, step.qdot):
        assert abs(velocity) <= joint.velocity * CONFIG.jog.speed_percent / 100.0


def solve_point(q):
    """Return where the tool is."""
    from scara_control.scara import tool_position

    return tool_position(SCARA, *q)


def test_within_the_tolerance_nothing_moves():
    """There is an end to it."""
    target = solve(SCARA, *POINTS["P2"]).q
    near = (target[0], target[1], target[2] + 0.9e-3 * CONFIG.trim.tolerance_mm)
    assert trim_step(SCARA, near, target, POINTS["P2"], CONFIG).qdot == (0.0, 0.0, 0.0)


def test_the_error_is_the_distance_of_the_tool():
    """3, 4 and 12 make 13."""
    assert tool_error(SCARA, (0.0, 0.0, -0.16), (0.653, 0.004, 0.012)) == pytest.approx(0.013)


def test_a_newer_request_cancels_the_older_and_stop_cancels_all():
    """The first reason stays."""
    requests = Requests()
    first = requests.begin()
    assert requests.oldest == first and requests.why_cancelled(first) == ""
    second = requests.begin()
    requests.cancel("cancelled by STOP: door")
    assert requests.why_cancelled(first) == "replaced by a newer request"
    assert requests.why_cancelled(second) == "cancelled by STOP: door"
    assert requests.oldest == first
    requests.end(first)
    assert requests.oldest == second
    requests.end(second)
    assert requests.oldest is None
    third = requests.begin()
    assert requests.why_cancelled(third) == ""
