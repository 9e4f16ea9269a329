"""The mode switch: AUTO, T1 and T2, turned by the person at the robot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import msgspec
import numpy as np
import pytest
from fanuc_emulator.config import load_emulator, load_programs
from fanuc_emulator.controller import Controller
from fanuc_emulator.drives.arm import Arm
from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.settings import MODES, Mode
from fanuc_emulator.snapshot import ControlType, Snapshot
from fanuc_emulator.tp.executor import ProgramState
from fanuc_emulator.uop import with_panel
from harness.running.thorough import thorough
from harness.workspace import ROOT
from scara_config.modbus_map import load_modbus_map
from scara_config.programs.tp.listing import Indexed, Name
from scara_config.programs.tp.values import Pose

if TYPE_CHECKING:
    from conftest import Bench

CONFIG = ROOT / "config"
LIMIT = 250.0
"""Of tool and flange in T1 [mm/s], by the maker's manual."""


def turned(bench: Bench, mode: Mode, plant: str = "ideal") -> Bench:
    """Return a robot on which somebody turned the switch, and reset the alarm of that."""
    programs = load_programs(bench.robot)
    there = load_emulator(bench.robot, CONFIG, plant)
    made = type(bench)(bench.config, bench.robot, programs)
    made.config, draws = there, np.random.default_rng(1)
    made.controller = Controller(there, bench.robot, programs, 1.7e9, random=draws)
    made.controller.write_override(100)
    made.pulse(f"panel_{mode.lower()}", 0.03)
    made.run(1.0)
    made.pulse("panel_reset", 0.03)
    made.run(2.0)
    made.history.clear()
    assert made.now.outputs.sysrdy and made.now.alarm is None
    return made


def fastest(bench: Bench, history: list[Snapshot] | None = None, tool: float = 0.0) -> float:
    """Return the largest speed of what is so far aside of the flange [m], by the joints [mm/s]."""
    arm, found = Arm(bench.robot), 0.0
    columns = list(arm.columns)
    for now in history or bench.history:
        q, qdot = np.array(now.positions)[columns], np.array(now.velocities)[columns]
        twist = arm.jacobian(q) @ qdot
        place = arm.pose(q) @ (tool, 0.0, 0.0, 1.0)
        tip = twist[3:] + np.cross(twist[:3], place[:3])
        found = max(found, 1e3 * float(np.linalg.norm(tip)))
    return found


def run_program(bench: Bench, number: int) -> None:
    """Start a program at the pendant and wait for its end."""
    bench.pulse(f"panel_run{number}", 0.03)
    assert bench.now.program_state is ProgramState.RUNNING
    bench.run_until(lambda now: now.program_state is ProgramState.ABORTED, 90.0)


@pytest.mark.parametrize(
    ("mode", "slow", "plant"),
    [
        ("T1", True, "ideal"),
        ("T2", False, "ideal"),
        *thorough(("T1", True, "field"), ("T2", False, "field")),
    ],
)
def test_t1_keeps_every_program_to_250_mm_s(
    bench: Bench, mode: Mode, slow: bool, plant: str
) -> None:
    """At an override of 100 %, by the ground truth; T2 is as fast as it is programmed."""
    robot = turned(bench, mode, plant)
    run_program(robot, 2)
    assert robot.now.override == 100
    assert (0.9 * LIMIT < fastest(robot) <= LIMIT) is slow


@pytest.mark.thorough
def test_a_lower_override_is_slower_in_t1_too(bench: Bench) -> None:
    """It counts on what is left of the programmed speed."""
    robot = turned(bench, "T1")
    robot.controller.write_override(50)
    run_program(robot, 2)
    assert 0.4 * LIMIT < fastest(robot) <= 0.5 * LIMIT


@pytest.mark.parametrize("plant", ["field", *thorough("ideal")])
def test_a_stream_keeps_to_250_mm_s_and_arrives(bench: Bench, plant: str) -> None:
    """Started at the pendant, with a set point that is far away."""
    robot = turned(bench, "T1", plant)
    robot.stream_to("joint_1", robot.now.positions[0])
    robot.pulse("panel_run1", 0.03)
    robot.run(0.3)
    assert robot.now.control_type is ControlType.STREAM
    wanted = robot.now.positions[0] + 0.8
    robot.stream_to("joint_1", wanted)
    robot.run(6.0)
    assert robot.now.positions[0] == pytest.approx(wanted, abs=1e-3)
    assert 0.8 * LIMIT < fastest(robot) <= LIMIT


def test_a_stream_keeps_a_tool_that_is_selected_to_250_mm_s(bench: Bench) -> None:
    """Its tip is 100 mm aside of the flange, which J4 turns where it is."""
    robot = turned(bench, "T1")
    memory = robot.controller.registers
    memory.write(Indexed("UTOOL", (2.0,)), Pose((100.0, *[0.0] * 8), ""))
    memory.write(Name("UTOOL_NUM"), 2.0)
    robot.stream_to("joint_4", robot.now.positions[3])
    robot.pulse("panel_run1", 0.03)
    robot.run(0.3)
    wanted = robot.now.positions[3] + 2.0
    robot.stream_to("joint_4", wanted)
    robot.run(2.0)
    assert robot.now.positions[3] == pytest.approx(wanted, abs=1e-3)
    assert 0.8 * LIMIT < fastest(robot, tool=0.1) <= LIMIT
    memory.write(Name("UTOOL_NUM"), 300.0)
    robot.stream_to("joint_4", 0.0)
    robot.run(0.1)
    assert robot.moving, "no tool has that number: the flange alone counts"


@pytest.mark.parametrize("mode", ["T1", "T2"])
@pytest.mark.parametrize("start", ["rsr1", "rsr2", "start", "prod_start"])
def test_nothing_is_started_by_a_signal(bench: Bench, mode: Mode, start: str) -> None:
    """The robot says why, and shows that no remote start is possible."""
    robot = turned(bench, mode)
    robot.pulse(start)
    robot.run(0.3)
    alarm = robot.now.alarm
    assert alarm is not None and alarm.cause == f"the mode is {mode}"
    assert robot.now.control_type is ControlType.NONE
    assert robot.now.outputs.tpenbl and not robot.now.outputs.cmdenbl


@pytest.mark.parametrize(("mode", "text"), [("T1", "SYST-038"), *thorough(("T2", "SYST-039"))])
def test_who_turns_the_switch_halts_a_running_program(bench: Bench, mode: Mode, text: str) -> None:
    """Its drives go off, it is paused, and RESET alone starts nothing."""
    bench.start_moving()
    bench.pulse(f"panel_{mode.lower()}", 0.03)
    bench.run(0.5)
    now, alarm = bench.now, bench.now.alarm
    assert alarm is not None and alarm.code.text == f"{text} Operation mode {mode} Selected"
    assert not now.outputs.sysrdy and now.outputs.fault and not bench.moving
    assert now.program_state is ProgramState.PAUSED
    bench.pulse("fault_reset")
    bench.run(0.5)
    assert bench.now.outputs.sysrdy and not bench.now.outputs.fault and not bench.moving
    # Let go on at the pendant, by the mode that holds now.
    begin = len(bench.history)
    bench.pulse("panel_start", 0.03)
    bench.run_until(lambda now: now.program_state is ProgramState.ABORTED, 90.0)
    assert (fastest(bench, bench.history[begin:]) <= LIMIT) is (mode == "T1")


def test_a_request_that_waits_does_not_start_in_t1(bench: Bench) -> None:
    """It was asked for in AUTO; the end of the running program starts it no more."""
    bench.start_moving()
    bench.pulse("rsr3")
    bench.pulse("panel_t1", 0.03)
    bench.run(0.5)
    bench.pulse("fault_reset")
    bench.pulse("panel_abort", 0.03)
    bench.run(1.0)
    assert bench.now.program_state is ProgramState.ABORTED
    assert bench.now.program_name == "ARTICLE"


def test_in_auto_again_a_signal_starts_as_before(bench: Bench) -> None:
    """Turned twice, reset once each time; the same mode again is no turn."""
    robot = turned(bench, "T1")
    robot.pulse("panel_auto", 0.03)
    robot.run(0.2)
    assert robot.now.alarm is not None and "AUTO Selected" in robot.now.alarm.code.text
    robot.pulse("fault_reset")
    robot.run(0.1)
    robot.pulse("panel_auto", 0.03)
    assert robot.now.alarm is None
    robot.pulse("rsr2")
    robot.run(0.2)
    assert robot.now.program_state is ProgramState.RUNNING


@pytest.mark.parametrize("mode", MODES)
def test_the_switch_is_told_by_two_bits(bench: Bench, mode: Mode) -> None:
    """SI[8] and SI[9], a register each; the same where the words are read as they stand."""
    robot, layout = turned(bench, mode), load_modbus_map(CONFIG)
    image = RegisterImage(layout, bench.robot)
    image.show(robot.now)
    bits = {"AUTO": [1, 1], "T1": [0, 0], "T2": [0, 1]}
    assert image.read("holding_registers", 11046, 2) == bits[mode]


def test_a_map_without_the_bits_gets_no_switch() -> None:
    """A robot that does not tell its mode has none to turn from its pendant."""
    layout = load_modbus_map(CONFIG)
    held = {name: each for name, each in layout.holding_registers.items() if "mode_b" not in name}
    bare = msgspec.structs.replace(layout, holding_registers=held)
    assert "panel_t1" in with_panel(layout).coils and "panel_t1" not in with_panel(bare).coils
