"""What is printed is what the doctor asks for; what is written is what was printed."""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec
import pytest
from fanuc_emulator.settings import load_settings
from fanuc_emulator.snpx.assignments import AssignmentTable
from fanuc_kit.frames_node import app as frames
from fanuc_kit.make_node import app as make
from fanuc_kit.read_node import app as read
from fanuc_kit.sheet import Boxes, Sheet, SheetTable, SheetText, html, markdown
from fanuc_kit.slots_io import SlotWriter
from fanuc_kit.write_node import app as write
from harness.emulated.served import CONFIG, LAYOUT, served
from harness.processes import free_port
from harness.yaml_files import copy_configuration
from pymodbus.client import ModbusTcpClient
from scara_config.frames import TaughtFrame, find_frames, save_frame
from scara_config.modbus_map import load_modbus_map
from scara_config.profile import CHOICE
from scara_config.programs.tp.reader import read as read_program
from scara_config.set_up.kit_map import kit_map
from scara_config.set_up.kit_programs import texts as programs
from scara_config.set_up.settings import SETTINGS
from scara_config.set_up.slots import BOOTSTRAP, FRAMES, WAY_IN, delivered_table, slot_table
from twin_controller.modbus.port_io import LinkLostError
from typer.testing import CliRunner


@pytest.fixture(autouse=True)
def own_choice(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forget which robot a command chose."""
    monkeypatch.setenv(CHOICE, "fanuc_sr6ia")


@contextmanager
def delivered(way_in: bool) -> Iterator[tuple[int, AssignmentTable]]:
    """Run a robot as delivered with Modbus on; with slots 76 to 79 typed, or not."""
    tables: list[AssignmentTable] = []

    def typed(table: AssignmentTable) -> None:
        tables.append(table)
        for number, slot in enumerate(WAY_IN if way_in else (), start=76):
            table.put(number, "$ADDRESS", slot.address)
            table.put(number, "$SIZE", slot.size)
            table.put(number, "$VAR_NAME", slot.name)
            table.put(number, "$MULTIPLY", slot.multiply)

    with served("delivered, num_modbus: 8", typed) as (port, _, _):
        yield port, tables[0]


def test_a_map_that_somebody_has_mended_is_not_written_over(tmp_path: Path) -> None:
    """Nor another robot's that it is a link to: the coils that stop a robot stand in it."""
    kit, other = tmp_path / "kit", tmp_path / "other"
    file, link = kit / "modbus_map.yaml", other / "modbus_map.yaml"

    def made(folder: Path) -> tuple[int, str]:
        done = CliRunner().invoke(make, ["fanuc_sr6ia", "--out", str(folder)])
        return done.exit_code, done.output

    assert made(kit)[0] == 0 and made(kit)[0] == 0, "what is as it was made is made again"
    text = file.read_text()
    file.write_text(f"{text}# HOLD is 20002\n")
    other.mkdir()
    link.symlink_to(file)
    for folder in (kit, other):
        code, said = made(folder)
        assert code == 2 and f"{folder / file.name}: is there with other content" in said
        assert "--out" in said
    assert file.read_text() == f"{text}# HOLD is 20002\n"
    assert list(other.iterdir()) == [link], "no sheet either"
    link.unlink()
    link.symlink_to(tmp_path / "none")
    assert made(other)[0] == 0 and link.read_text() == text
    assert not link.is_symlink() and not (tmp_path / "none").exists()


def test_each_command_of_a_sheet_names_the_robot(tmp_path: Path) -> None:
    """Without the name it would read and write what is fanuc_sr6ia's."""
    done = CliRunner().invoke(make, ["fanuc_sr3ia", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    sheets = "".join(path.read_text() for path in tmp_path.glob("*.md"))
    told = re.findall(r"rosrun (?:fanuc_kit|robot_doctor) [^`]*", sheets)
    assert {command.split()[1] for command in told} == {"fanuc_kit", "robot_doctor"}
    assert [command for command in told if "--robot fanuc_sr3ia" not in command] == []


def test_the_kit_has_a_page_for_each_thing_to_do(tmp_path: Path) -> None:
    """Every setting, every slot, every program, and boxes to tick; as a page that prints too."""
    done = CliRunner().invoke(make, ["fanuc_sr6ia", "--out", str(tmp_path / "kit")])
    assert done.exit_code == 0, done.output
    texts = {path.name: path.read_text() for path in (tmp_path / "kit").iterdir()}
    for row in SETTINGS:
        assert row.menu in texts["1_settings.md"] and row.wanted in texts["1_settings.md"]
    for number, slot in enumerate(slot_table(kit_map(LAYOUT)), start=1):
        line = f"| {number} | {slot.address} | {slot.size} | {slot.name} | {slot.multiply:g} |"
        assert (line in texts["2_slots.md"]) == (slot.size > 0), line
    tried = texts["5_acceptance.md"]
    assert tried.count("- [ ]") > 10 and tried.index("--stops") < tried.index("STOP on the page")
    assert all(f"{name}.LS" in texts for name in programs())
    said = texts["4_programs.md"].partition("```")[0]
    assert all(f" {name}" in said for name in ("R[1],", "R[2],", "R[8],", "R[9],", "R[22]"))
    assert "PR[1]," in said and "F[1] to F[18]" in said
    for word in (
        "UI[2]",
        "rack 34",
        "F[1], F[2], F[3], F[8] ON",
        "RSR0101",
        "BGTWIN",
        "sheet 5 of 5",
    ):
        assert word in texts["kit.html"]


TYPED: dict[str, dict[str, object]] = {
    "num_modbus": {"8": 8},
    "slots": {"the sheet of slots": "kit"},
    "programs": {"the sheet of programs": "kit"},
    "uop": {"Full": "full"},
    "imstp_assigned": {"an input of its own": True},
    "unwired": {"assigned to what can be switched on, and on": ()},
    "enable_ui": {"TRUE": True},
    "cstopi_for_abort": {"TRUE": True},
    "start_for_continue": {"TRUE": True},
    "remote": {"Remote": True},
    "rmt_master": {"0": 0},
    "mode": {"AUTO": "AUTO"},
    "tp_enabled": {"OFF": False},
    "select_mode": {"RSR": "RSR"},
    "rsr": {"ENABLE, 101": (101, *range(102, 109))},
    "job_base": {"0": 0},
    "user_frame": {"0": 0},
    "tool_frame": {"1": 1},
}
"""What a person's keys make of the words in the sheet."""


def test_who_types_what_is_printed_makes_a_delivered_robot_ready(tmp_path: Path) -> None:
    """Slots and settings, from the sheets alone."""
    done = CliRunner().invoke(make, ["fanuc_sr6ia", "--out", str(tmp_path)])
    assert done.exit_code == 0, done.output
    table = AssignmentTable(delivered_table())
    for cells in rows(tmp_path / "2_slots.md"):
        number = int(cells[0])
        table.put(number, "$ADDRESS", float(cells[1]))
        table.put(number, "$SIZE", float(cells[2]))
        table.put(number, "$VAR_NAME", cells[3])
        table.put(number, "$MULTIPLY", float(cells[4]))
    assert [table[number] for number in range(1, 81)] == slot_table(kit_map(LAYOUT))
    keys = {row.menu: row.key for row in SETTINGS}
    typed = {
        keys[cells[1]]: TYPED[keys[cells[1]]][cells[2]]
        for cells in rows(tmp_path / "1_settings.md")
    }
    delivered_one = load_settings(CONFIG, "delivered")
    assert msgspec.structs.replace(delivered_one, **typed) == load_settings(CONFIG, "ready")


def rows(sheet: Path) -> list[list[str]]:
    """Return the cells of a sheet's table, without its heads."""
    lines = [line for line in sheet.read_text().splitlines() if line.startswith("|")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]


def test_programs_are_short_and_read_as_they_were_printed() -> None:
    """A person types them."""
    for name, text in programs().items():
        program = read_program(text, name)
        assert program.name == name and len(program.lines) <= 30
    assert "J PR[1] R[2]% CNT100" in programs()["RSR0101"]


def test_a_robot_of_another_maker_has_no_kit(tmp_path: Path) -> None:
    """With the reason; nothing is made, written or read."""
    (tmp_path / "system.va").write_text("")
    for command, word in ((write, "127.0.0.1"), (read, str(tmp_path))):
        done = CliRunner().invoke(command, [word, "--robot", "articulated_six"])
        assert done.exit_code == 2 and "no variables of this maker" in done.output
    done = CliRunner().invoke(make, ["articulated_six", "--out", str(tmp_path / "kit")])
    assert done.exit_code == 2 and "no variables of this maker" in done.output
    assert not (tmp_path / "kit").exists()


def test_a_sheet_is_the_same_in_both_forms() -> None:
    """What is special in one form is escaped in it."""
    blocks = (
        SheetTable(("a|b", "<c>"), (("1", "2"),)),
        SheetText("`t`"),
        SheetText("l\n", typed=True),
        Boxes(("x",)),
    )
    sheet = Sheet("s", "A & B", blocks)
    expected = (
        "# A & B\n\n| a\\|b | <c> |\n| --- | --- |\n| 1 | 2 |\n\n`t`\n\n```\nl\n```\n\n- [ ] x\n"
    )
    assert markdown(sheet) == expected
    page = html("k", [sheet])
    assert (
        "<h1>A &amp; B</h1>" in page
        and "<th>&lt;c&gt;</th>" in page
        and "<li>x</li>" in page
        and "<p><code>t</code></p>" in page
    )


def test_slots_are_written_once_somebody_agrees_and_read_back() -> None:
    """Into a delivered table with its way in; the second time nothing differs."""
    with delivered(way_in=True) as (port, table):
        command = ["127.0.0.1", "--port", str(port)]
        refused = CliRunner().invoke(write, command, input="n\n")
        assert refused.exit_code == 1 and table[2].size == 0
        done = CliRunner().invoke(write, [*command, "--yes"])
        assert done.exit_code == 0 and "29 written; all slots are there" in done.output, done.output
        assert [table[number] for number in range(1, 81)] == slot_table(kit_map(LAYOUT))
        again = CliRunner().invoke(write, command)
        assert "0 written; all slots are there" in again.output


def test_what_is_written_over_is_shown_before() -> None:
    """A panel in production has slots of its own: they are gone once somebody agrees."""
    with delivered(way_in=True) as (port, table):
        table.put(1, "$SIZE", 200.0)
        for field, value in (("$ADDRESS", 11001.0), ("$SIZE", 1.0), ("$VAR_NAME", "DO[1]")):
            table.put(40, field, value)
        refused = CliRunner().invoke(write, ["127.0.0.1", "--port", str(port)], input="n\n")
        assert table[40].name == "DO[1]" and table[1].size == 200
    assert "slot 40: DO[1] at 11001, 1, 1 -> empty" in refused.output
    assert "slot 1: R[1]@1.1 at 1, 200, 1 -> R[1]@1.1 at 1, 10000, 1" in refused.output
    assert "2 of them hold something" in refused.output


def test_without_the_way_in_nothing_is_written() -> None:
    """And it is said what to type first."""
    with delivered(way_in=False) as (port, table):
        done = CliRunner().invoke(write, ["127.0.0.1", "--port", str(port), "--yes"])
        assert done.exit_code == 2 and "slots 76 to 79 are not there" in done.output
        assert [table[number] for number in range(1, 81)] == delivered_table()


def test_nobody_there_is_told() -> None:
    """With what to look at."""
    done = CliRunner().invoke(write, ["127.0.0.1", "--port", str(free_port()), "--yes"])
    assert done.exit_code == 2 and "accepts no connection: is Modbus on?" in done.output


class BrokenPort:
    """A port whose link is lost once it has answered so often."""

    name = "1.2.3.4:502"
    answers = 0

    def __init__(self, *_: object) -> None:
        self.is_open, self.left = False, BrokenPort.answers

    def open(self) -> None:
        """Connect."""
        self.is_open = True

    def close(self) -> None:
        """Disconnect."""
        self.is_open = False

    def write_words(self, *_: object) -> None:
        """Lose the link in its turn."""
        if not self.left:
            raise LinkLostError("the robot is gone")
        self.left -= 1

    def read_words(self, _: object) -> list[int]:
        """Return the beginning of slot 80."""
        return [BOOTSTRAP, 0]


@pytest.mark.parametrize(("answers", "error"), [(0, LinkLostError), (1, KeyError)])
def test_a_link_that_is_lost_is_told_once_and_closed(
    monkeypatch: pytest.MonkeyPatch, answers: int, error: type[Exception]
) -> None:
    """Before the first slot is read, and while something else has gone wrong already."""
    monkeypatch.setattr(BrokenPort, "answers", answers)
    monkeypatch.setattr("fanuc_kit.slots_io.ModbusPort", BrokenPort)
    writer = SlotWriter("1.2.3.4", 502, 1)
    with pytest.raises(error), writer:
        raise KeyError("in between")
    assert not writer._port.is_open  # type: ignore[attr-defined]


@pytest.mark.parametrize("command", [frames, read])
def test_a_file_that_cannot_be_read_is_no_difference(
    command: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Exit code 1 would say that the robot has other frames, or lacks a setting."""

    def refused(path: Path, **_: object) -> str:
        raise PermissionError(13, "Permission denied", str(path))

    (tmp_path / "system.va").write_text("")
    monkeypatch.setattr(Path, "read_text", refused)
    monkeypatch.setattr(Path, "iterdir", refused)
    place = tmp_path if command is read else tmp_path / "system.va"
    done = CliRunner().invoke(command, [str(place)])
    assert done.exit_code == 2 and "Permission denied" in done.output


def test_printouts_of_a_folder_are_read(tmp_path: Path) -> None:
    """The exit code says whether something is missing; another file is no printout."""
    (tmp_path / "system.va").write_text(
        "[*SYSTEM*]$RMT_MASTER  Storage: CMOS  Access: RW  : INTEGER = 3\n"
    )
    (tmp_path / "picture.png").write_bytes(b"\x89")
    done = CliRunner().invoke(read, [str(tmp_path)])
    assert done.exit_code == 1 and "$RMT_MASTER is 3 -> MENU > SYSTEM > Variables" in done.output
    (tmp_path / "system.va").unlink()
    done = CliRunner().invoke(read, [str(tmp_path)])
    assert done.exit_code == 2 and "no printout" in done.output


@pytest.mark.parametrize(
    ("line", "named"), [("UTOOL[1]=PR[9]", False), ("UTOOL[2]=PR[9]", True), ("UTOOL_NUM=1", True)]
)
def test_a_tool_frame_that_a_program_of_the_robot_sets_is_not_judged(
    tmp_path: Path, line: str, named: bool
) -> None:
    """That one; selecting it, or setting another, is no setting."""
    config = tmp_path / "config"
    config.mkdir()
    copy_configuration(config)
    text = programs()["RSR0101"].replace("PR[1]=JPOS", line)
    (config / "programs" / "TOOLS.LS").write_text(text.replace("RSR0101", "TOOLS"))
    (tmp_path / "sysframe.va").write_text(
        "[*SYSTEM*]$MNUTOOL  Storage: SHADOW  Access: RW  : ARRAY[1,1] OF POSITION\n"
        "    [1,1] =\n  Group: 1   Config: N D B, 0, 0, 0\n"
        "  X:     0.000   Y:     0.000   Z:    20.000\n"
    )
    done = CliRunner().invoke(read, [str(tmp_path / "sysframe.va"), "--config-dir", str(config)])
    assert ("no program sets UTOOL[1]" in done.output) is named, done.output


def test_a_program_of_the_robot_that_is_no_utf_8_is_named(tmp_path: Path) -> None:
    """Exit code 1 would say that something is not set."""
    config = tmp_path / "config"
    config.mkdir()
    copy_configuration(config)
    (config / "programs" / "OLD.LS").write_bytes(b"/PROG  OLD\n! gr\xe4n\n")
    (tmp_path / "system.va").write_text("")
    done = CliRunner().invoke(read, [str(tmp_path / "system.va"), "--config-dir", str(config)])
    assert done.exit_code == 2 and "OLD.LS: is not in UTF-8: byte 0xe4" in done.output


def test_the_map_that_is_made_is_that_of_the_slots(tmp_path: Path) -> None:
    """It is read as any other, and asks for what the sheet of slots lays out."""
    folder = tmp_path / "kit"
    done = CliRunner().invoke(make, ["fanuc_sr6ia", "--out", str(folder)])
    assert done.exit_code == 0, done.output
    made = load_modbus_map(folder)
    assert made == kit_map(LAYOUT)
    assert [cells[3] for cells in rows(folder / "2_slots.md")] == [
        slot.name for slot in slot_table(made) if slot.size
    ]


def test_the_kits_slots_show_the_robots_own_gripper() -> None:
    """RO[1] as a word of its own, read over the wire where sheet 2 was typed."""
    layout = kit_map(LAYOUT)
    shown = layout.holding_registers["suction_now"]

    def typed(table: AssignmentTable) -> None:
        for number, slot in enumerate(slot_table(layout), start=1):
            table.put(number, "$ADDRESS", slot.address)
            table.put(number, "$SIZE", slot.size)
            table.put(number, "$VAR_NAME", slot.name)
            table.put(number, "$MULTIPLY", slot.multiply)

    with served("ready", typed) as (port, _, _), ModbusTcpClient("127.0.0.1", port=port) as line:
        for on in (True, False):
            line.write_coil(LAYOUT.coils["gripper"].offset, on)
            found, deadline = None, time.monotonic() + 2.0
            while found != [int(on), 0] and time.monotonic() < deadline:
                found = line.read_holding_registers(shown.offset, count=2).registers
            assert found == [int(on), 0]


def test_frames_of_robot_printout_and_program_are_compared_and_taken_over(tmp_path: Path) -> None:
    """The stand-in has those of its file; what differs is told, and written where it is asked."""
    folder = copy_configuration(tmp_path)
    save_frame(folder, "user", 1, TaughtFrame("pallet", (50.0, -450.0, -41.5)))

    def run(*words: str) -> tuple[int, str]:
        done = CliRunner().invoke(frames, [*words, "--config-dir", str(folder)])
        return done.exit_code, done.output

    told = "UFRAME[1] (pallet): robot X 50 Y -450 Z -40; here X 50 Y -450 Z -41.5"
    with served("ready") as (port, _, written):
        robot = ("127.0.0.1", "--port", str(port))
        code, said = run(*robot)
        assert code == 1 and told in said and "19 frames looked at, 1 differ" in said
        code, said = run(*robot, "--save")
        assert code == 0 and "; 1 written to frames.yaml" in said
        assert run(*robot) == (0, "19 frames looked at, 0 differ\n")
        assert written == []
    assert find_frames(folder).find("user", 1).name == "pallet"
    printed = tmp_path / "SYSFRAME.VA"
    printed.write_text(
        "[*SYSTEM*]$MNUFRAME  Storage: SHADOW  Access: RW  : ARRAY[1,9] OF POSITION\n"
        "     [1,1] = \n  Group: 1   Config: N D B, 0, 0, 0\n"
        "  X:    50.000   Y:  -450.000   Z:   -40.000\n"
        "  W:     0.000   P:     0.000   R:     0.000\n"
        "     [1,9] = \n  Group: 1   Config: N D B, 0, 0, 0\n"
        "  X:     0.000   Y:     0.000   Z:     0.000\n"
        "  W:     0.000   P:     0.000   R:    90.000\n"
    )
    code, said = run(str(printed), "--save")
    assert code == 0 and "UFRAME[9]: file R 90; here never taught" in said
    assert find_frames(folder).find("user", 9).wpr_deg == (0.0, 0.0, 90.0)
    program = tmp_path / "P.LS"
    program.write_text("/PROG P\n/MN\n 1:  !UTOOL[1] Z 120.5 ;\n/POS\n/END\n")
    code, said = run(str(program))
    assert code == 1 and "UTOOL[1] (suction cup): file Z 120.5; here X 0" in said


def test_robot_or_file_that_tells_no_frames_is_named(tmp_path: Path) -> None:
    """Slots that nobody typed; another printout; nobody there."""
    other = tmp_path / "system.va"
    other.write_text("[*SYSTEM*]$RMT_MASTER  Storage: CMOS  Access: RW  : INTEGER = 3\n")
    with delivered(way_in=True) as (port, _):
        for words, why in (
            (("127.0.0.1", "--port", str(port)), "$MNUFRAME[1,1]@1.12 at 13101"),
            ((str(other),), "system.va: tells no frames"),
            ((str(other), "none.va"), "none.va: there is no such file"),
            (("127.0.0.1", "--port", str(free_port())), "127.0.0.1"),
            (
                ("127.0.0.1", "--port", str(port), "--robot", "fanuc_sr3ia"),
                "`rosrun fanuc_kit write 127.0.0.1 --robot fanuc_sr3ia`",
            ),
        ):
            done = CliRunner().invoke(frames, list(words))
            assert done.exit_code == 2 and why in done.output


def test_frames_that_were_not_told_are_not_written_over_taught_ones(tmp_path: Path) -> None:
    """A printout that was cut off within a frame; a slot that nobody typed reads 0."""
    folder = copy_configuration(tmp_path)
    save_frame(folder, "user", 1, TaughtFrame("pallet", (50.0, -450.0, -41.5), (0.0, 0.0, 90.0)))
    save_frame(folder, "tool", 1, TaughtFrame("clamp", (0.0, 0.0, 120.5)))
    before = (folder / "frames.yaml").read_bytes()
    cut = tmp_path / "SYSFRAME.VA"
    cut.write_text(
        "[*SYSTEM*]$MNUFRAME  Storage: SHADOW  Access: RW  : ARRAY[1,9] OF POSITION\n"
        "     [1,1] = \n  Group: 1   Config: N D B, 0, 0, 0\n"
        "  X:    50.000   Y:  -450.000   Z:   -41.500\n"
    )
    tools = slot_table(LAYOUT).index(FRAMES["tool"]) + 1
    with served("ready", lambda table: table.put(tools, "$SIZE", 0)) as (port, _, _):
        for words, why in (
            ((str(cut),), "SYSFRAME.VA: UFRAME[1] tells 3 of X, Y, Z, W, P, R"),
            (("127.0.0.1", "--port", str(port)), "slot of $MNUTOOL is missing"),
        ):
            done = CliRunner().invoke(frames, [*words, "--save", "--config-dir", str(folder)])
            assert done.exit_code == 2 and why in done.output, done.output
            assert (folder / "frames.yaml").read_bytes() == before
