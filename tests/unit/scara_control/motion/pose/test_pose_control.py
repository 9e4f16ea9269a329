"""Moves of joint_pose_controller: announced, capped, paused, stopped, replaced, refused."""

from __future__ import annotations

import math

import numpy as np
import pytest
from harness.opponents.ideal_twin import CONFIG, DT, FAR, HOME, MODES, NAMES, ROBOT, Bench, smooth
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scara_control.errors import ScaraControlError
from scara_control.joint_motion import JointMotion
from scara_control.motion.commands import Command, MotionRefusedError
from scara_control.motion.pose_control import PoseController


def rests(setpoint, q):
    """Whether a set point, whenever it is due, is one at rest at ``q``."""
    return setpoint == JointMotion.measured(q, (0.0,) * len(q), setpoint.time)


def test_a_move_is_announced_then_driven_then_answered_then_silent():
    """As early as motion.yaml says, 0.13 s ahead; one packet at rest; then the outcome."""
    bench = Bench()
    assert bench.report.standing_still
    number = bench.move()
    assert bench.report.state == "announcing" and not bench.report.standing_still
    bench.tick(round(CONFIG.move.announce / DT))
    assert set(bench.states[1:-1]) == {"announcing"}
    assert all(rests(s, HOME) for s in bench.setpoints)
    assert bench.packets[0].points[-1].q != HOME, "announced before it begins"
    bench.tick()
    bench.until("idle")
    assert rests(bench.setpoints[-1], FAR) and bench.report.setpoint == FAR
    bench.tick(3)
    (outcome,) = bench.outcomes
    assert outcome.success and outcome.move_id == number and outcome.positions == FAR
    count = len(bench.packets)
    bench.tick(50)
    assert len(bench.packets) == count and bench.report.standing_still


def test_each_packet_looks_ahead_on_the_grid_and_keeps_its_promise():
    """Points are a period apart from now to the horizon, and what was promised is what comes."""
    bench = Bench()
    bench.move()
    bench.until("idle")
    promised = {}
    for packet in bench.packets:
        assert np.allclose(np.diff(packet.times), DT)
        assert packet.times[-1] - packet.times[0] <= CONFIG.move.horizon + 1e-9
        for time, point in zip(packet.times, packet.points):
            key = round(time / DT)
            assert point == promised.setdefault(key, point)
    assert len(bench.packets[0].points) == round(CONFIG.move.horizon / DT) + 1
    assert len(bench.packets[-1].points) == 1


def test_the_cap_stretches_running_and_coming_moves():
    """Requested and applied are reported apart, before, during and after a change of the cap."""
    bench = Bench()
    bench.core.limit_speed(80.0, bench.now)
    bench.move(percent=100.0)
    bench.tick(15)
    assert bench.report.speed_requested_percent == 100.0
    assert bench.report.speed_applied_percent == 80.0
    # Of the whole path: what it would reach, and whatever slows it down does not matter.
    peak = bench.report.peak_percent
    assert 0.0 < peak <= 100.0
    bench.core.limit_speed(40.0, bench.now)
    bench.tick(20)
    assert bench.report.speed_applied_percent == pytest.approx(40.0)
    assert bench.report.speed_limit_percent == 40.0
    assert bench.report.peak_percent == peak
    bench.until("idle")
    line = np.array(FAR) - np.array(HOME)
    q = np.array([s.q for s in bench.setpoints])
    assert np.allclose(
        q, np.array(HOME) + ((q[:, 0] - HOME[0]) / line[0])[:, None] * line, atol=1e-9
    )
    assert smooth(bench.setpoints)


def test_a_move_slower_than_the_cap_is_not_stretched():
    """The cap is a cap."""
    bench = Bench()
    bench.core.limit_speed(80.0, bench.now)
    bench.move(percent=30.0)
    bench.tick(15)
    assert bench.report.speed_applied_percent == 30.0


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 60), st.integers(1, 80))
def test_pause_and_resume_at_any_time_keep_path_and_smoothness(after, during):
    """The twin stands on its path and goes on along it; no velocity jumps."""
    bench = Bench()
    bench.move()
    bench.tick(after)
    bench.command(Command.PAUSE)
    bench.tick(during)
    bench.command(Command.RESUME)
    bench.until("idle")
    line = np.array(FAR) - np.array(HOME)
    q = np.array([s.q for s in bench.setpoints])
    assert np.allclose(
        q, np.array(HOME) + ((q[:, 0] - HOME[0]) / line[0])[:, None] * line, atol=1e-9
    )
    assert smooth(bench.setpoints) and rests(bench.setpoints[-1], FAR)
    bench.tick(2)
    assert [outcome.success for outcome in bench.outcomes] == [True]


def test_paused_stands_still_in_silence_and_refuses_a_new_move():
    """The target is kept; only RESUME or STOP lead on."""
    bench = Bench()
    bench.move(percent=50.0)
    bench.tick(20)
    bench.command(Command.PAUSE, "lunch")
    assert bench.report.state == "pausing"
    bench.until("paused")
    assert bench.report.standing_still
    assert bench.report.target == FAR
    assert bench.report.speed_applied_percent == 0.0
    count = len(bench.packets)
    bench.tick(50)
    assert len(bench.packets) == count and not bench.outcomes
    with pytest.raises(MotionRefusedError, match="paused: RESUME or STOP first"):
        bench.move(HOME)
    bench.command(Command.STOP, "dinner")
    assert [outcome.message for outcome in bench.outcomes] == ["aborted by STOP: dinner"]
    bench.until("idle")
    bench.move(HOME)


@pytest.mark.parametrize("leads_on", [Command.RESUME, Command.STOP, Command.ESTOP, Command.YIELD])
def test_a_pause_while_nothing_moves_is_shown_and_refuses_a_move(leads_on):
    """The simulator refuses direct commands from then on: who asks for the state reads why."""
    bench = Bench()
    bench.command(Command.PAUSE)
    bench.tick()
    assert bench.report.state == "paused" and bench.report.standing_still
    with pytest.raises(MotionRefusedError, match="paused: RESUME or STOP first"):
        bench.move()
    bench.command(leads_on)
    bench.command(Command.RESET)
    assert bench.report.state == "idle"
    bench.move()
    bench.until("idle")
    assert bench.q == FAR


def test_pause_before_the_first_motion_holds_the_move():
    """Announced, paused, resumed: it begins then."""
    bench = Bench()
    bench.move()
    bench.tick(3)
    bench.command(Command.PAUSE)
    bench.tick(40)
    assert bench.report.state == "paused" and bench.q == HOME
    bench.command(Command.RESUME)
    bench.until("idle")
    assert bench.q == FAR and smooth(bench.setpoints)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 60), st.booleans())
@example(8, False)
@example(59, False)
def test_stop_at_any_time_ramps_down_and_aborts_with_the_reason(after, emergency):
    """No velocity changes faster than accelerations allow; the caller is answered at once."""
    bench = Bench()
    bench.move()
    bench.tick(after)
    running = bench.report.state != "idle"
    # Behind the last set point only the joints are waited for: nothing is left to ramp down.
    ramps = bench.q != FAR
    command = Command.ESTOP if emergency else Command.STOP
    bench.command(command, "gate open")
    if running:
        assert [(o.success, o.message) for o in bench.outcomes] == [
            (False, f"aborted by {command.name}: gate open")
        ]
        assert bench.report.state == ("estopped" if emergency else "stopping" if ramps else "idle")
        assert (bench.report.target, bench.report.speed_applied_percent) == ((), 0.0)
    for _ in range(200):
        bench.tick()
    assert bench.report.standing_still and not any(bench.qdot) and bench.report.target == ()
    assert smooth(bench.setpoints) and bench.report.state == ("estopped" if emergency else "idle")


def test_emergency_stop_is_latched_until_reset_which_moves_nothing():
    """Neither moves nor streams before RESET; RESET alone starts nothing."""
    bench = Bench()
    bench.move()
    bench.tick(20)
    bench.command(Command.ESTOP, "button")
    bench.tick(100)
    where = bench.q
    for attempt in (bench.move, lambda: bench.stream(bench.q)):
        with pytest.raises(MotionRefusedError, match="emergency stop is latched: RESET first"):
            attempt()
    bench.command(Command.RESUME)
    bench.command(Command.STOP)
    assert bench.report.state == "estopped"
    bench.command(Command.RESET)
    bench.tick(50)
    assert bench.report.state == "idle" and bench.q == where
    bench.move(HOME)
    bench.until("moving")


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 60), st.floats(5.0, 100.0))
def test_a_new_move_replaces_the_running_one_without_a_jerk(after, percent):
    """The older caller is told by whom; the path goes on from what the joints do."""
    bench = Bench()
    bench.move()
    bench.tick(after)
    running = not bench.outcomes
    bench.move((-0.5, 0.5, -0.2, 0.0), percent)
    bench.tick()
    if running:
        assert [outcome.message for outcome in bench.outcomes] == ["aborted: replaced by move 2"]
    bench.until("idle")
    bench.tick(3)
    assert (
        bench.outcomes[-1].success and bench.q == (-0.5, 0.5, -0.2, 0.0) and smooth(bench.setpoints)
    )


def test_a_move_of_one_joint_holds_the_others():
    """The table does not move with the arm, nor the arm with the table."""
    bench = Bench()
    bench.move([0.5], names=["table_joint"])
    bench.until("idle")
    assert bench.q == (*HOME[:3], 0.5)


def test_a_replacing_move_of_one_joint_brings_the_others_to_a_stop():
    """What is not named does not run on to its old target, nor stops dead."""
    bench = Bench()
    bench.move()
    bench.tick(25)
    bench.move([0.0], names=["table_joint"])
    bench.until("idle")
    assert HOME[0] < bench.q[0] < FAR[0] and bench.q[3] == 0.0 and smooth(bench.setpoints)


def test_a_move_that_replaces_one_of_a_single_joint_takes_it_over_at_its_speed():
    """The other joints stand, and its speed is even; the limit set meanwhile slows it, no jump."""
    bench = Bench()
    bench.move([1.5], names=["table_joint"], percent=60.0)
    bench.tick(40)
    joint = bench.setpoints[-1]
    assert joint.qdot == bench.setpoints[-2].qdot and joint.qdot[3] > 0.0
    bench.core.limit_speed(5.0, bench.now)
    bench.move([1.6], names=["table_joint"], percent=60.0)
    bench.until("idle")
    assert smooth(bench.setpoints) and bench.q == (*HOME[:3], 1.6)


@pytest.mark.parametrize(
    ("first", "then", "stopped"),
    [(50.0, 50.0, False), (10.0, 100.0, False), (100.0, 20.0, False), (50.0, 50.0, True)],
)
def test_a_move_that_replaces_another_keeps_the_cap(first: float, then: float, stopped: bool):
    """From the first set point on, whatever speeds were asked for, also out of a stop."""
    bench = Bench()
    bench.core.limit_speed(10.0, bench.now)
    bench.move(percent=first)
    bench.tick(100)
    if stopped:
        bench.command(Command.STOP)
        bench.tick()
    assert any(bench.qdot)
    bench.move((1.8, 0.3, -0.1, 0.4), then)
    bench.tick(60)
    most = 0.102 * np.array([joint.velocity for joint in ROBOT.twin_joints])
    speeds = np.abs([point.qdot for packet in bench.packets for point in packet.points])
    steps = np.abs(np.diff([setpoint.q for setpoint in bench.setpoints], axis=0))
    assert (speeds <= most).all() and (steps <= most * DT).all() and smooth(bench.setpoints)


@pytest.mark.parametrize(
    ("prepare", "text"),
    [
        (
            lambda bench: bench.core.tick(bench.now + 0.6),
            r"twin/joint_states is 0\.60 s old, allowed 0\.5",
        ),
        (
            lambda bench: bench.core.measure(
                JointMotion.measured((0.5, *HOME[1:]), (0.2, 0, 0, 0), bench.now)
            ),
            "joint_1 moves at 11.46 deg/s: stop",
        ),
    ],
)
def test_a_move_needs_to_know_where_the_joints_are(prepare, text):
    """Fresh and at rest, unless the motion is our own."""
    bench = Bench()
    prepare(bench)
    bench.now += 0.6 if "old" in text else 0.0
    with pytest.raises(MotionRefusedError, match=text):
        bench.move()
    assert bench.report.message.startswith("refused: ")


def test_before_the_first_measurement_nothing_moves():
    """A simulator that is not there is said to be missing."""
    core = PoseController(ROBOT, CONFIG, 0.0)
    with pytest.raises(MotionRefusedError, match="no twin/joint_states yet"):
        core.move((), FAR, 50.0, 0.0)


@pytest.mark.parametrize(
    ("positions", "percent", "text"),
    [
        ((0.0, math.nan, 0.0, 0.0), 50.0, "not finite: joint_2 = nan"),
        ((0.0, 2.71, 0.0, 0.0), 50.0, r"joint_2 = 2\.71 rad is outside \[-2\.618, 2\.618\]"),
        ((0.0, 0.0), 50.0, "got 2 joint values, expected 4"),
        (FAR, 120.0, r"speed_percent = 120 is outside \[1, 100\]"),
    ],
)
def test_a_refused_move_leaves_the_running_one_alone(positions, percent, text):
    """Refusals appear in the state's message."""
    bench = Bench()
    bench.move()
    bench.tick(20)
    with pytest.raises(ScaraControlError, match=text):
        bench.move(positions, percent)
    assert bench.report.message.startswith("refused: ") and bench.report.target == FAR
    bench.until("idle")
    assert bench.q == FAR


def test_a_wrong_cap_is_refused():
    """A cap of 0 would freeze the twin without a word."""
    bench = Bench()
    for percent in (0.0, 101.0, math.nan):
        with pytest.raises(
            MotionRefusedError, match=r"speed_limit_percent = .* is outside \[1, 100\]"
        ):
            bench.core.limit_speed(percent, bench.now)
    assert bench.report.speed_limit_percent == 100.0


def test_a_move_starts_where_the_joints_were_left_by_somebody_else():
    """After jogging the old set point means nothing; a small rest of the PID is no jogging."""
    bench = Bench()
    bench.move()
    bench.until("idle")
    bench.tick(3)
    bench.q = (FAR[0] + 0.004, FAR[1], FAR[2], FAR[3])
    bench.tick()
    bench.modes(MODES | {"joint_2": "position"})
    bench.q = (bench.q[0], FAR[1] + 0.004, FAR[2] - 0.01, FAR[3])
    bench.tick()
    bench.move(HOME)
    bench.tick()
    assert bench.setpoints[-1].q == (FAR[0], FAR[1] + 0.004, FAR[2] - 0.01, FAR[3])


def test_a_joint_that_another_controller_takes_ends_the_move():
    """The others ramp down; the taken one is left alone."""
    bench = Bench()
    bench.move()
    bench.tick(25)
    bench.modes(MODES | {"joint_2": "velocity"})
    bench.tick()
    assert [outcome.message for outcome in bench.outcomes] == [
        "aborted: joint_2 was taken by its velocity controller"
    ]
    assert bench.packets[-1].names == ("joint_1", "joint_3", "table_joint")
    assert bench.report.state == "stopping"
    with pytest.raises(MotionRefusedError, match="still stopping after a joint was taken"):
        bench.move(HOME)
    bench.until("idle")
    assert all(packet.names != NAMES for packet in bench.packets[-5:])


def test_a_move_without_measurements_is_stopped():
    """A simulator that died does not leave its caller waiting."""
    bench = Bench()
    bench.move(percent=5.0)
    bench.tick(20)
    bench.measuring = False
    bench.tick(60)
    assert [outcome.message for outcome in bench.outcomes] == [
        "aborted: twin/joint_states is 0.51 s old, allowed 0.5"
    ]


def test_joints_that_never_arrive_fail_the_move():
    """After the time-out, with joint and rest."""
    bench = Bench()
    bench.move((0.0, 0.0, -0.16, 0.0))
    bench.obey = lambda packet: None
    bench.q = (0.001, *HOME[1:])
    bench.tick(300)
    (outcome,) = bench.outcomes
    assert not outcome.success and "joint_1 is 0.057 deg from its target" in outcome.message
    assert bench.report.message == outcome.message


@pytest.mark.parametrize("command", [Command.STOP, Command.ESTOP])
def test_a_stop_behind_a_standstill_moves_nothing(command: Command) -> None:
    """The joints have come to rest at the last set points; a ramp would move them again."""
    bench = Bench()
    bench.move()
    bench.tick(40)
    assert bench.report.state == "moving"
    count = len(bench.packets)
    bench.now += 0.5
    bench.command(command, "test")
    bench.tick(50)
    assert len(bench.packets) == count
    (outcome,) = bench.outcomes
    assert not outcome.success and f"aborted by {command.name}: test" in outcome.message


def test_a_stop_within_the_horizon_begins_where_the_joints_are() -> None:
    """They have gone on by their set points: a ramp from before would pull them back."""
    bench = Bench()
    bench.move()
    bench.tick(25)
    there = bench.packets[-1].points[10]
    bench.now = there.time
    bench.command(Command.STOP)
    bench.tick()
    assert bench.setpoints[-1].q[0] > there.q[0]


def test_a_stop_is_told_where_somebody_else_moves_the_joints():
    """Until they stand; a stop of joints that stand is told as before: by its number alone."""
    bench = Bench()
    bench.command(Command.STOP)
    assert bench.tick() == "idle" and bench.core.is_idle
    bench.qdot = (0.5, 0.0, 0.0, 0.0)
    assert bench.tick() == "idle" and bench.core.is_idle
    bench.command(Command.STOP)
    assert bench.tick(5) == "stopping" and not bench.core.is_idle
    assert not bench.setpoints, "it drives nothing"
    bench.qdot = (0.0,) * 4
    assert bench.tick() == "idle" and bench.core.is_idle
    bench.qdot = (0.5, 0.0, 0.0, 0.0)
    bench.tick()
    bench.command(Command.STOP)
    assert bench.tick(round(CONFIG.move.settle_timeout / DT) - 1) == "stopping"
    assert bench.tick(2) == "idle", "somebody drives it on: it can be aligned all the same"
