"""What is not set on a robot is found by reading, gap by gap, with the menu that closes it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

import msgspec
import pytest
from fanuc_emulator.config import load_emulator
from fanuc_emulator.snpx.assignments import AssignmentTable
from harness.emulated.served import CONFIG, LAYOUT, ROBOT, running, served
from robot_doctor.doctor_node import _robot
from robot_doctor.finding import Finding, Level
from robot_doctor.profile_files_io import read_profile
from robot_doctor.set_up_checks import _position
from scara_config.frames import NO_FRAMES, FrameTable, TaughtFrame, find_frames
from scara_config.profile import CHOICE, DEFAULT_PLANT
from scara_config.set_up.kit_map import kit_map
from scara_config.set_up.settings import SETTINGS, setting
from scara_config.set_up.slots import FRAMES, slot_table
from twin_controller.config import load_twin_controller

CONTROLLER = load_twin_controller(ROBOT, CONFIG)
# This machine's own delays are no silence of the robot.
CONTROLLER = msgspec.structs.replace(
    CONTROLLER, real=msgspec.structs.replace(CONTROLLER.real, timeout_ms=1000.0)
)
PROFILE = read_profile(CONFIG)
ROUNDING = 1e-6
"""A drive that holds its axis moves it by less [rad or m]."""


@dataclass
class Seen:
    """What came of a look at a robot."""

    findings: list[Finding]
    writes: int
    moved: bool

    @property
    def wrong(self) -> list[Finding]:
        """The gaps."""
        return [finding for finding in self.findings if finding.level is Level.WRONG]


def look(
    settings: str,
    mistype: Callable[[AssignmentTable], None] = lambda _: None,
    taught: FrameTable = NO_FRAMES,
) -> Seen:
    """Let the doctor look at a robot."""
    with served(settings, mistype) as (port, loop, written):
        before = loop.snapshot.positions
        found = list(_robot(PROFILE, LAYOUT, CONTROLLER, ("127.0.0.1", port), False, taught))
        way = max(abs(a - b) for a, b in zip(loop.snapshot.positions, before))
        return Seen(found, len(written), way > ROUNDING)


def slot(number: int, field: str, value: float | str) -> Callable[[AssignmentTable], None]:
    """Return what mistypes one value of a slot."""
    return lambda table: table.put(number, field, value)


READY = "ready"
GAPS: list[tuple[str, str, Callable[[AssignmentTable], None], str, str]] = [
    ("Modbus off", "ready, num_modbus: 0", lambda _: None, "num_modbus", "no Modbus server"),
    ("one client", "ready, num_modbus: 1", lambda _: None, "num_modbus", "1 of 3 clients"),
    ("two clients", "ready, num_modbus: 2", lambda _: None, "num_modbus", "2 of 3 clients"),
    ("no slot", "ready, slots: factory", lambda _: None, "slots", "as delivered"),
    ("no position", READY, slot(3, "$SIZE", 0), "slots", "slot 3 (POS[0]@27.19"),
    ("position elsewhere", READY, slot(3, "$ADDRESS", 1001), "slots", "slot 3 (POS[0]@27.19"),
    ("position whole", READY, slot(3, "$MULTIPLY", 1.0), "slots", "$MULTIPLY must be 0"),
    ("no override", READY, slot(13, "$ADDRESS", 0), "slots", "slot 13 ($MCR.$GENOVERRIDE"),
    ("override real", READY, slot(13, "$MULTIPLY", 0.0), "slots", "$MULTIPLY must be 1"),
    ("not watched", READY, slot(18, "$ADDRESS", 9001), "slots", "slot 18 ($SNPX_PARAM.$NUM_ASG"),
    ("no programs", "ready, programs: none", lambda _: None, "programs", "no background program"),
    ("simple", "ready, uop: simple", lambda _: None, "uop", "UOP is Simple"),
    ("none", "ready, uop: none", lambda _: None, "uop", "UOP is None"),
    ("UI off", "ready, enable_ui: false", lambda _: None, "enable_ui", "are disabled"),
    ("no wire 1", "ready, unwired: [imstp]", lambda _: None, "unwired", "UI[1] *IMSTP"),
    ("no wire 2", "ready, unwired: [hold]", lambda _: None, "unwired", "UI[2] *HOLD"),
    ("no wire 3", "ready, unwired: [sfspd]", lambda _: None, "unwired", "UI[3] *SFSPD"),
    ("no wire 8", "ready, unwired: [enbl]", lambda _: None, "unwired", "UI[8] ENBL"),
    ("T1", "ready, mode: T1", lambda _: None, "mode", "not at AUTO"),
    ("T2", "ready, mode: T2", lambda _: None, "mode", "not at AUTO"),
    ("pendant", "ready, tp_enabled: true", lambda _: None, "tp_enabled", "is enabled"),
    ("local", "ready, remote: false", lambda _: None, "remote", "is Local"),
    ("master", "ready, rmt_master: 1", lambda _: None, "rmt_master", "$RMT_MASTER is 1"),
    ("abort", "ready, cstopi_for_abort: false", lambda _: None, "cstopi_for_abort", "CSTOPI"),
    ("start", "ready, start_for_continue: false", lambda _: None, "start_for_continue", "START"),
    ("RSR off", f"ready, rsr: {[0] * 8}", lambda _: None, "rsr", "RSR1 is disabled"),
    ("RSR number", f"ready, rsr: {[1] * 8}", lambda _: None, "rsr", "RSR1 starts RSR0001"),
    ("user frame", "ready, user_frame: 2", lambda _: None, "user_frame", "user frame 2"),
    ("tool frame", "ready, tool_frame: 3", lambda _: None, "tool_frame", "tool frame 3"),
    ("RSR base", "ready, job_base: 100", lambda _: None, "job_base", "RSR0101 and 100 more"),
]


@pytest.mark.parametrize(
    ("settings", "mistype", "key", "what"),
    [gap[1:] for gap in GAPS],
    ids=[gap[0].replace(" ", "_") for gap in GAPS],
)
def test_a_gap_is_named_with_its_menu_without_a_write_or_a_motion(
    settings: str, mistype: Callable[[AssignmentTable], None], key: str, what: str
) -> None:
    """It alone; and what to set there."""
    seen = look(settings, mistype)
    assert len(seen.wrong) == 1, seen.wrong
    (gap,) = seen.wrong
    row = setting(key)
    assert what in gap.what and row.menu in gap.advice and row.wanted in gap.advice
    assert seen.writes == 0 and not seen.moved


@pytest.mark.parametrize(
    ("low", "high", "whole"),
    [
        (0, 0x0000, False),
        (0, 0x8000, False),
        (0, 0x7FC0, False),
        (0, 0xC120, False),
        (1, 0x0000, True),
        (0xFFFF, 0xFFFF, True),
    ],
)
def test_a_position_of_zero_or_of_no_axis_is_no_whole_number(
    low: int, high: int, whole: bool
) -> None:
    """A joint that counts against its motor stands at -0.0 in its zero position."""
    said = _position((*([low, high] * 8), 0, 0x4120, 1))
    assert said == ("holds whole numbers: $MULTIPLY must be 0" if whole else "")


def test_a_ready_robot_has_no_gap() -> None:
    """And is polled as before; two settings that no client sees are named."""
    seen = look(READY)
    assert seen.wrong == [] and seen.writes == 0
    texts = [finding.what for finding in seen.findings]
    assert "the controller is set up as the kit says" in texts
    assert "two settings cannot be seen from here" in texts


@pytest.mark.parametrize("programs", ["none", "kit"])
def test_what_the_kits_map_cannot_show_of_the_programs_is_told(programs: str) -> None:
    """Its clock is the controller's own: it runs without any program, and without a watchdog."""
    layout = kit_map(LAYOUT)
    config = load_emulator(ROBOT, CONFIG, DEFAULT_PLANT, f"ready, programs: {programs}")
    with running(config, layout=layout, settings=config.settings) as (port, *_):
        found = list(_robot(PROFILE, layout, CONTROLLER, ("127.0.0.1", port), move=False))
    assert [finding for finding in found if finding.level is Level.WRONG] == []
    (told,) = [finding for finding in found if "BGTWIN runs cannot be seen" in finding.what]
    assert told.level is Level.NOTE and "--stops tries both" in told.advice
    assert "BG Logic" in told.advice
    texts = [finding.what for finding in found]
    assert "the controller is set up as the kit says" not in texts


def test_each_command_that_is_told_names_the_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the name it would read and write what is fanuc_sr6ia's."""
    layout = kit_map(LAYOUT)
    config = load_emulator(ROBOT, CONFIG, DEFAULT_PLANT, READY)
    other = FrameTable({"uframe_9": TaughtFrame("box", (1.0, 2.0, 3.0))}, {})
    with running(config, layout=layout, settings=config.settings) as (port, *_):
        monkeypatch.setenv(CHOICE, "mine")
        found = list(_robot(PROFILE, layout, CONTROLLER, ("127.0.0.1", port), False, other))
    advice = "\n".join(finding.advice for finding in found)
    told = re.findall(r"rosrun (?:fanuc_kit|robot_doctor) [^`;\n]*", advice)
    assert {command.split()[1] for command in told} == {"fanuc_kit", "robot_doctor"}
    assert [command for command in told if "--robot mine" not in command] == []


def test_a_missing_slot_of_the_mode_switch_is_named() -> None:
    """It reads T1, at a robot that is in AUTO."""
    (gap,) = look(READY, slot(8, "$ADDRESS", 9001)).wrong
    assert "slot 8 (SI[8]" in gap.what and "does not show the mode switch" in gap.what


def test_frames_that_no_slot_shows_are_looked_up_at_the_robot() -> None:
    """Slots that were typed before they were asked for are no gap; what to look at is said."""
    assert "$MNUTOOLNUM[1]" in str(look("ready, tool_frame: 0").findings)
    seen = look(READY, slot(32, "$ADDRESS", 9001))
    assert seen.wrong == [] and seen.writes == 0
    (told,) = [found for found in seen.findings if "$MNUTOOLNUM[1]" in found.what]
    assert told.level is Level.NOTE and "slot 32" in told.what
    assert "User Frame > SETIND: 0" in told.advice and "Tool Frame > SETIND: 1" in told.advice


def test_frames_of_robot_and_file_are_compared() -> None:
    """The stand-in has the file's own; a note is enough: joints need none."""
    ours = find_frames(CONFIG)
    assert not [found for found in look(READY, taught=ours).findings if "UFRAME" in found.what]
    moved = TaughtFrame("pallet", (50.0, -450.0, -41.5))
    other = FrameTable({**ours.user, "uframe_1": moved}, ours.tool)
    shown = slot_table(LAYOUT).index(FRAMES["user"]) + 1
    (told,) = [found for found in look(READY, taught=other).findings if "UFRAME" in found.what]
    assert told.level is Level.NOTE and "fanuc_kit frames ADDRESS --save" in told.advice
    assert told.what == ("UFRAME[1] (pallet): robot X 50 Y -450 Z -40; here X 50 Y -450 Z -41.5")
    for mistype, what in (
        (slot(shown, "$SIZE", 0), "the robot's frames read 0, those of frames.yaml are not there"),
        (slot(shown, "$MULTIPLY", 1000.0), "$MNUFRAME[1,1]@1.12: frame 1 reads (7"),
    ):
        (told,) = [found for found in look(READY, mistype, ours).findings if what in found.what]
        assert told.level is Level.NOTE and told.advice


def test_a_delivered_robot_is_led_through_gap_by_gap() -> None:
    """What is closed first is named first; behind the table all others show at once."""
    nobody = look("delivered").wrong[0].what
    assert "no Modbus server" in nobody and "127.0.0.1:" in nobody
    assert "as delivered" in look("delivered, num_modbus: 8").wrong[0].what
    found = look("delivered, num_modbus: 8, slots: kit, programs: kit").wrong
    named = {row.key for row in SETTINGS for gap in found if row.menu in gap.advice}
    hidden = {"imstp_assigned", "select_mode"}
    missing = {"mode", "tp_enabled", "remote", "cstopi_for_abort", "start_for_continue", "rsr"}
    assert missing <= named and not hidden & named


def test_a_robot_that_is_only_followed_needs_less() -> None:
    """One client; and what only leading needs is but to be looked at."""
    profile = msgspec.structs.replace(PROFILE, robot=msgspec.structs.replace(ROBOT, lead=False))
    with served("ready, num_modbus: 1, remote: false, uop: simple") as (port, _, _):
        found = list(_robot(profile, LAYOUT, CONTROLLER, ("127.0.0.1", port), move=False))
    assert [finding for finding in found if finding.level is Level.WRONG] == []
    assert any("the robot is Local" in finding.what for finding in found)
