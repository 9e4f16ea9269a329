"""The stream program: which set points it follows, and the watchdog that ends it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest
from fanuc_emulator.snapshot import ControlType, WatchdogState
from fanuc_emulator.tp.executor import ProgramState

from fanuc_emulator import alarms

if TYPE_CHECKING:
    from conftest import Bench

ABORTED, PAUSED, RUNNING = ProgramState.ABORTED, ProgramState.PAUSED, ProgramState.RUNNING


def test_stream_follows_set_points_after_the_start_delay(bench: Bench) -> None:
    """RSR1 starts following PR[1]; the delay is that of emulator.yaml."""
    bench.controller.write_input("rsr1", True)
    begin = bench.now.tick
    while not bench.now.velocities[0] and bench.now.tick < begin + 500:
        bench.stream_to("joint_1", 0.01)
        bench.run(bench.config.dt)
    bench.run_until(lambda now: now.positions[0] != 0.0)
    assert (bench.now.tick - begin) * bench.config.plant.servo_period_ms == pytest.approx(
        bench.config.plant.start_delay_ms, abs=4
    )
    bench.run(0.3)
    assert bench.now.positions[0] == pytest.approx(0.01, abs=1e-12)
    assert bench.now.control_type is ControlType.STREAM and bench.now.program_name == "RSR0101"


def test_stream_speed_and_override_limit_a_far_set_point(bench: Bench) -> None:
    """R[2] and the override multiply, as for any joint move."""
    bench.controller.source.speed_percent = 40
    bench.controller.write_override(50)
    bench.start_stream()
    bench.stream_to("joint_1", 1.5)
    bench.run(1.0)
    assert bench.cruising(0) == pytest.approx(0.2 * bench.robot.joint("joint_1").velocity, rel=0.01)
    assert bench.now.program_speed == 40


def test_an_invalid_set_point_is_not_used(bench: Bench) -> None:
    """setpoint_valid 0: the robot stays, without an alarm."""
    bench.start_stream()
    bench.stream_to("joint_1", 1.0)
    bench.controller.write_setpoint_valid(False)
    bench.run(0.3)
    assert bench.now.positions[0] == 0.0 and bench.now.alarm is None


@pytest.mark.parametrize(
    ("joint", "value", "code", "cause"),
    [
        ("joint_1", 3.0, alarms.POSITION_LIMIT, "J1 = 171.887 deg"),
        ("joint_3", 0.01, alarms.POSITION_LIMIT, "J3 = 10.000 mm"),
        ("table_joint", -3.5, alarms.POSITION_LIMIT, "J5 = -200.535 deg"),
        ("joint_2", math.nan, alarms.POSITION_INVALID, "J2 = nan deg"),
        ("joint_4", math.inf, alarms.POSITION_INVALID, "J4 = inf deg"),
    ],
)
def test_an_impossible_set_point_pauses_the_stream_and_is_not_approached(
    bench: Bench, joint: str, value: float, code: alarms.AlarmCode, cause: str
) -> None:
    """Out of range or no number: alarm with axis and value, program paused, nothing moves there."""
    bench.start_stream()
    before = bench.now.positions
    bench.stream_to(joint, value)
    bench.run(0.3)
    assert bench.now.alarm is not None
    assert (bench.now.alarm.code, bench.now.alarm.cause) == (code, cause)
    assert bench.now.program_state is PAUSED and bench.now.outputs.fault
    assert bench.now.positions == before


@pytest.mark.parametrize("mended", [True, False])
def test_a_stream_that_an_alarm_has_paused_goes_on_to_what_then_stands_in_pr1(
    bench: Bench, mended: bool
) -> None:
    """After RESET and START; a set point that is still out of range is the same alarm again."""
    bench.start_stream()
    bench.stream_to("joint_1", 3.0)
    bench.run(0.3)
    bench.pulse("start")
    assert bench.now.program_state is PAUSED, "FAULT is on"
    if mended:
        bench.stream_to("joint_1", 0.01)
    bench.pulse("fault_reset")
    assert bench.now.alarm is None
    bench.run(0.2)
    assert bench.now.program_state is PAUSED and not bench.moving
    bench.pulse("start")
    bench.run(0.4)
    assert bench.now.program_state is (RUNNING if mended else PAUSED)
    assert (bench.now.alarm is None) is mended
    assert bench.now.positions[0] == pytest.approx(0.01 if mended else 0.0, abs=1e-9)


@pytest.mark.parametrize("end", ["lower", "upper"])
def test_a_set_point_at_the_end_of_the_range_may_be_off_by_a_float32s_rounding(
    bench: Bench, end: str
) -> None:
    """Half a micrometre or microradian beyond it is the end; more is outside."""
    joint, side = bench.robot.joint("joint_2"), -1.0 if end == "lower" else 1.0
    bench.start_stream()
    bench.stream_to("joint_2", getattr(joint, end) + side * 5e-7)
    bench.run(0.1)
    assert bench.now.alarm is None
    bench.stream_to("joint_2", getattr(joint, end) + side * 5e-6)
    bench.run(0.1)
    assert bench.now.alarm is not None and bench.now.alarm.code is alarms.POSITION_LIMIT


def test_a_set_point_from_before_the_stream_is_not_approached(bench: Bench) -> None:
    """The stream program's first line puts the robot's own position there."""
    bench.stream_to("joint_1", 3.0)
    bench.pulse("rsr1")
    bench.run(0.1)
    assert bench.now.alarm is None and not any(bench.now.velocities)
    bench.stream_to("joint_1", 3.0)
    bench.run(0.1)
    assert bench.now.alarm is not None and bench.now.alarm.code is alarms.POSITION_LIMIT
    assert not any(bench.now.velocities)


def test_watchdog_stops_the_stream_on_its_ramp_and_latches(bench: Bench) -> None:
    """A client that falls silent: HOLD goes, the paused program is ended; so it stays till RESET.

    No alarm: BGTWIN raises none.
    """
    bench.start_stream()
    for beat in range(1, 20):
        bench.controller.write_heartbeat(beat)
        bench.stream_to("joint_1", 0.05 * beat)
        bench.run(0.01)
    assert bench.now.watchdog_state is WatchdogState.ARMED and bench.moving
    patience = bench.config.heartbeat_timeout_ms / 1000
    bench.run(patience - 0.012)
    assert bench.now.program_state is RUNNING
    bench.run(0.022)
    assert bench.now.watchdog_state is WatchdogState.EXPIRED
    assert bench.now.program_state is PAUSED and bench.now.outputs.held and bench.moving
    bench.run(0.5)
    assert not bench.moving and bench.now.program_state is ABORTED and bench.now.alarm is None
    bench.controller.write_heartbeat(50)
    bench.controller.write_input("hold", True)
    bench.run(0.01)
    bench.pulse("rsr1")
    assert bench.now.program_state is ABORTED and bench.now.outputs.held
    bench.pulse("fault_reset")
    assert bench.now.watchdog_state is WatchdogState.DISARMED and not bench.now.outputs.held
    bench.pulse("rsr1")
    assert bench.now.program_state is RUNNING


@pytest.mark.parametrize(
    ("beats", "at", "state"),
    [
        ([], 1_000, WatchdogState.DISARMED),
        ([(5, 0)], 120, WatchdogState.ARMED),
        ([(5, 0)], 136, WatchdogState.EXPIRED),
        ([(5, 0), (5, 100)], 136, WatchdogState.EXPIRED),
        ([(5, 0), (6, 96)], 200, WatchdogState.ARMED),
        ([(5, 0), (6, 96)], 232, WatchdogState.EXPIRED),
        ([(5, 0), (0, 48)], 1_000, WatchdogState.DISARMED),
        ([(5, 0), (0, 48), (5, 64)], 180, WatchdogState.ARMED),
        ([(32767, 0), (1, 96)], 200, WatchdogState.ARMED),
        ([(5, 0), (6, 200), (0, 240)], 300, WatchdogState.EXPIRED),
    ],
)
def test_only_a_change_keeps_the_watchdog_awake_and_zero_disarms(
    bench: Bench, beats: list[tuple[int, int]], at: int, state: WatchdogState
) -> None:
    """The first change arms it, a value that stays ends what runs, 0 is a farewell [ms]."""
    bench.start_moving()
    begun = bench.now.tick * bench.config.dt * 1e3
    for value, when in [*beats, (None, at)]:
        bench.run((begun + when) * 1e-3 - bench.now.tick * bench.config.dt)
        if value is not None:
            bench.controller.write_heartbeat(value)
    assert bench.now.watchdog_state is state
    assert (bench.now.program_state is RUNNING) is (state is not WatchdogState.EXPIRED)


@pytest.mark.parametrize("reset", ["fault_reset", "panel_reset"])
def test_watchdog_of_a_robot_at_rest_holds_nobody(bench: Bench, reset: str) -> None:
    """There is nothing to stop, and a person may start a program; the next beat arms it again."""
    bench.controller.write_heartbeat(1)
    bench.run(bench.config.heartbeat_timeout_ms / 1000 + 0.1)
    assert bench.now.watchdog_state is WatchdogState.DISARMED and not bench.now.outputs.held
    bench.start_moving()
    bench.run(0.3)
    assert bench.now.program_state is RUNNING
    bench.controller.write_heartbeat(8)
    bench.run(0.8)
    assert bench.now.program_state is ABORTED and not bench.moving
    bench.controller.pulse_input(reset)
    bench.run(0.02)
    assert bench.now.watchdog_state is WatchdogState.DISARMED and not bench.now.outputs.held


def test_a_held_stream_catches_up_within_its_limits_after_resume(bench: Bench) -> None:
    """The set point may have gone on meanwhile."""
    bench.start_stream()
    bench.stream_to("joint_1", 0.5)
    bench.run(0.1)
    bench.controller.write_input("hold", False)
    bench.run(0.3)
    held = bench.now.positions[0]
    assert not bench.moving and 0.0 < held < 0.5
    bench.controller.write_input("hold", True)
    bench.pulse("start")
    bench.run(1.0)
    assert bench.now.positions[0] == pytest.approx(0.5, abs=1e-12)
