"""The controller's reactions: signals, alarms, programs."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import pytest
from fanuc_emulator.config import load_programs
from fanuc_emulator.tp.executor import ProgramState
from fanuc_emulator.uop import NORMALLY_ON, UI, UO
from harness.parts import changed
from scara_config.programs.tp.listing import Indexed

from fanuc_emulator import alarms

if TYPE_CHECKING:
    from conftest import Bench

ABORTED, PAUSED, RUNNING = ProgramState.ABORTED, ProgramState.PAUSED, ProgramState.RUNNING


def test_article_program_visits_its_positions_and_rests_exactly_there(bench: Bench) -> None:
    """P1, then P2, P3, P1 twice, each reached exactly and held for 0.5 s or more."""
    bench.pulse("rsr2")
    bench.run_until(lambda now: now.program_state is ABORTED)
    rests, still = [], 0
    for before, now in zip(bench.history, bench.history[1:]):
        still = still + 1 if before.positions == now.positions else 0
        if still == round(0.5 / bench.config.dt):
            rests.append(
                tuple(
                    round(q / joint.scale, 6) for q, joint in zip(now.positions, bench.robot.joints)
                )
            )
    p1, p2, p3 = (
        (0, 0, -160, 0, 0),
        (-14.321759, 69.600038, -60, 0, 0),
        (-49.157701, 69.600038, 0, 0, 0),
    )
    assert rests == [pytest.approx(p) for p in (p1, p2, p3, p1, p2, p3, p1)]
    assert bench.now.outputs.cmdenbl and not bench.now.outputs.progrun and bench.now.outputs.atperch


def test_cold_start_override_slows_a_program_down(bench: Bench) -> None:
    """A joint move runs at programmed speed times override."""
    bench.controller.write_override(10)
    bench.pulse("rsr2")
    bench.run(2.5)
    assert bench.cruising(1) == pytest.approx(
        bench.robot.joint("joint_2").velocity * 0.5 * 0.1, rel=0.02
    )


def test_override_is_ten_percent_after_a_cold_start(bench: Bench) -> None:
    """The real controller comes up slow."""
    fresh = type(bench)(bench.config, bench.robot, {})
    assert fresh.now.override == 10


@pytest.mark.parametrize("name", ["hold", "enbl"])
def test_hold_decelerates_on_the_path_and_start_resumes_it(bench: Bench, name: str) -> None:
    """*HOLD or ENBL off: PAUSED on the joint path; only START goes on, to the same end."""
    bench.start_moving()
    bench.controller.write_input(name, False)
    bench.run(0.6)
    held = bench.now.positions
    assert not bench.moving
    assert bench.now.program_state is PAUSED and bench.now.outputs.paused
    assert bench.now.outputs.held is (name == "hold")
    assert held[1] / math.radians(69.600037824) == pytest.approx(
        held[0] / math.radians(-14.321759156), rel=1e-4
    )
    bench.controller.write_input(name, True)
    bench.run(0.3)
    assert bench.now.positions == held
    bench.pulse("start")
    assert bench.now.program_state is RUNNING
    bench.run_until(lambda now: now.program_line == 5)
    bench.run(0.3)
    assert bench.now.positions[1] == pytest.approx(math.radians(69.600037824), abs=1e-12)


def test_the_robot_is_busy_while_a_program_runs_or_it_still_moves(bench: Bench) -> None:
    """BUSY goes when it stands; PAUSED says before that it will."""
    bench.run(0.2)
    assert not bench.now.outputs.busy
    bench.start_moving()
    assert bench.now.outputs.busy and not bench.now.outputs.atperch, "the table alone is there"
    bench.controller.write_input("hold", False)
    bench.run(0.01)
    assert bench.moving and bench.now.outputs.busy and not bench.now.outputs.progrun
    bench.run(1.0)
    assert not bench.moving and not bench.now.outputs.busy and bench.now.outputs.paused


def test_start_while_held_is_refused_with_a_warning(bench: Bench) -> None:
    """START needs *HOLD on; a refusal is a WARN and no FAULT."""
    bench.start_moving()
    bench.controller.write_input("hold", False)
    bench.run(0.5)
    bench.pulse("start")
    assert bench.now.program_state is PAUSED
    assert bench.now.alarm is not None and bench.now.alarm.cause == "HOLD is off"
    assert not bench.now.outputs.fault


def test_cstopi_ends_a_program_and_nothing_can_resume_it(bench: Bench) -> None:
    """The state is paused while it decelerates and aborted at standstill."""
    bench.start_moving()
    bench.controller.write_input("cstopi", True)
    bench.run(0.002)
    assert bench.now.program_state is PAUSED
    bench.run(0.6)
    assert bench.now.program_state is ABORTED and not bench.moving
    stopped = bench.now.positions
    bench.controller.write_input("cstopi", False)
    bench.pulse("start")
    bench.run(0.3)
    assert bench.now.positions == stopped


def test_imstp_cuts_the_drives_at_once_and_latches_an_alarm(bench: Bench) -> None:
    """SYSRDY and CMDENBL go off, the program waits, and only FAULT_RESET ends that."""
    bench.start_moving()
    bench.controller.write_input("imstp", False)
    bench.run(0.002)
    outputs = bench.now.outputs
    assert outputs.fault and not outputs.sysrdy and not outputs.cmdenbl and not outputs.progrun
    assert bench.now.alarm is not None and bench.now.alarm.code is alarms.IMSTP
    assert bench.now.program_state is PAUSED
    bench.run(0.4)
    stopped = bench.now.positions
    assert not bench.moving
    bench.pulse("fault_reset")
    assert bench.now.outputs.fault, "the input is still off"
    bench.controller.write_input("imstp", True)
    bench.run(0.2)
    assert bench.now.outputs.fault and not bench.now.outputs.sysrdy
    bench.pulse("fault_reset")
    assert bench.now.outputs.sysrdy and bench.now.outputs.cmdenbl and not bench.now.outputs.fault
    bench.run(0.5)
    assert bench.now.positions == pytest.approx(stopped, abs=1e-6)


def stopping_distance(bench: Bench, signal: str) -> float:
    """Move joint_2 up to speed, switch a signal off and return how far joint_2 still went [rad]."""
    bench.start_moving()
    bench.run_until(lambda now: abs(now.velocities[1]) > 5.0)
    begin = bench.now.positions[1]
    bench.controller.write_input(signal, False)
    bench.run(0.6)
    return abs(bench.now.positions[1] - begin)


def test_emergency_stop_is_shorter_than_hold(bench: Bench) -> None:
    """Brakes do not wait for filters and ramps."""
    held = stopping_distance(bench, "hold")
    bench.controller.write_input("hold", True)
    bench.pulse("cstopi")
    bench.run(0.5)
    bench.stream_to("joint_2", 0.0)
    bench.pulse("rsr1")
    bench.run(1.0)
    bench.pulse("cstopi")
    bench.run(0.5)
    assert stopping_distance(bench, "imstp") < 0.6 * held


def test_a_robot_that_brakes_without_its_drives_shows_where_it_is(bench: Bench) -> None:
    """Each period, and not only once it stands: whoever is near has to see how far it goes."""
    bench.start_moving()
    bench.run_until(lambda now: abs(now.velocities[1]) > 5.0)
    bench.controller.write_input("imstp", False)
    begin = len(bench.history)
    bench.run(0.3)
    shown = [(now.positions[1], now.velocities[1]) for now in bench.history[begin:]]
    slower = [abs(v) for _, v in shown]
    assert slower == sorted(slower, reverse=True) and slower[-1] == 0.0
    for (before, faster), (after, v) in pairwise(shown):
        assert after - before == pytest.approx(0.5 * (faster + v) * bench.config.dt, abs=5e-4)


def slow_drives(bench: Bench) -> Bench:
    """Return a robot whose drives take 1.5 s, stopped by *IMSTP in mid-move and asked to reset."""
    programs = load_programs(bench.robot)
    made = type(bench)(changed(bench.config, plant__power_on_ms=1500), bench.robot, programs)
    made.controller.write_override(100)
    made.start_moving()
    made.controller.write_input("imstp", False)
    made.run(0.5)
    made.controller.write_input("imstp", True)
    made.pulse("fault_reset", 0.03)
    return made


def test_fault_stays_until_the_drives_are_on_and_a_start_meanwhile_is_refused(
    bench: Bench,
) -> None:
    """SYSRDY comes first; who has pressed START too early reads why, and presses it again."""
    robot = slow_drives(bench)
    robot.run(1.0)
    robot.pulse("start")
    # Pressed once more, RESET changes nothing.
    robot.pulse("fault_reset", 0.03)
    outputs = robot.now.outputs
    assert outputs.fault and not outputs.sysrdy and not outputs.cmdenbl
    assert robot.now.alarm is not None and robot.now.alarm.code is alarms.IMSTP
    robot.run(0.5)
    outputs, alarm = robot.now.outputs, robot.now.alarm
    assert outputs.sysrdy and outputs.cmdenbl and not outputs.fault
    assert alarm is not None and alarm.code is alarms.START_REFUSED
    assert alarm.cause == "the drives are being switched on"
    assert robot.now.program_state is PAUSED
    robot.pulse("start")
    assert robot.now.program_state is RUNNING


@pytest.mark.parametrize("cause", ["imstp", "panel_imstp", "panel_t1"])
def test_a_stop_keeps_drives_off_that_are_being_switched_on(bench: Bench, cause: str) -> None:
    """Only another RESET brings them."""
    robot = slow_drives(bench)
    robot.run(1.0)
    for level in (True, False, True):
        robot.controller.write_input(cause, level)
        robot.run(0.01)
    robot.run(2.5)
    assert robot.now.outputs.fault and not robot.now.outputs.sysrdy
    robot.pulse("fault_reset", 0.03)
    robot.run(1.4)
    assert not robot.now.outputs.sysrdy
    robot.run(0.2)
    assert robot.now.outputs.sysrdy and not robot.now.outputs.fault


def test_reset_while_still_braking_is_refused(bench: Bench) -> None:
    """Drives are not switched on while an axis moves."""
    bench.start_moving()
    bench.controller.write_input("imstp", False)
    bench.controller.write_input("imstp", True)
    bench.controller.write_input("fault_reset", True)
    bench.controller.write_input("fault_reset", False)
    bench.run(0.002)
    assert not bench.now.outputs.sysrdy and bench.now.outputs.fault


def test_open_fence_pauses_caps_the_override_and_forbids_a_start(bench: Bench) -> None:
    """*SFSPD off: as with HOLD the robot stands and its program waits; closed, START goes on.

    The override stays as low until somebody sets it.
    """
    bench.start_moving()
    bench.controller.write_input("sfspd", False)
    bench.run(0.4)
    assert bench.now.override == bench.config.safety_speed_percent
    assert bench.now.program_state is ProgramState.PAUSED
    assert not any(bench.now.velocities)
    assert not bench.now.outputs.cmdenbl
    bench.controller.write_override(80)
    for closed in (False, True):
        bench.controller.write_input("sfspd", closed)
        bench.run(0.1)
        assert bench.now.override == bench.config.safety_speed_percent
        assert not any(bench.now.velocities)
    bench.controller.write_override(80)
    assert bench.run(0.1).override == 80
    bench.pulse("start")
    assert bench.now.program_state is ProgramState.RUNNING


@pytest.mark.parametrize(
    ("prepare", "cause"),
    [
        (["rsr7"], "RSR7 has no program"),
        (["-hold", "rsr2"], "HOLD is off"),
        (["-sfspd", "rsr2"], "SFSPD is off"),
        (["-enbl", "rsr2"], "ENBL is off"),
        (["rsr2", "panel_run3"], "ARTICLE is running"),
        (["rsr2", "-hold", "panel_run3"], "ARTICLE is paused"),
        (["rsr2", "rsr7"], "RSR7 has no program"),
        (["rsr2", *["rsr3"] * 9], "8 requests wait already"),
    ],
)
def test_a_refused_start_says_why_and_is_no_fault(
    bench: Bench, prepare: list[str], cause: str
) -> None:
    """Every obstacle of a remote start is named in a WARN."""
    for action in prepare:
        if action.startswith("-"):
            bench.controller.write_input(action[1:], False)
            bench.run(0.01)
        else:
            bench.pulse(action)
    assert bench.now.alarm is not None
    assert (bench.now.alarm.code, bench.now.alarm.cause) == (alarms.START_REFUSED, cause)
    assert not bench.now.outputs.fault


def test_an_alarm_has_the_time_of_the_robots_clock_and_forbids_a_start(bench: Bench) -> None:
    """While its drives are on as well: the stream is paused, the robot stands in a fault."""
    bench.run(1.5)
    bench.start_stream()
    bench.stream_to("joint_1", 10.0)
    bench.run_until(lambda now: now.alarm is not None, 1.0)
    alarm = bench.now.alarm
    assert alarm is not None and alarm.code is alarms.POSITION_LIMIT
    assert alarm.seconds == pytest.approx(1.7e9 + len(bench.history) * bench.config.dt, abs=0.1)
    assert bench.now.outputs.sysrdy and bench.now.outputs.fault
    assert not bench.now.outputs.cmdenbl


def test_a_start_with_a_fault_names_the_fault_not_the_warning(bench: Bench) -> None:
    """While the drives are off nothing starts and the alarm that matters stays on show."""
    bench.controller.write_input("imstp", False)
    bench.run(0.01)
    bench.pulse("rsr2")
    assert bench.now.program_state is ABORTED
    assert bench.now.alarm is not None and bench.now.alarm.code is alarms.IMSTP


def test_snapshots_belong_together(bench: Bench) -> None:
    """Clock and position are of one instant, in whole periods; encoder and truth agree."""
    bench.start_moving()
    bench.run(0.1)
    for before, now in zip(bench.history, bench.history[1:]):
        assert now.clock_ms - before.clock_ms == bench.config.plant.servo_period_ms
        assert (
            now.clock_ms
            == bench.config.plant.clock.boot_offset_ms
            + now.tick * bench.config.plant.servo_period_ms
        )
        assert now.measured_positions == pytest.approx(now.positions, abs=1e-5)


@pytest.mark.parametrize(
    ("place", "name"),
    [
        *((f"UI[{n}]", name) for n, name in enumerate(UI, start=1)),
        *((f"F[{n}]", name) for n, name in enumerate(UI, start=1)),
        *(("SI[1]", "panel_reset"), ("SI[3]", "panel_hold"), ("SI[6]", "panel_start")),
    ],
)
def test_a_program_reads_the_inputs_by_their_numbers(bench: Bench, place: str, name: str) -> None:
    """UI, the flags that they are mapped to, and SI of the operator's panel; it may set flags."""
    kind, number = place.rstrip("]").split("[")
    where, registers = Indexed(kind, (float(number),)), bench.controller.registers
    before = registers.read(where)
    assert before is (name in NORMALLY_ON)
    bench.controller.write_input(name, not before)
    assert registers.read(where) is not before
    if kind == "F":
        registers.write(where, before)
        assert (name in bench.controller.snapshot().inputs) is before


def test_a_program_reads_the_outputs_by_their_numbers(bench: Bench) -> None:
    """UO[1] to UO[10], and RO[1] of the gripper."""
    registers, outputs = bench.controller.registers, bench.now.outputs
    found = [registers.read(Indexed("UO", (float(n),))) for n in range(1, 11)]
    assert found == [getattr(outputs, name) for name in UO] and True in found and False in found
    registers.write(Indexed("RO", (1.0,)), True)
    assert registers.read(Indexed("RO", (1.0,))) is bench.run(0.01).outputs.gripper is True


def test_clock_wraps_to_zero(bench: Bench) -> None:
    """clock_ms is a positive int32 for ever."""
    import msgspec

    clock = msgspec.structs.replace(bench.config.plant.clock, boot_offset_ms=2**31 - 3)
    plant = msgspec.structs.replace(bench.config.plant, clock=clock)
    late = type(bench)(msgspec.structs.replace(bench.config, plant=plant), bench.robot, {})
    clocks = [late.run(0.002).clock_ms for _ in range(3)]
    assert clocks == [2**31 - 1, 1, 3]
