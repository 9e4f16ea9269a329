"""The end of move_to: from a few millimetres to the tolerance, also where the arm is straight."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from harness.running.thorough import examples
from harness.workspace import ROOT
from hypothesis import given, settings
from hypothesis import strategies as st
from scara_config import load_robot
from scara_control.config import load_motion
from scara_control.kinematics.scara import Elbow, Scara, solve, tool_position
from scara_control.kinematics.scara_velocity import tool_velocity
from scara_control.kinematics.tool import ScaraTool, tool_kinematics
from scara_control.motion.commands import MotionRefusedError
from scara_control.motion.trim import Requests, Trim, Trimming, tool_error, yaw_error

CONFIG = load_motion()
SCARA = Scara.from_robot(load_robot())
TOOL = ScaraTool(SCARA)
POINTS = {"P1": (0.65, 0.0, 0.0), "P2": (0.51, 0.16, 0.10), "P3": (0.51, -0.16, 0.16)}
OFFSET = st.tuples(*[st.floats(-0.002, 0.002)] * 3)
DT = CONFIG.period


class StickyTwin:
    """Joints whose velocity loop lags by 17 ms.

    Answers some periods late and does not break loose below 0.05 %.
    """

    def __init__(self, q, delay, friction_percent=0.05):
        self.q, self.qdot = np.array(q), np.zeros(3)
        self._stuck = np.array(
            [joint.velocity * friction_percent / 100.0 for joint in SCARA.joints]
        )
        self._queue = [np.zeros(3)] * delay

    def move(self, qdot):
        """Go on by a period."""
        self._queue.append(np.array(qdot))
        wanted = self._queue.pop(0)
        held = wanted == 0.0
        wanted = np.sign(wanted) * np.maximum(np.abs(wanted) - self._stuck, 0.0)
        self.qdot = np.where(
            held, 0.0, self.qdot + (wanted - self.qdot) * (1.0 - math.exp(-DT / 0.017))
        )
        self.q = self.q + self.qdot * DT


@settings(max_examples=examples(10, 40), deadline=None)
@pytest.mark.parametrize("delay", [1, 3, 6])
@pytest.mark.parametrize("point", POINTS.values(), ids=POINTS)
@given(OFFSET)
def test_a_small_rest_is_driven_out_in_time_against_friction(point, delay, offset):
    """From 2 mrad and 2 mm beside each of the article's points, also P1, which is singular."""
    target = solve(SCARA, *point, Elbow.RIGHTY).q
    twin = StickyTwin(np.array(target) + np.array(offset) - (0.0, 0.0, 0.002), delay)
    trim = Trim(TOOL, target, point, CONFIG)
    inside = 0
    for _ in range(int(CONFIG.trim.timeout / DT)):
        step = trim.step(tuple(twin.q), tuple(twin.qdot), DT)
        inside = inside + 1 if step.qdot == (0.0, 0.0, 0.0) else 0
        if inside * DT >= CONFIG.trim.settled:
            break
        twin.move(step.qdot)
    assert step.error <= CONFIG.trim.tolerance_mm * 1e-3
    assert step.error == tool_error(TOOL, tuple(twin.q), point)


@settings(max_examples=60, deadline=None)
@given(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0), st.floats(-0.2, 0.0), OFFSET)
def test_a_trim_is_slow(q1, q2, q3, offset):
    """As fast as breaks joints loose apart, no joint and no tool faster than is allowed."""
    q = (q1, q2, q3)
    target = tuple(a + 10.0 * b for a, b in zip(q, offset))
    point = tuple(p + 10.0 * d for p, d in zip(tool_position(SCARA, *q), offset))
    step = Trim(TOOL, target, point, CONFIG).step(q, (0.0, 0.0, 0.0), 0.0)
    assert math.hypot(*tool_velocity(SCARA, q, step.qdot)) <= CONFIG.trim.speed_mm_s * 1e-3 * (
        1.0 + 1e-9
    )
    for joint, velocity in zip(SCARA.joints, step.qdot):
        assert abs(velocity) <= joint.velocity * CONFIG.jog.speed_percent / 100.0


def test_a_rest_that_is_too_large_is_refused_with_its_distance():
    """In millimetres, to the micrometre."""
    target = solve(SCARA, *POINTS["P2"]).q
    trimming = Trimming(TOOL, target, CONFIG)
    trimming.begin(0.0)
    with pytest.raises(MotionRefusedError, match=r"^the tool stays 7\.500 mm from the point, "):
        trimming.step((*target[:2], target[2] + 7.5e-3), (0.0, 0.0, 0.0), DT)


def test_what_is_added_against_friction_is_bounded_and_gone_when_the_direction_turns():
    """A joint that is stuck for ever is not hammered; overshoot is not fed, and eases the gain."""
    point = POINTS["P2"]
    target = solve(SCARA, *point, Elbow.RIGHTY).q
    below, above = ((target[0], target[1], target[2] + off) for off in (-1e-4, 1e-4))
    trim = Trim(TOOL, target, point, CONFIG)
    speeds = [trim.step(below, (0.0, 0.0, 0.0), DT).qdot[2] for _ in range(2000)]
    most = SCARA.joints[2].velocity * CONFIG.trim.breakaway_percent / 100.0
    assert speeds == sorted(speeds) and speeds[-1] == pytest.approx(CONFIG.trim.gain * 1e-4 + most)
    fresh = Trim(TOOL, target, point, CONFIG).step(above, (0.0, 0.0, 0.0), DT).qdot[2]
    assert fresh < 0.0
    assert trim.step(above, (0.0, 0.0, 0.0), DT).qdot[2] == pytest.approx(0.7 * fresh)


def test_a_rest_of_the_yaw_is_driven_out_with_that_of_the_place():
    """The wrist turns the tool, and the arm keeps it on its point; the nearer way round."""
    tool = tool_kinematics(load_robot(ROOT / "config" / "robots" / "scara_4axis"))
    target = tool.inverse(0.43, 0.14, 0.1, None, (0.0, 1.0, -0.05, 0.0), 3.1).chosen.q
    q = np.array(target) + (0.002, -0.003, 0.001, 0.02)
    trim = Trim(tool, target, (0.43, 0.14, 0.1), CONFIG)
    first = trim.step(tuple(q), (0.0,) * 4, DT)
    assert first.yaw_error == pytest.approx(-0.019) and first.qdot[3] < 0.0
    for _ in range(400):
        step = trim.step(tuple(q), (0.0,) * 4, 0.0)
        q = q + np.array(step.qdot) * DT
    assert not any(step.qdot)
    assert abs(step.yaw_error) <= math.radians(CONFIG.trim.tolerance_deg)
    assert step.error <= CONFIG.trim.tolerance_mm * 1e-3
    turned = (*target[:3], target[3] - 0.02)
    assert Trim(tool, target, tool.position(target), CONFIG).step(
        turned, (0.0,) * 4, 0.0
    ).qdot == pytest.approx((0.0, 0.0, 0.0, CONFIG.trim.gain * 0.02))
    assert yaw_error(tool, (*target[:3], target[3] + 6.0), target) == pytest.approx(math.tau - 6.0)
    assert yaw_error(TOOL, (1.0, 1.0, 0.0), (0.0, 1.0, 0.0)) == 0.0


@pytest.mark.parametrize("percent", [5.0, 10.0])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_no_joint_of_a_trim_is_faster_than_a_jog(percent, side):
    """Where the arm is straight the joints may turn much and the tool hardly moves."""
    jog = msgspec.structs.replace(CONFIG.jog, speed_percent=percent)
    one, two = (joint.velocity * percent / 100.0 for joint in SCARA.joints[:2])
    # The elbow goes to one side, the shoulder to the other: 0.65 m and 0.30 m to the tool.
    target = (-side * 0.30 / 0.65 * 0.3, side * 0.3, 0.0)
    trim = Trim(TOOL, target, TOOL.position(target), msgspec.structs.replace(CONFIG, jog=jog))
    qdot = trim.step((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0).qdot
    assert qdot[1] == pytest.approx(side * two)
    assert abs(qdot[0]) < one


def test_within_the_tolerance_nothing_moves():
    """There is an end to it."""
    target = solve(SCARA, *POINTS["P2"]).q
    near = (target[0], target[1], target[2] + 0.9e-3 * CONFIG.trim.tolerance_mm)
    assert Trim(TOOL, target, POINTS["P2"], CONFIG).step(near, (0.0, 0.0, 0.0), DT).qdot == (
        0.0,
        0.0,
        0.0,
    )


def test_the_error_is_the_distance_of_the_tool():
    """3, 4 and 12 make 13."""
    assert tool_error(TOOL, (0.0, 0.0, -0.16), (0.653, 0.004, 0.012)) == pytest.approx(0.013)


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


def test_a_tool_that_is_there_when_its_trim_begins_stays_for_as_long():
    """It may only pass the point; nothing that came before the trim counts."""
    target = solve(SCARA, *POINTS["P2"]).q
    trimming, still, begun = Trimming(TOOL, target, CONFIG), (0.0, 0.0, 0.0), 7.0
    trimming.begin(begun)
    assert not trimming.settled
    for part in (0.1, 0.5, 0.9, 1.1):
        assert trimming.step(target, still, begun + part * CONFIG.trim.settled) is None
        assert trimming.settled == (part > 1.0)


@pytest.mark.parametrize("pauses", [False, True])
def test_a_tool_has_settled_once_it_has_stayed_for_long_enough(pauses):
    """Counted from when it last had to move, or was let go on after a pause."""
    target = solve(SCARA, *POINTS["P2"]).q
    trimming, still = Trimming(TOOL, target, CONFIG), (0.0, 0.0, 0.0)
    trimming.begin(0.0)
    assert trimming.step((*target[:2], target[2] + 1e-3), still, DT)
    times = [k * DT for k in range(2, round(CONFIG.trim.settled / DT) + 3)]
    if pauses:
        for now in times[:-3]:
            trimming.step(target, still, now)
        trimming.hold(times[-3])
        times = [times[-3] + now - DT for now in times]
    for now in times[:-2]:
        trimming.step(target, still, now)
        assert not trimming.settled
    for now in times[-2:]:
        trimming.step(target, still, now)
    assert trimming.settled
