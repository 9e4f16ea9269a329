"""Streams through joint_pose_controller: forwarded, ended, refused."""

from __future__ import annotations

import msgspec
import pytest
from harness.opponents.ideal_twin import CONFIG, DT, HOME, MODES, NAMES, ROBOT, Bench, smooth
from scara_control.joint_motion import JointMotion, Setpoints
from scara_control.motion.commands import Command, MotionRefusedError
from scara_control.motion.pose_control import PoseController


def test_a_stream_is_forwarded_as_it_is_and_its_end_is_a_smooth_stop():
    """At once, with its own stamps; after the time-out a ramp from where the joints are by now."""
    bench = Bench()
    for k in range(30):
        bench.tick()
        sent = bench.stream((0.04 * k, 0.0, -0.16, 0.0), (4.0 if k else 0.0, 0.0, 0.0, 0.0))
    assert sent.times == (bench.now,)
    assert sent.points[0].q[0] == pytest.approx(1.16)
    assert not bench.packets
    assert bench.report.state == "following" and not bench.report.standing_still
    bench.tick(10)
    assert bench.report.state == "following"
    bench.tick(2)
    assert bench.report.state == "stopping"
    assert bench.report.message == "follow: no packet for 100 ms"
    bench.until("idle")
    assert smooth(bench.setpoints) and 1.36 < bench.q[0] < 1.6 and not bench.outcomes


def test_a_stream_that_breaks_off_is_said_with_the_time_that_was_waited():
    """In milliseconds, as it was chosen."""
    replace, bench = msgspec.structs.replace, Bench()
    config = replace(CONFIG, follow=replace(CONFIG.follow, timeout=2.0))
    bench.core = PoseController(ROBOT, config, bench.now)
    bench.modes(MODES)
    bench.tick()
    bench.stream(HOME)
    bench.until("idle")
    assert bench.report.message == "follow: no packet for 2000 ms"


def test_a_stream_of_a_robot_at_rest_stands_still():
    """Following is not moving."""
    bench = Bench()
    bench.stream(HOME)
    assert bench.report.state == "following" and bench.report.standing_still


def test_following_refuses_moves_and_moving_refuses_streams():
    """One source at a time; the refused packets are counted."""
    bench = Bench()
    bench.stream(HOME)
    with pytest.raises(
        MotionRefusedError,
        match="following a stream: it ends by STOP, or when no packet comes any more",
    ):
        bench.move()
    bench.command(Command.STOP)
    bench.until("idle")
    bench.tick(20)
    bench.move()
    for k in (1, 2):
        bench.tick()
        with pytest.raises(MotionRefusedError, match="a move is running: STOP it first"):
            bench.stream(HOME)
        assert bench.report.message == f"follow: refused {k}: a move is running: STOP it first"


def test_stop_while_following_is_not_undone_by_the_rest_of_the_stream():
    """The stream is heard again only after it has paused; the stop's reason stays until then."""
    bench = Bench()
    for k in range(20):
        bench.tick()
        bench.stream((0.02 * k, 0.0, -0.16, 0.0), (2.0 if k else 0.0, 0.0, 0.0, 0.0))
    bench.command(Command.STOP, "enough")
    assert bench.report.state == "stopping" and bench.report.message == "aborted by STOP: enough"
    for k in range(20, 60):
        bench.tick()
        with pytest.raises(
            MotionRefusedError, match="stopped: packets are ignored until they pause"
        ):
            bench.stream((0.02 * k, 0.0, -0.16, 0.0), (2.0, 0.0, 0.0, 0.0))
        assert bench.report.message == "aborted by STOP: enough"
    assert bench.report.state == "idle" and smooth(bench.setpoints)
    bench.tick(15)
    bench.stream(bench.q)
    assert bench.report.state == "following"


@pytest.mark.parametrize("points", [1, 14])
@pytest.mark.parametrize("end", [Command.STOP, Command.ESTOP, None])
def test_a_stop_behind_a_standstill_does_not_pull_a_stream_back(points: int, end: Command | None):
    """The twin went on by the last packet and stands there: no ramp begins where it was before."""
    bench = Bench()
    for k in range(20):
        bench.tick()
        ahead = [(bench.now + j * DT, 0.02 * (k + j)) for j in range(points)]
        still, speed = (0.0,) * 4, (2.0, 0.0, 0.0, 0.0)
        due = [JointMotion((q, 0.0, -0.16, 0.0), speed, still, time) for time, q in ahead]
        bench.core.follow(Setpoints(NAMES, tuple(due)), bench.now)
        bench.q = due[0].q
    session = bench.core._stream.session
    assert session is not None
    bench.now += 0.4
    rest = session.motion(bench.now).q
    bench.command(end, "test") if end else bench.core.end_follow(bench.now)
    bench.tick(50)
    assert all(setpoint.q == pytest.approx(rest) for setpoint in bench.setpoints)
    assert bench.report.standing_still and bench.report.setpoint == pytest.approx(rest)


@pytest.mark.parametrize(
    ("state", "why"),
    [
        ("estopped", "aborted by ESTOP: the red button"),
        ("stopping", "follow: no packet for 100 ms"),
    ],
)
def test_a_late_packet_does_not_hide_why_the_stream_was_ended(state: str, why: str):
    """Who streams reads the reason there, perhaps before the stop itself."""
    bench = Bench()
    for k in range(30):
        bench.tick()
        bench.stream((0.04 * k, 0.0, -0.16, 0.0), (4.0 if k else 0.0, 0.0, 0.0, 0.0))
    if state == "estopped":
        bench.command(Command.ESTOP, "the red button")
        bench.tick(30)
    else:
        bench.tick(12)
    with pytest.raises(MotionRefusedError, match=r"emergency stop is latched|still stopping"):
        bench.stream(bench.q)
    assert (bench.report.state, bench.report.message) == (state, why)


def test_a_stream_far_from_the_joints_is_refused_with_align_first():
    """And the running state is what it was."""
    bench = Bench()
    with pytest.raises(MotionRefusedError, match=r"align first: joint_1 is 28\.65 deg"):
        bench.stream((0.5, 0.0, -0.16, 0.0))
    assert bench.report.state == "idle"
    assert bench.report.message.startswith("follow: refused 1: align first")


def test_pause_while_following_is_left_to_the_source():
    """The stream decides; its ramp down is followed."""
    bench = Bench()
    bench.stream(HOME)
    bench.command(Command.PAUSE)
    bench.tick()
    assert bench.report.state == "following" and "pause its source" in bench.report.message


def test_a_stream_after_the_end_of_a_plan_replaces_the_settling_move():
    """Whoever waits for the joints to arrive is told."""
    bench = Bench()
    bench.move((0.0, 0.0, -0.16, 0.0))
    bench.obey = lambda packet: None
    bench.q = (0.001, *HOME[1:])
    bench.tick(20)
    bench.stream(HOME)
    assert [outcome.message for outcome in bench.outcomes] == ["aborted: replaced by a stream"]


def test_a_joint_taken_from_a_stream_ends_it():
    """As in a move."""
    bench = Bench()
    bench.stream((0.0,), (0.0,), names=("joint_1",))
    bench.modes(MODES | {"joint_1": "position"})
    bench.tick()
    assert bench.report.state == "idle"
    assert "joint_1 was taken by its position controller" in bench.report.message
