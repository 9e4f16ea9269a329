"""How the stand-in's controller was set up: delivered, ready, and each thing between them."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import msgspec
import pytest
from fanuc_emulator.config import load_programs
from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.settings import ControllerSettings, load_settings
from fanuc_emulator.snapshot import ControlType, Snapshot
from fanuc_emulator.snpx.access import AssignedRegisters
from fanuc_emulator.tp.executor import ProgramState
from harness.workspace import ROOT
from scara_config import ConfigError
from scara_config.modbus_map import load_modbus_map
from scara_config.profile import CHOICE
from scara_config.set_up.settings import SETTINGS, WATCHED_COUNT, Watched, watched_of
from scara_config.set_up.slots import WATCHED

if TYPE_CHECKING:
    from conftest import Bench

CONFIG = ROOT / "config"
LAYOUT = load_modbus_map(CONFIG)
READY, DELIVERED = load_settings(CONFIG, "ready"), load_settings(CONFIG, "delivered")


def robot_of(bench: Bench, settings: ControllerSettings) -> Bench:
    """Return a freshly booted robot that was set up so."""
    config = msgspec.structs.replace(bench.config, settings=settings)
    made = type(bench)(config, bench.robot, load_programs(bench.robot))
    made.run(0.01)
    return made


def words_of(bench: Bench, address: int, count: int) -> list[int]:
    """Read registers as a client does."""
    image = RegisterImage(LAYOUT, bench.robot)
    registers = AssignedRegisters(LAYOUT, image, (), bench.config.settings)
    image.show(bench.now)
    return registers.read(address - 1, count, bench.now)


def watched(bench: Bench) -> Watched:
    """Read how the robot is set up, as the doctor does."""
    return watched_of(words_of(bench, WATCHED[0].address, WATCHED_COUNT))


@pytest.mark.parametrize("robot", ["fanuc_sr6ia", "fanuc_sr3ia", "scara_4axis", "articulated_six"])
def test_each_robot_has_both_files(robot: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ready is what tests and demo run on."""
    monkeypatch.setenv(CHOICE, robot)
    assert load_settings(CONFIG, "delivered") != load_settings(CONFIG, "") == READY


def test_a_run_names_a_file_and_what_differs() -> None:
    """The file first; what is not named stays as filed."""
    found = load_settings(CONFIG, "delivered, num_modbus: 8, uop: full")
    assert (found.num_modbus, found.uop, found.slots) == (8, "full", "factory")
    with pytest.raises(ConfigError, match=r"unknown settings 'redy': .* did you mean ready\?"):
        load_settings(CONFIG, "redy")
    with pytest.raises(ConfigError, match="settings: ready: unknown, allowed are"):
        load_settings(CONFIG, "delivered, ready")


def test_every_setting_that_differs_is_on_the_kits_sheet() -> None:
    """What a person sets is what the stand-in needs to be ready, and nothing is forgotten."""
    fields = set(ControllerSettings.__struct_fields__) - {"shortest_pulse_ms"}
    assert {row.key for row in SETTINGS} == fields
    assert len(SETTINGS) == len(fields)
    assert all(row.menu and row.wanted and row.why for row in SETTINGS)


def test_a_ready_robot_shows_how_it_is_set_up(bench: Bench) -> None:
    """By the slots that the kit adds, without a write."""
    found = watched(robot_of(bench, READY))
    assert found.there and found.numbers["$SNPX_PARAM.$NUM_MODBUS"] == 8
    assert list(found.differ()) == []
    assert found.si[2] and found.si[8] and found.si[9] and found.so[0] and not found.so[7]
    assert found.ui[:3] == (True,) * 3 and found.uo[:3] == (True, True, False)


def test_a_delivered_robot_shows_nothing(bench: Bench) -> None:
    """Its table has one slot; R[1] stands at 1."""
    robot = robot_of(bench, DELIVERED)
    assert not watched(robot).there
    assert words_of(robot, 11001, 46) == [0] * 46
    assert words_of(robot, 1, 1) == [0]


def test_without_the_kits_programs_only_what_the_controller_itself_has_is_there(
    bench: Bench,
) -> None:
    """Position, override and program; no clock, no speeds, no watchdog."""
    robot = robot_of(bench, msgspec.structs.replace(READY, programs="none"))
    robot.controller.write_heartbeat(7)
    robot.run(1.0)
    assert words_of(robot, 11005, 2) == [0, 0xC320] and words_of(robot, 11019, 1) == [1]
    assert words_of(robot, 11020, 27) == [0] * 27
    assert words_of(robot, 11101, 1) == [robot.config.cold_start_override_percent]
    assert robot.now.heartbeat == 0 and robot.now.alarm is None


@pytest.mark.parametrize(
    ("change", "why"),
    [
        ({"mode": "T1"}, "the mode is T1"),
        ({"mode": "T2"}, "the mode is T2"),
        ({"tp_enabled": True}, "the teach pendant is enabled"),
        ({"remote": False}, "Remote/Local setup is Local"),
        ({"rmt_master": 2}, r"\$RMT_MASTER is 2"),
        ({"select_mode": "PNS"}, "Program select mode is PNS"),
        ({"rsr": (0,) * 8}, "RSR1 is disabled"),
        ({"rsr": (1,) * 8}, "there is no program RSR0001"),
        ({"job_base": 100}, "there is no program RSR0201"),
        ({"programs": "none"}, "there is no program RSR0101"),
    ],
)
def test_what_is_not_set_starts_no_stream(
    bench: Bench, change: dict[str, object], why: str
) -> None:
    """The robot says why in its alarm; the remote conditions show in CMDENBL."""
    robot = robot_of(bench, msgspec.structs.replace(READY, **change))
    robot.pulse("rsr1")
    robot.run(0.5)
    alarm = robot.now.alarm
    assert robot.now.control_type is ControlType.NONE
    assert alarm is not None and re.search(why, alarm.cause), alarm
    assert robot.now.outputs.cmdenbl is not bool(robot.config.settings.local)


def test_a_paused_program_goes_on_in_remote_alone(bench: Bench) -> None:
    """START is a start from outside too; the pendant's key is not."""
    robot = robot_of(bench, msgspec.structs.replace(READY, remote=False))
    robot.pulse("panel_run2")
    robot.run(0.5)
    robot.controller.write_input("hold", False)
    robot.run(0.5)
    robot.controller.write_input("hold", True)
    robot.pulse("start")
    robot.run(0.2)
    assert robot.now.program_state is ProgramState.PAUSED
    robot.pulse("panel_start")
    robot.run(0.2)
    assert robot.now.program_state is ProgramState.RUNNING


@pytest.mark.parametrize("change", [{"mode": "T1"}, {"tp_enabled": True}, {}])
def test_a_strobe_selects_a_program_in_remote_alone(
    bench: Bench, change: dict[str, object]
) -> None:
    """A START that comes when the robot is in AUTO starts nothing that was selected in T1."""
    simple = {"uop": "simple", "start_for_continue": False}
    robot = robot_of(bench, msgspec.structs.replace(READY, **simple, **change))
    robot.controller.write_input("rsr2", True)
    robot.controller.write_input("pnstrobe", True)
    robot.run(0.3)
    robot.controller.write_input("rsr2", False)
    robot.controller.write_input("pnstrobe", False)
    for key in ("panel_t1", "panel_auto", "panel_reset"):
        robot.pulse(key)
        robot.run(0.5)
    robot.pulse("start")
    robot.run(0.2)
    assert (robot.now.program_name, robot.now.program_state) == (
        ("", ProgramState.ABORTED) if change else ("ARTICLE", ProgramState.RUNNING)
    )


@pytest.mark.parametrize(
    ("change", "held"),
    [({"enable_ui": False}, False), ({"uop": "none"}, False), ({}, True)],
)
def test_disabled_inputs_stop_nothing(bench: Bench, change: dict[str, object], held: bool) -> None:
    """Nor hold the robot."""
    robot = robot_of(bench, msgspec.structs.replace(READY, **change))
    robot.controller.write_input("hold", False)
    robot.run(0.1)
    now: Snapshot = robot.now
    assert ("hold" not in now.inputs) is held


def test_an_input_without_a_wire_is_off_until_a_client_writes_it(bench: Bench) -> None:
    """*IMSTP keeps the drives off then."""
    robot = robot_of(bench, msgspec.structs.replace(READY, unwired=("imstp",)))
    assert not robot.now.outputs.sysrdy and robot.now.outputs.fault
    robot.controller.write_input("imstp", True)
    robot.pulse("fault_reset")
    robot.run(1.0)
    assert robot.now.outputs.sysrdy and not robot.now.outputs.fault
