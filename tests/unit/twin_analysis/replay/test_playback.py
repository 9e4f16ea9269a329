"""A recorded robot does again what it did."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fanuc_emulator.config import load_emulator
from fanuc_emulator.snapshot import ControlType
from harness.processes import free_port, wait_until
from harness.workspace import ROOT
from scara_config import load_robot
from twin_analysis.replay.playback import Playback, PlaybackController, plan_playback
from twin_analysis.replay.replay_to_twin_node import _live, _run
from twin_analysis.replay.stage_io import Stage, StageError
from twin_experiments.metrics.series import Motion, align, find_gaps
from twin_experiments.metrics.tracks import Track
from twin_experiments.report.record import RecordError

ROBOT = load_robot(ROOT / "config")
EMULATOR = load_emulator(ROBOT, ROOT / "config")
COLUMNS = [k for k, joint in enumerate(ROBOT.joints) if joint.twin]
PERIOD = 0.002


def swing(amplitude: float = 0.5, duration: float = 2.0) -> Motion:
    """Return joint 1 swinging between rests, sampled at 103 Hz."""
    times = np.arange(0.0, duration + 2.0, 0.0097)
    u = np.clip((times - 1.0) / duration, 0.0, 1.0)
    positions, velocities = np.zeros((len(times), 4)), np.zeros((len(times), 4))
    positions[:, 0] = amplitude * np.sin(np.pi * u) ** 2
    velocities[:, 0] = (
        amplitude * np.pi * np.sin(2.0 * np.pi * u) / duration * ((u > 0.0) & (u < 1.0))
    )
    positions[:, 2] = -0.1
    return Motion("real", times + 7.0, positions, velocities)


def played(rate: float = 1.0) -> Playback:
    """Plan a swing."""
    return plan_playback(ROBOT, swing(), None, rate, PERIOD)


@pytest.mark.parametrize("rate", [0.5, 1.0, 2.0])
def test_a_gentle_motion_is_played_at_its_rate(rate: float) -> None:
    """Positions at the same place, velocities times the rate, duration divided by it."""
    recorded, playback = swing(), played(rate)
    assert playback.duration == pytest.approx(
        (recorded.stamps[-1] - recorded.stamps[0]) / rate, abs=2 * PERIOD
    )
    motion = playback.motion(0.0, COLUMNS)
    peak = np.argmax(motion.positions[:, 0])
    assert motion.stamps[peak] == pytest.approx(2.0 / rate, abs=0.01)
    assert playback.played_at(9.0) == pytest.approx(2.0 / rate, abs=2 * PERIOD)
    assert np.abs(motion.velocities).max() == pytest.approx(
        rate * np.abs(recorded.velocities).max(), rel=1e-2
    )


@pytest.mark.parametrize("rate", [0.5, 1.0, 2.0, 5.0])
def test_played_velocities_are_the_slope_of_played_positions(rate: float) -> None:
    """Whatever the rate, and where it changes."""
    motion = plan_playback(ROBOT, swing(1.5, 0.8), None, rate, PERIOD).motion(0.0, COLUMNS)
    slope = np.gradient(motion.positions[:, 0], PERIOD)
    assert (
        np.abs(slope - motion.velocities[:, 0])[2:-2].max() < 0.01 * np.abs(motion.velocities).max()
    )


def test_a_hard_move_is_played_within_the_joints_limits_and_its_rests_as_fast_as_asked() -> None:
    """Twice as fast would be four times the acceleration; never slower than recorded."""
    recorded = swing(1.0, 0.8)
    limit = ROBOT.twin_joints[0].acceleration
    playback = plan_playback(ROBOT, recorded, None, 4.0, PERIOD)
    motion = playback.motion(0.0, COLUMNS)
    slowest = np.abs(np.gradient(recorded.velocities[:, 0], recorded.stamps)).max()
    assert slowest * 16.0 > limit > slowest, "four times as fast is too hard, as recorded is not"
    assert np.abs(np.gradient(motion.velocities[:, 0], PERIOD)).max() < 1.1 * limit
    length = recorded.stamps[-1] - recorded.stamps[0]
    assert length / 4.0 < playback.duration < length
    rest = np.gradient(playback.instants, PERIOD)[5:50]
    assert rest == pytest.approx(4.0, rel=1e-6)


def test_joints_that_the_twin_does_not_have_rest_at_zero() -> None:
    """They were not recorded."""
    playback = played()
    others = [k for k in range(len(ROBOT.joints)) if k not in COLUMNS]
    assert (playback.shown.positions[:, others] == 0.0).all()


def test_a_program_runs_around_the_motion_and_as_recorded_if_that_is_known() -> None:
    """Without flags: whenever something moves; with flags: when they say so."""
    playback = played()
    moving = np.flatnonzero(np.abs(playback.shown.velocities).max(axis=1) > 0.0)
    assert playback.running[moving].all() and not playback.running[0] and not playback.running[-1]
    recorded = swing()
    flags = (recorded.stamps > 8.5) & (recorded.stamps < 9.0)
    ran = plan_playback(ROBOT, recorded, flags, 1.0, PERIOD).running
    assert ran.sum() * PERIOD == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize(
    ("motion", "rate", "text"),
    [
        (
            swing(2.4, 0.6),
            1.0,
            r"joint_1 would move at \d+ deg/s at rate 1, its largest speed is 440",
        ),
        (swing(3.0, 4.0), 1.0, r"joint_1 would go from .* to 3, allowed is -2\.583 to 2\.583"),
    ],
)
def test_what_no_controller_would_believe_is_refused(
    motion: Motion, rate: float, text: str
) -> None:
    """Too fast, or outside the limits: joint and value are named."""
    with pytest.raises(RecordError, match=text):
        plan_playback(ROBOT, motion, None, rate, PERIOD)


def test_the_played_robot_shows_its_rows_one_after_the_other() -> None:
    """It waits at the first, moves as a program of its own, rests at the last.

    Its clock goes on throughout.
    """
    playback = played()
    robot = PlaybackController(EMULATOR, ROBOT, playback)
    waiting = [robot.step() for _ in range(10)]
    assert {s.control_type for s in waiting} == {ControlType.NONE} and not robot.playing
    robot.play()
    shown = [robot.step() for _ in range(len(playback.shown.positions) + 10)]
    assert shown[0].measured_positions == tuple(playback.shown.positions[0])
    middle = len(playback.shown.positions) // 2
    assert shown[middle].measured_positions == tuple(playback.shown.positions[middle])
    assert shown[middle].measured_velocities == tuple(playback.shown.velocities[middle])
    assert shown[middle].control_type is ControlType.PROGRAM and shown[middle].outputs.progrun
    assert robot.ended and robot.part == 1.0
    assert (
        shown[-1].measured_velocities == (0.0,) * 5 and shown[-1].control_type is ControlType.NONE
    )
    assert np.diff([s.clock_ms for s in shown]).tolist() == [EMULATOR.plant.servo_period_ms] * (
        len(shown) - 1
    )


def test_the_played_robot_obeys_nobody() -> None:
    """Stop signals and set points change nothing of what is shown."""
    playback = played()
    robot, free = (PlaybackController(EMULATOR, ROBOT, playback) for _ in range(2))
    for each in (robot, free):
        each.play()
    robot.write_input("imstp", False)
    robot.write_input("hold", False)
    robot.write_setpoint([0.3] * len(ROBOT.joints))
    for _ in range(800):
        one, other = robot.step(), free.step()
        assert (one.measured_positions, one.control_type) == (
            other.measured_positions,
            other.control_type,
        )
        assert one.outputs.sysrdy and not one.outputs.held and not one.outputs.fault


def test_a_playing_robot_that_fails_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whoever waits for its end is told at once, and not after a minute and a half."""

    def step(robot: PlaybackController) -> None:
        raise ValueError("no such row")

    with Stage(ROBOT, played(), "127.0.0.1", free_port(), str(ROOT / "config")) as stage:
        stage.check()
        assert not stage.ended
        monkeypatch.setattr(PlaybackController, "step", step)
        wait_until(lambda: stage._loop.failure is not None, 5.0, "the failure")
        with pytest.raises(StageError, match="robot has failed: ValueError: no such row"):
            stage.ended  # noqa: B018


def test_a_played_row_is_dated_as_the_controller_dates_a_reading() -> None:
    """What shows late was true before: a twin that is led to where the robot is has no lag."""
    latency, recorded, playback = 0.02, swing(), played()
    # It is where the robot is now, ahead of what its registers show.
    twin = replace(playback.motion(-latency, COLUMNS), side="twin")
    track = Track("recorded", "x", "real", recorded, replace(recorded, side="twin"))
    live = _live(ROBOT, playback, twin, latency)(track)
    both = align(live.real, live.twin, 1000.0, 0.05)
    assert both.span == pytest.approx(playback.duration, abs=0.01)
    assert np.abs(both.real.positions - both.twin.positions).max() < 1e-6


def test_what_is_played_through_a_hole_is_held_against_nothing() -> None:
    """The robot was not heard there: what it did is nobody's knowledge."""
    whole = swing()
    heard = (whole.stamps < 8.8) | (whole.stamps > 9.3)
    recorded = Motion(
        "real", *(each[heard] for each in (whole.stamps, whole.positions, whole.velocities))
    )
    playback = plan_playback(ROBOT, recorded, None, 1.0, PERIOD)
    twin = replace(playback.motion(0.0, COLUMNS), side="twin")
    track = Track("recorded", "x", "real", recorded, replace(recorded, side="twin"))
    live = _live(ROBOT, playback, twin, 0.0, find_gaps(recorded, 0.05))(track)
    (gap,) = align(live.real, live.twin, 1000.0, 0.05).gaps
    assert (gap.start, gap.duration) == pytest.approx((1.8, 0.5), abs=0.02)


def test_recording_of_another_robot_is_refused(
    make_bag: Callable[..., Path],
    recorded_configuration: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its joints have the same names; the twin's arm is another one."""
    bag = make_bag(experiments=("real_leads",), configuration=recorded_configuration)
    monkeypatch.setenv("SCARA_ROBOT", "fanuc_sr3ia")
    text = r"run\.bag: was recorded of fanuc_sr6ia .*; the twin is one of fanuc_sr3ia "
    with pytest.raises(RecordError, match=text):
        _run(bag, 1.0, tmp_path, None, (None, None), str(ROOT / "config"))
