"""Streamed set points: each refusal has its text, and a broken stream leaves a known motion."""

from __future__ import annotations

import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scara_config import load_robot
from scara_control.config import load_motion
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.motion.commands import MotionRefusedError
from scara_control.motion.following.stream import FollowSession, StreamGate

JOINTS = load_robot().twin_joints
NAMES = tuple(joint.name for joint in JOINTS)
CONFIG = load_motion().follow
HERE = (0.1, 0.2, -0.1, 0.0)
NOW = 100.0
MEASURED = JointMotion.measured(HERE, (0.0,) * 4, NOW)


def point(q=HERE, qdot=(0.0,) * 4, qddot=(0.0,) * 4):
    """Make one point."""
    return JointMotion(tuple(q), tuple(qdot), tuple(qddot))


def packet(*points, times=None, names=NAMES):
    """Make a packet, by default of one point, now."""
    points = points or (point(),)
    times = times or [NOW + 0.01 * k for k in range(len(points))]
    return Setpoints.due(names, times, points)


def session(first=None, now=NOW):
    """Begin a session."""
    return FollowSession(JOINTS, first or packet(), CONFIG, MEASURED, now)


@pytest.mark.parametrize(
    ("bad", "text"),
    [
        (
            packet(names=("joint_1", "joint_2", "joint_3", "wrist")),
            "unknown joint 'wrist': the twin has joint_1, joint_2",
        ),
        (packet(names=("joint_1",) * 4), "joint names are missing or occur twice"),
        (packet(names=()), "joint names are missing or occur twice"),
        (Setpoints(NAMES, ()), "no points"),
        (packet(point(q=HERE[:3])), "point 0: 3 positions for 4 joints"),
        (packet(point(qdot=())), "point 0: 0 velocities for 4 joints"),
        (packet(point(qddot=(0.0,) * 5)), "point 0: 5 accelerations for 4 joints"),
        (packet(point(q=(math.nan, 0.2, -0.1, 0.0))), "point 0: positions are not all finite"),
        (packet(point(qdot=(0.0, math.inf, 0.0, 0.0))), "point 0: velocities are not all finite"),
        (
            packet(point(), point(qddot=(0.0, 0.0, 0.0, math.nan))),
            "point 1: accelerations are not all finite",
        ),
        (
            packet(point(q=(0.1, 2.71, -0.1, 0.0))),
            r"joint_2 = 2\.71 rad is outside \[-2\.618, 2\.618\]",
        ),
        (packet(point(q=(0.1, 0.2, 0.01, 0.0))), r"joint_3 = 0\.01 m is outside \[-0\.21, 0\]"),
        (packet(point(qdot=(0.0, 0.0, 3.1, 0.0))), r"joint_3 = 3\.1 m/s is outside \[-3, 3\]"),
        (packet(times=[math.nan]), "times are not all finite"),
        (packet(point(), point(), times=[NOW, NOW]), "times do not increase"),
        (packet(times=[NOW - 0.101]), "stale: the last point is 101 ms old, allowed 100"),
        (packet(times=[NOW + 0.6]), "stamp is 600 ms in the future, allowed 500"),
        (packet(point(), point(), times=[NOW, NOW + 2.1]), r"points span 2\.10 s, allowed 2"),
        (
            packet(point(), point(q=(0.4, 0.2, -0.1, 0.0))),
            "jump between points 0 and 1: joint_1 by 17.19 deg in 10 ms, allowed 7.10",
        ),
        (
            packet(point(q=(0.16, 0.2, -0.1, 0.0))),
            "align first: joint_1 is 3.44 deg from the first set point, allowed 3",
        ),
        (
            packet(point(q=(0.1, 0.2, -0.106, 0.0))),
            "align first: joint_3 is 6.00 mm from the first set point, allowed 5",
        ),
    ],
)
def test_a_stream_does_not_begin_with_a_wrong_packet(bad, text):
    """What, where, how much, and what is allowed."""
    with pytest.raises(MotionRefusedError, match=text):
        session(bad)


@pytest.mark.parametrize(
    ("age", "text"),
    [
        (0.8, r"stale: the last point is 800 ms old, allowed 700$"),
        (-0.8, r"stamp is 800 ms in the future, allowed 700\b"),
    ],
)
def test_a_stream_of_another_time_is_refused_with_the_times_that_are_configured(age, text):
    """In whole milliseconds."""
    config = msgspec.structs.replace(CONFIG, timeout=0.7, ahead=0.7)
    with pytest.raises(MotionRefusedError, match=text):
        FollowSession(JOINTS, packet(times=[NOW - age]), config, MEASURED, NOW)


@pytest.mark.parametrize(
    ("bad", "text"),
    [
        (packet(times=[NOW]), r"stamp is not newer than the one before \(0\.0 ms\)"),
        (packet(times=[NOW - 0.02]), r"stamp is not newer than the one before \(-20\.0 ms\)"),
        (
            packet(
                point(q=HERE[:1], qdot=(0.0,), qddot=(0.0,)), names=("joint_1",), times=[NOW + 0.01]
            ),
            "other joints than before: joint_1 after joint_1, joint_2",
        ),
        (
            packet(point(q=(0.1, 0.2, -0.14, 0.0)), times=[NOW + 0.01]),
            "jump since the last packet: joint_3 by -40.00 mm in 10 ms",
        ),
    ],
)
def test_a_stream_does_not_go_on_with_a_wrong_packet(bad, text):
    """A refused packet changes nothing: the next good one is taken."""
    stream = session()
    with pytest.raises(MotionRefusedError, match=text):
        stream.take(bad, NOW + 0.01)
    stream.take(packet(times=[NOW + 0.02]), NOW + 0.02)


@pytest.mark.parametrize(
    "good",
    [
        packet(),
        packet(point(), point(q=(0.101, 0.2, -0.1, 0.0))),
        packet(times=[NOW - 0.09]),
        packet(point(q=(0.12, 0.19, -0.103, 0.03))),
        packet(point(q=(-0.1,), qdot=(0.0,), qddot=(0.0,)), names=("joint_3",)),
        packet(
            point(q=(0.1 - 0.07, 0.2, -0.1, 0.0), qdot=(7.0, 0.0, 0.0, 0.0)), times=[NOW - 0.01]
        ),
    ],
)
def test_a_good_packet_begins_a_stream(good):
    """Several points, late, a little off, few joints, moving: the extrapolated point counts."""
    assert session(good).names == good.names


def test_a_robot_that_reads_a_little_beyond_its_limit_is_followed():
    """P3 is at the top of the stroke: noise there is no error."""
    there = msgspec.structs.replace(MEASURED, q=(0.1, 0.2, 0.0, 0.0))
    FollowSession(JOINTS, packet(point(q=(0.1, 0.2, 0.0003, 0.0))), CONFIG, there, NOW)


@given(st.floats(-0.04, 0.05), st.floats(-2.0, 2.0), st.floats(-20.0, 20.0))
def test_the_motion_around_the_last_packet_is_its_extrapolation(later, v, a):
    """Before and after its time: so a stop begins where the simulator's joints are."""
    stream = session(packet(point(qdot=(v, 0.0, 0.0, 0.0), qddot=(a, 0.0, 0.0, 0.0))))
    motion = stream.motion(NOW + later)
    assert motion.q[0] == pytest.approx(HERE[0] + v * later + 0.5 * a * later**2)
    assert motion.qdot[0] == pytest.approx(v + a * later)
    assert motion.q[1:] == pytest.approx(HERE[1:])


def test_a_joint_that_is_not_streamed_rests_where_it_was():
    """A stream of one joint says nothing about the others."""
    stream = session(packet(point(q=(0.2,), qdot=(1.0,), qddot=(0.0,)), names=("joint_2",)))
    motion = stream.motion(NOW + 0.01)
    assert motion.q == pytest.approx((0.1, 0.21, -0.1, 0.0)) and motion.qdot == (0.0, 1.0, 0.0, 0.0)


def test_a_stream_times_out_by_arrival_not_by_stamp():
    """Stamps may be early or late, silence is silence."""
    stream = session(packet(times=[NOW + 0.4]))
    assert not stream.timed_out(NOW + 0.099) and stream.timed_out(NOW + 0.101)


def test_a_barred_stream_is_heard_again_only_after_a_pause():
    """A late packet after a STOP does not restart motion, however long the stream goes on."""
    gate = StreamGate("packets", 0.1)
    gate.check(0.0)
    gate.bar(0.05)
    for k in range(6, 60):
        with pytest.raises(
            MotionRefusedError, match="stopped: packets are ignored until they pause for 100 ms"
        ):
            gate.check(k * 0.01)
    gate.check(0.8)
    gate.check(0.81)


def test_a_stop_without_a_stream_bars_nothing():
    """The next stream may begin at once."""
    gate = StreamGate("packets", 0.1)
    gate.check(0.0)
    gate.bar(0.2)
    gate.check(0.21)
