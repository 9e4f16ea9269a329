"""$SNPX_ASG without a wire: entries, words, what a client assigns and reads then."""

from __future__ import annotations

import struct
from collections.abc import Sequence
from itertools import product
from typing import TYPE_CHECKING

import msgspec
import pytest
from fanuc_emulator.register_image import RegisterImage
from fanuc_emulator.registers import NoRegisterError, RegisterError, Value
from fanuc_emulator.settings import ControllerSettings, load_settings
from fanuc_emulator.snpx.access import AssignedRegisters
from fanuc_emulator.snpx.assignments import AssignmentError, AssignmentTable, power_up
from fanuc_emulator.snpx.variables import parse
from fanuc_emulator.uop import INPUTS
from harness.yaml_files import CONFIG
from hypothesis import given
from hypothesis import strategies as st
from scara_config.frames import MOST, Kind
from scara_config.loader import ConfigError
from scara_config.modbus_map import load_modbus_map
from scara_config.set_up.slots import FRAMES, WATCHED, Assignment, frames_of

if TYPE_CHECKING:
    from conftest import Bench

LAYOUT = load_modbus_map(CONFIG)
SETTINGS = msgspec.structs.replace(
    load_settings(CONFIG, ""), rsr=(101, 0, 103, 0, 0, 0, 0, 108), job_base=7, num_modbus=5
)


class Client:
    """Reads and writes as a driver does, by numbers counted from 1, without a wire."""

    def __init__(self, bench: Bench, settings: ControllerSettings = SETTINGS) -> None:
        self.image = RegisterImage(LAYOUT, bench.robot)
        self.inputs = [False] * 512
        self.registers = AssignedRegisters(LAYOUT, self.image, self.inputs, settings)
        self.bench = bench
        if settings != SETTINGS:
            config = msgspec.structs.replace(bench.config, settings=settings)
            self.bench = type(bench)(config, bench.robot, {})

    def read(self, number: int, count: int) -> list[int]:
        """Read holding registers."""
        self.image.show(self.bench.now)
        return self.registers.read(number - 1, count, self.bench.now)

    def write(self, number: int, words: Sequence[int]) -> list[tuple[str, Value]]:
        """Write holding registers."""
        return self.registers.write(number - 1, words, self.bench.now)

    def assign(self, slot: int, address: int, size: int, name: str, multiply: float) -> None:
        """Assign by entry 80, one value after the other: as published drivers do it."""
        fields = {"ADDRESS": int32(address), "SIZE": int32(size), "VAR_NAME": text(name)}
        for field, words in (fields | {"MULTIPLY": float32(multiply)}).items():
            self.point_at(slot, field)
            self.write(16000, words)
            assert self.read(16000, len(words)) == words, "as a driver checks what it has written"

    def point_at(self, slot: int, field: str) -> None:
        """Let entry 80 show a field of an entry at 16000."""
        words, factor = {"VAR_NAME": (40, -1.0), "MULTIPLY": (2, 0.0)}.get(field, (2, 1.0))
        name = text(f"$SNPX_ASG[{slot}].${field}")
        self.write(16300, [*int32(16000), *int32(words), *name, *float32(factor)])


@pytest.fixture
def client(bench: Bench) -> Client:
    """Return a client of a freshly booted robot."""
    return Client(bench)


def int32(value: int) -> list[int]:
    """Return the words of a whole number, the low one first."""
    return list(struct.unpack("<2H", struct.pack("<i", value)))


def float32(value: float) -> list[int]:
    """Return the words of a number, the low one first."""
    return list(struct.unpack("<2H", struct.pack("<f", value)))


def text(value: str, words: int = 40) -> list[int]:
    """Return the words of a text, the first character in the high byte."""
    return list(struct.unpack(f">{words}H", value.encode().ljust(2 * words, b"\0")))


def of_text(words: Sequence[int]) -> str:
    """Return the text of words."""
    return struct.pack(f">{len(words)}H", *words).decode("latin-1").split("\0")[0]


NAMES_78_79 = text("$SNPX_ASG[80].$SIZE") + text("$SNPX_ASG[80].$VAR_NAME")


def test_power_up_content_is_the_map() -> None:
    """Behind slot 1 as delivered; 76 to 79 show entry 80 from 16300 on."""
    entries = power_up(LAYOUT)
    assert len(entries) == 80 and entries[0] == Assignment(1, 10000, "R[1]@1.1", 1.0)
    kits = (*WATCHED, *FRAMES.values())
    assert sum(entry.size for entry in entries[1:75] if entry not in kits) == sum(
        register.words for register in LAYOUT.holding_registers.values()
    )
    assert entries[1] == Assignment(10983, 18, "$MOR_GRP[1].$CUR_DIS_TRQ[1]", 0.0)
    assert entries[2] == Assignment(11001, 19, "POS[0]@27.19", 0.0)
    assert entries[75:79] == [
        Assignment(16300, 2, "$SNPX_ASG[80].$ADDRESS", 1.0),
        Assignment(16302, 2, "$SNPX_ASG[80].$SIZE", 1.0),
        Assignment(16304, 40, "$SNPX_ASG[80].$VAR_NAME", -1.0),
        Assignment(16344, 2, "$SNPX_ASG[80].$MULTIPLY", 0.0),
    ]


def test_at_power_up_every_register_reads_as_the_image_has_it(client: Client) -> None:
    """The table changes nothing for who knows modbus_map.yaml."""
    client.bench.pulse("rsr3")
    client.bench.run(0.3)
    for register in LAYOUT.holding_registers.values():
        words = client.read(register.address, register.words)
        assert words == client.image.read("holding_registers", register.offset, register.words)


def test_a_drivers_own_layout_is_read(client: Client) -> None:
    """One after the other from 1 on, the rest emptied, as fanuc-hmi-jointstreaming does."""
    layout = [(1000, "ALM[1]", -1.0), (360, "PRG[1]", -1.0), (0, "", 1.0), (400, "R[1]", 1.0)]
    layout += [(19, "POS[0]@27.19", 0.0), (19, "PR[1]@27.19", 0.0)]
    address, at = 1, {}
    for slot, (size, name, multiply) in enumerate(layout, start=1):
        client.assign(slot, address, size, name, multiply)
        at[name] = address
        address += size
    for slot in range(len(layout) + 1, 76):
        client.assign(slot, 0, 0, "", 1.0)
    bench = client.bench
    bench.pulse("rsr3")
    bench.run(0.3)
    words = client.read(at["POS[0]@27.19"], 18)
    position = struct.unpack("<9f", struct.pack("<18H", *words))
    for measured, joint in zip(bench.now.measured_positions, bench.robot.joints):
        axis = joint.axis_number - 1
        assert position[axis] == pytest.approx(measured / joint.scale, rel=1e-6)
    assert client.read(at["POS[0]@27.19"] + 18, 1) == [1]
    program = client.read(at["PRG[1]"], 18)
    assert of_text(program[:8]) == of_text(program[10:]) == "TWO_POINT"
    assert program[8] > 0 and program[9] == 2
    assert client.read(at["PRG[1]"] + 18, 18) == [0] * 18
    assert client.read(at["ALM[1]"], 100)[:2] == [0, 0]
    bench.controller.write_input("imstp", False)
    bench.run(0.01)
    alarm = client.read(at["ALM[1]"], 100)
    assert alarm[0] > 0 and alarm[4] > 0 and 1 <= alarm[6] <= 12
    assert of_text(alarm[11:51])
    touched = client.write(at["PR[1]@27.19"], [*float32(1.5), *float32(-2.0), *[0] * 14, 1])
    setpoint = dict(touched)["setpoint"]
    assert setpoint[:3] == (1.5, -2.0, 0.0) and dict(touched)["setpoint_valid"] == (1,)
    assert client.read(1900, 1) == [0], "nothing is assigned to it"
    assert client.write(1900, [7]) == [] and client.registers.unassigned(1899, 1) == "1900 to 1900"


@pytest.mark.parametrize(
    ("name", "multiply", "changes", "words"),
    [
        ("POS[0]@31.2", 0.0, {}, float32(-160.0)),
        ("POS[0]@31.2", 100.0, {}, int32(-16000)),
        ("POS[0]@1.18", 0.0, {}, [0] * 18),
        ("POS[0]@26.1", 1.0, {}, [0]),
        ("POS[0]@45.1", 1.0, {}, [1]),
        ("$MCR.$GENOVERRIDE", 1.0, {}, int32(100)),
        ("$MCR.$GENOVERRIDE", 0.0, {}, float32(100.0)),
        ("$SNPX_ASG[77].$ADDRESS", 1.0, {}, int32(16302)),
        ("$SNPX_ASG[77].$VAR_NAME", -1.0, {}, NAMES_78_79),
        ("UI[1]", 1.0, {}, [1, 1, 1, 0, 0, 0, 0, 1, *[0] * 10]),
        ("UI[1]", 0.0, {}, [0b10000111, 0]),
        # A word ends with the last signal that there is.
        ("UI[3]", 0.0, {"prod_start": True}, [0b1000000000100001]),
        ("UI[4]", 0.0, {"prod_start": True}, [0b100000000010000]),
        ("UO[1]", 1.0, {}, [1, 1, 0]),
        ("DI[1]", 0.0, {}, [0b100, 0]),
        ("DI[3]", 1.0, {}, [1, 0]),
        ("DO[1]", 1.0, {}, [0, 0]),
        ("RI[1]", 1.0, {}, [0]),
        ("RO[1]", 1.0, {}, [0]),
        ("PR[99]@27.19", 0.0, {}, [0] * 19),
        ("PRG[100]", -1.0, {}, [0] * 18),
        # How the controller is set up, as its screens show it; nothing behind the last element.
        ("$SHELL_CFG.$NUM_RSR[1]", 1.0, {}, [w for k in SETTINGS.rsr for w in int32(k)]),
        ("$SHELL_CFG.$RSR_ENABLE[1]", 1.0, {}, [w for k in SETTINGS.rsr for w in int32(k > 0)]),
        ("$SHELL_CFG.$JOB_BASE", 1.0, {}, [*int32(7), 0, 0]),
        ("$SHELL_CFG.$USE_ABORT", 1.0, {"cstopi_for_abort": True}, [*int32(1), 0, 0]),
        ("$SHELL_CFG.$USE_ABORT", 1.0, {"cstopi_for_abort": False}, [0] * 4),
        ("$SHELL_CFG.$CONT_ONLY", 1.0, {"start_for_continue": True}, [*int32(1), 0, 0]),
        ("$SHELL_CFG.$CONT_ONLY", 1.0, {"start_for_continue": False}, [0] * 4),
        ("$OPWORK.$UOP_DISABLE", 1.0, {"enable_ui": True}, [0] * 4),
        ("$OPWORK.$UOP_DISABLE", 1.0, {"enable_ui": False}, [*int32(1), 0, 0]),
        ("$RMT_MASTER", 1.0, {"rmt_master": 2}, [*int32(2), 0, 0]),
        ("$SNPX_PARAM.$NUM_ASG", 1.0, {}, [*int32(80), 0, 0]),
        ("$SNPX_PARAM.$NUM_MODBUS", 1.0, {}, [*int32(5), 0, 0]),
        ("SI[0]", 1.0, {}, [0, 0, 1, 1, *[0] * 4, 1, 1, *[0] * 6, 0]),
        ("SI[0]", 1.0, {"mode": "T1"}, [0, 0, 1, 1, *[0] * 13]),
        ("SI[0]", 1.0, {"mode": "T2", "remote": False}, [0, 0, 0, 1, *[0] * 5, 1, *[0] * 7]),
        ("SI[3]", 1.0, {"panel_hold": False}, [0]),
        # UI[2] is another input than the panel's, and SO[2] shows both.
        ("SI[3]", 1.0, {"hold": False}, [1]),
        ("SO[0]", 1.0, {}, [1, *[0] * 16]),
        ("SO[0]", 1.0, {"tp_enabled": True}, [*[0] * 7, 1, *[0] * 9]),
        ("SO[1]", 1.0, {"panel_run1": True}, [1]),
        ("SO[1]", 1.0, {"panel_run1": True, "uop": "none"}, [1]),
        ("SO[2]", 1.0, {"panel_hold": False}, [1]),
        ("SO[2]", 1.0, {"hold": False}, [1]),
        ("SO[2]", 1.0, {"panel_hold": False, "uop": "none"}, [1]),
        # SO[3] is the lamp of a fault, as UO[6]: a start that is refused lights neither.
        ("SO[3]", 1.0, {"imstp": False}, [1]),
        ("SO[3]", 1.0, {"panel_imstp": False, "uop": "none"}, [1]),
        ("SO[3]", 1.0, {"mode": "T1", "rsr1": True}, [0]),
        ("UO[6]", 1.0, {"mode": "T1", "rsr1": True}, [0]),
        # RO[1] is the gripper; nothing else of RI and RO is wired here.
        ("RO[1]", 1.0, {"gripper": True}, [1, *[0] * 7]),
        ("RI[1]", 1.0, {"gripper": True}, [0] * 8),
    ],
)
def test_a_variable_is_read_by_its_form(
    bench: Bench, name: str, multiply: float, changes: dict[str, object], words: list[int]
) -> None:
    """By 0 a float32, else int32 of the value times it; signals one or sixteen a word."""
    signals = {key: changes[key] for key in changes if key in (*INPUTS, "gripper")}
    settings = {key: changes[key] for key in changes if key not in signals}
    client = Client(bench, msgspec.structs.replace(SETTINGS, **settings))
    client.inputs[2] = True
    # The axes come to rest first: until then SO[1] says busy.
    client.bench.run(0.1)
    for signal, level in signals.items():
        client.bench.controller.write_input(signal, level)
        client.bench.run(0.01)
    client.assign(1, 5000, len(words), name, multiply)
    assert client.read(5000, len(words)) == words


def test_the_fast_clock_counts_2_ms(client: Client) -> None:
    """A clock without a background program; it goes on between two readings."""
    client.assign(1, 5000, 2, "$FAST_CLOCK", 1.0)
    before = client.read(5000, 2)[0]
    stamp = client.bench.now.clock_ms
    client.bench.run(0.1)
    client.bench.now = msgspec.structs.replace(client.bench.now, clock_ms=stamp)
    assert client.read(5000, 2)[0] - before == 50


@pytest.mark.parametrize(
    ("form", "multiply", "given", "shown"),
    [
        ("R[50]", 1.0, int32(-70000), -70000.0),
        ("R[50]", 100.0, int32(-725), -7.25),
        ("R[50]", 0.0, float32(-7.25), -7.25),
        ("R[50]@1.1", 1.0, [0x10000 - 7], -7.0),
        ("R[50]@1.1", 1.0, [3], 3.0),
        ("PR[50]@27.2", 0.0, float32(12.5), None),
        # a register of the map, in another form than it has there
        ("PR[1]@29.2", 100.0, int32(-1234), None),
    ],
)
def test_a_written_variable_is_one_value_in_all_forms(
    client: Client, form: str, multiply: float, given: list[int], shown: float | None
) -> None:
    """What is written by one entry is read by another, in its form."""
    client.assign(1, 5000, len(given), form, multiply)
    client.assign(2, 6000, 2, form.partition("@")[0], 0.0)
    # A negative number of one word is replaced whole: its high word goes with the low one.
    for words in ([0xBFF9] * len(given), given):
        client.write(5000, words)
    assert client.read(5000, len(given)) == given
    if shown is not None:
        assert client.read(6000, 2) == float32(shown)


def test_registers_of_the_map_keep_their_meaning_wherever_they_are_assigned(client: Client) -> None:
    """R[1] is the heartbeat, R[2] the speed of the stream, in whatever form they are written.

    Words of the map's own form may stand before and behind those that are converted.
    """
    client.assign(1, 5000, 4, "R[1]", 0.0)
    client.assign(2, 6000, 1, "R[1]@1.1", 1.0)
    client.assign(3, 6001, 2, "R[2]", 0.0)
    client.assign(4, 6003, 1, "R[2]@1.1", 1.0)
    for address, heartbeat, speed in ((5000, float32(12.0), 55), (6000, [13], 56)):
        touched = dict(client.write(address, [*heartbeat, *float32(speed)]))
        assert touched == {"heartbeat": (speed - 43,), "stream_speed": (speed,)}
        assert client.read(11070, 2) == [speed - 43, speed]
    assert client.read(6000, 4) == [13, *float32(56.0), 56]


def test_a_request_is_stored_whole_or_not_at_all(client: Client) -> None:
    """R[1] = 12 would do, R[2] = 101 is outside its range; the whole request is refused."""
    client.assign(1, 5000, 6, "R[1]", 1.0)
    before = client.read(11070, 2)
    with pytest.raises(RegisterError, match=r"stream_speed = 101 is outside \[1, 100\]"):
        client.write(5000, [*int32(12), *int32(101)])
    assert client.read(11070, 2) == before


def test_overlapping_entries_the_lower_number_wins(client: Client) -> None:
    """And what it leaves free is still the other's."""
    client.assign(40, 15000, 4, "R[60]", 1.0)
    client.assign(41, 15000, 6, "R[70]", 1.0)
    client.write(15000, [*int32(1), *int32(2), *int32(3)])
    client.assign(1, 6000, 26, "R[60]", 1.0)
    assert client.read(6000, 4) == [*int32(1), *int32(2)]
    assert client.read(6024, 2) == int32(3), "R[72]"


@pytest.mark.parametrize(
    ("slot", "field", "words", "message"),
    [
        (1, "ADDRESS", int32(16385), r"\$SNPX_ASG\[1\].\$ADDRESS = 16385 is outside"),
        (1, "ADDRESS", int32(-1), r"= -1 is outside \[0, 16384\]"),
        (80, "SIZE", int32(16385), r"\$SNPX_ASG\[80\].\$SIZE = 16385"),
        (80, "SIZE", int32(-1), r"= -1 is outside \[0, 16384\]"),
        (1, "MULTIPLY", float32(-0.5), r"= -0.5 is not 0, -1 or in \[0.0001, 10000\]"),
        (1, "MULTIPLY", float32(0.00009), "= 9e-05 is not 0"),
        (1, "MULTIPLY", float32(10000.5), "is not 0, -1 or in"),
        (1, "MULTIPLY", float32(float("nan")), "nan is not a finite number"),
        (1, "VAR_NAME", text("A" * 38), "is longer than 37 characters"),
        (80, "VAR_NAME", text("R[1]" + " " * 34), "is longer than 37 characters"),
        (1, "VAR_NAME", text("R[0]"), r"'R\[0\]': the index is outside \[1, 200\]"),
        (1, "VAR_NAME", text("$NOT.$THERE"), "is no variable of the stand-in"),
    ],
)
def test_an_entry_out_of_range_is_refused(
    client: Client, slot: int, field: str, words: list[int], message: str
) -> None:
    """The entry stays as it was."""
    client.point_at(slot, field)
    before = client.registers.table[slot]
    with pytest.raises(AssignmentError if "nan" not in message else RegisterError, match=message):
        client.write(16000, words)
    assert client.registers.table[slot] == before


@pytest.mark.parametrize(
    ("field", "least", "largest"),
    [
        ("$ADDRESS", 0, 16384),
        ("$SIZE", 0, 16384),
        ("$MULTIPLY", 0.0001, 10000.0),
        ("$VAR_NAME", "", "$SNPX_ASG[11].$ADDRESS@001.002"),
    ],
)
def test_the_ends_of_an_entrys_ranges_are_taken(
    field: str, least: float | str, largest: float | str
) -> None:
    """In the first entry and the last; there is none behind it."""
    table = AssignmentTable(power_up(LAYOUT))
    for slot, value in product((1, 80), (least, largest)):
        version = table.version
        table.put(slot, field, value)
        assert table.value(slot, field) == value and table.version != version
    with pytest.raises(IndexError):
        table[81]


@pytest.mark.parametrize(
    "name", ["POS[0]", "ALM[1]", "PRG[1]", "UI[1]", "DO[1]", "$FAST_CLOCK", "PR[1]", "R[8]"]
)
def test_what_the_robot_alone_knows_is_read_only(client: Client, name: str) -> None:
    """Position, alarm, program, signals, the Cartesian form, what a background program keeps."""
    client.assign(1, 5000, 2, name, 1.0)
    client.read(5000, 2)
    with pytest.raises(NoRegisterError):
        client.write(5000, [0, 0])


@given(
    words=st.lists(st.integers(0, 0xFFFF), min_size=46, max_size=46),
    size=st.integers(0, 200),
    address=st.integers(1, 16384),
)
def test_whatever_a_client_writes_into_an_entry_nothing_else_fails(
    words: list[int], size: int, address: int
) -> None:
    """An entry is changed or refused; what can be read afterwards has as many words."""
    table = AssignmentTable(power_up(LAYOUT))
    before = table[80]
    for field, value in (("$ADDRESS", address), ("$SIZE", size), ("$VAR_NAME", of_text(words))):
        try:
            table.put(80, field, value)
        except AssignmentError:
            continue
    assert table[1] == power_up(LAYOUT)[0]
    assert table[80].name == before.name or parse(table[80].name)


def test_frames_are_read_as_a_program_has_set_them(bench: Bench) -> None:
    """All of a kind in one request; nobody writes them over the wire."""
    registers = AssignedRegisters(
        LAYOUT, RegisterImage(LAYOUT, bench.robot), (), SETTINGS, lambda kind, n: FRAME[kind, n]
    )
    words = {
        kind: registers.read(slot.address - 1, slot.size, bench.now)
        for kind, slot in FRAMES.items()
    }
    assert frames_of(words) == FRAME
    with pytest.raises(NoRegisterError, match=r"\$MNUFRAME\[1,2\] cannot be written"):
        registers.write(FRAMES["user"].address + 11, [0, 0], bench.now)
    words["tool"][1] = 0x7F80
    with pytest.raises(ConfigError, match=r"\$MNUTOOL\[1,1\]@1.12: frame 1 reads \(inf"):
        frames_of(words)


FRAME: dict[tuple[Kind, int], tuple[float, ...]] = {
    (kind, number): (number + 0.125, -450.02, 0.0, 3.25, -7.5, 10.0 * number)
    for kind, most in MOST.items()
    for number in range(1, most + 1)
}


def test_behind_the_last_address_there_is_none(client: Client) -> None:
    """The first that is not there is named, whatever is missing before it."""
    with pytest.raises(NoRegisterError, match=r"^register 65537: there is none behind the last"):
        client.read(65530, 8)


def test_words_of_two_registers_beside_each_other_stay_their_own(client: Client) -> None:
    """The first word of one, then the second of another: together they are neither's."""
    client.assign(1, 5000, 1, "R[50]@1.1", 0.0)
    client.assign(2, 5001, 1, "R[51]@2.1", 0.0)
    client.assign(3, 6000, 4, "R[50]", 0.0)
    client.write(6000, [*float32(1.23), *float32(-4.56)])
    assert client.read(5000, 2) == [float32(1.23)[0], float32(-4.56)[1]]
