"""The register map: addresses as the manual counts, widths, no overlap."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import pytest
from harness.followed import FOLLOW_MAP
from harness.workspace import ROOT
from harness.yaml_files import REMOVED, changed_yaml, shipped
from scara_config import ConfigError
from scara_config.map_entries import ENTRIES
from scara_config.modbus_map import ModbusMap, Register, load_modbus_map, problems
from scara_config.set_up.slots import own_slots, slot_problems

SHIPPED = ROOT / "config"
MAP = load_modbus_map(SHIPPED)


@pytest.mark.parametrize(
    ("name", "first", "last"),
    [
        ("position", 11001, 11018),
        ("position_valid", 11019, 11019),
        ("setpoint", 11051, 11068),
        ("override", 11101, 11102),
        ("program_name", 11201, 11208),
        ("alarm_id", 11301, 11301),
        ("alarm_severity_text", 11392, 11400),
    ],
)
def test_registers_stand_where_the_controller_has_them(name: str, first: int, last: int) -> None:
    """The layout of facts.md section 4: POS[0], PR[1], override, PRG[1], ALM[1]."""
    register = MAP.holding_registers[name]
    assert (register.address, register.address + register.words - 1) == (first, last)
    assert register.offset == first - 1, "the PDU address is the number minus one"


def test_state_and_set_point_blocks_fit_one_request_each() -> None:
    """Position, speed and clock belong together. Modbus reads at most 125 registers at once."""

    def span(first: str, last: str) -> int:
        start, end = MAP.holding_registers[first], MAP.holding_registers[last]
        return end.address + end.words - start.address

    assert span("position", "override_now") <= 125
    assert span("setpoint", "stream_speed") <= 123


@pytest.mark.parametrize(
    ("number", "name"), [(1, "imstp"), (2, "hold"), (5, "fault_reset"), (6, "start"), (8, "enbl")]
)
def test_inputs_are_the_user_operator_panel_from_6001(number: int, name: str) -> None:
    """UI[n] is coil 6000 + n."""
    assert MAP.coils[name].address == 6000 + number


@pytest.mark.parametrize(
    ("number", "name"), [(1, "cmdenbl"), (3, "progrun"), (4, "paused"), (6, "fault"), (10, "busy")]
)
def test_outputs_are_the_user_operator_panel_from_6001(number: int, name: str) -> None:
    """UO[n] is discrete input 6000 + n."""
    assert MAP.discrete_inputs[name].address == 6000 + number


@pytest.mark.parametrize(
    ("kind", "count", "words"),
    [("int16", 1, 1), ("int32", 1, 2), ("float32", 9, 18), ("string", 40, 40)],
)
def test_width_follows_from_type_and_count(kind: Any, count: int, words: int) -> None:
    """A string counts words, two characters each."""
    assert Register(address=1, type=kind, unit="", meaning="", count=count).words == words


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        (
            ["holding_registers", "position_valid", "address"],
            11018,
            r"position_valid\.address = 11018: overlaps position, .*11018",
        ),
        (
            ["holding_registers", "position", "count"],
            10,
            r"position_valid\.address = 11019: overlaps position",
        ),
        (["holding_registers", "clock_ms", "address"], 0, r"clock_ms.* = 0: Expected `int` >= 1"),
        (
            ["holding_registers", "clock_ms", "address"],
            65537,
            r"clock_ms.* = 65537: Expected `int` <= 65536",
        ),
        (
            ["holding_registers", "clock_ms", "type"],
            "int64",
            r"clock_ms.* = 'int64': Invalid enum value",
        ),
        (["holding_registers", "clock_ms", "type"], "int16", r"clock_ms = int16: must be int32"),
        (
            ["holding_registers", "clock_ms", "scale"],
            0.1,
            r"clock_ms\.scale = 0\.1: must be a multiple of 0\.5",
        ),
        (
            ["holding_registers", "clock_ms", "meaning"],
            REMOVED,
            r"missing required field `meaning`",
        ),
        (["holding_registers", "clock_ms", "adress"], 5, r"unknown field `adress`"),
        (["coils", "hold", "address"], 6001, r"coils: an address occurs more than once"),
        (
            ["discrete_inputs", "fault", "address"],
            6001,
            r"discrete_inputs: an address occurs more than once",
        ),
        (["holding_registers", "heartbeat"], REMOVED, r"holding_registers\.heartbeat: is missing"),
        (
            ["holding_registers", "override", "type"],
            "float32",
            r"override = float32: must be int16 or int32",
        ),
        (
            ["holding_registers", "override", "write"],
            False,
            r"override: must be a holding register with write: true",
        ),
        (
            ["holding_registers", "setpoint", "count"],
            6,
            r"position, velocity, motor_torque, setpoint = 9, 9, 9, 6 values: must be as many each",
        ),
        (["holding_registers", "ring_read"], REMOVED, r"ring_read: is missing, but ring_setpoint"),
        (
            ["holding_registers", "ring_write", "write"],
            False,
            r"ring_write: must be a holding register with write: true",
        ),
        (
            ["holding_registers", "ring_underruns", "type"],
            "string",
            r"ring_underruns = string: must be int16 or int32",
        ),
        (["holding_registers", "mode_b0"], REMOVED, r"mode_b0: is missing, but mode_b1 is there"),
        (
            ["holding_registers", "mode_b1", "type"],
            "float32",
            r"mode_b1 = float32: must be int16 or int32",
        ),
        (
            ["holding_registers", "ring_setpoint", "count"],
            81,
            r"ring_setpoint\.count = 81: must be 9 for each of ring_clock_ms's 10 places, 90",
        ),
        (
            ["holding_registers", "ring_setpoint", "scale"],
            0.5,
            r"ring_setpoint = float32, scale 0\.5: must be as setpoint, float32, scale 1",
        ),
        (
            ["holding_registers", "ring_clock_ms", "type"],
            "int16",
            r"ring_clock_ms = int16, count 10: must be int32, count 2 to 40",
        ),
        (["coils", "rsr3"], REMOVED, r"coils\.rsr3: is missing"),
        (
            ["coils", "rsr9"],
            {"address": 6019, "meaning": ""},
            r"coils\.rsr9: is unknown, allowed are imstp",
        ),
        (["coils", "cstopi", "pulse_ms"], 0, r"coils\.cstopi\.pulse_ms = 0: must be above 0"),
        (
            ["coils", "rsr1", "pulse_ms"],
            REMOVED,
            r"coils\.rsr1\.pulse_ms = 0: must be above 0, it is pulsed",
        ),
        (["discrete_inputs", "busy"], REMOVED, r"discrete_inputs\.busy: is missing"),
        (["device_id"], 248, r"device_id = 248: Expected `int` <= 247"),
        (["word_order"], "middle", r"word_order = 'middle'"),
    ],
)
def test_wrong_map_is_refused(tmp_path: Path, path: list[str | int], value: Any, text: str) -> None:
    """File, key, value and what is allowed."""
    with pytest.raises(ConfigError, match=rf"modbus_map\.yaml: .*{text}"):
        load_modbus_map(changed_yaml(shipped("modbus_map.yaml"), tmp_path, path, value))


@pytest.mark.parametrize(
    "coil", ["imstp", "hold", "cstopi", "fault_reset", "start", "rsr1", "gripper"]
)
def test_coil_that_stops_or_starts_the_robot_must_be_writable(tmp_path: Path, coil: str) -> None:
    """A map that does not release it is found at the start, not when STOP is pressed."""
    folder = changed_yaml(shipped("modbus_map.yaml"), tmp_path, ["coils", coil, "write"], False)
    with pytest.raises(
        ConfigError, match=rf"modbus_map\.yaml: coils\.{coil}\.write = false: must be true"
    ):
        load_modbus_map(folder)


SIX = SHIPPED / "robots" / "articulated_six" / "modbus_map.yaml"


@pytest.mark.parametrize(
    ("path", "value", "text"),
    [
        (
            ["status_word", "register"],
            "nothing",
            r"status_word\.register = nothing: must be the name of a register of one word",
        ),
        (["status_word", "bits", "fault"], REMOVED, r"status_word\.bits\.fault: is missing"),
        (["status_word", "bits", "fault"], 4, r"status_word\.bits: a bit occurs more than once"),
        (["status_word", "bits", "fault"], 16, r"Expected `int` <= 15"),
        (
            ["command_word", "echo"],
            "clock_ms",
            r"command_word\.echo = clock_ms: must be the name of a register of one word",
        ),
        (
            ["command_word", "sequence"],
            "heartbeat",
            r"command_word: register and sequence must be neighbours",
        ),
        (["command_word", "codes", "cstopi"], REMOVED, r"command_word\.codes\.cstopi: is missing"),
        (
            ["command_word", "codes", "hold"],
            {"low": 3},
            r"command_word\.codes\.hold: needs either low and high or pulse",
        ),
        (
            ["command_word", "codes", "hold"],
            {"low": 3, "high": 10},
            r"command_word\.codes: a code occurs more than once",
        ),
        (
            ["command_word", "codes", "hold"],
            {"pulse": 3},
            r"command_word\.codes\.hold: needs low and high: it is set, and taken back",
        ),
        (
            ["command_word", "codes", "cstopi"],
            {"low": 9, "high": 10},
            r"command_word\.codes\.cstopi: needs pulse",
        ),
        (
            ["command_word", "codes", "dance"],
            {"pulse": 99},
            r"command_word\.codes\.dance: is unknown, allowed are imstp",
        ),
        (["coils"], {"hold": {"address": 1, "meaning": ""}}, r"command_word: there are coils too"),
        (
            ["discrete_inputs"],
            {"fault": {"address": 1, "meaning": ""}},
            r"status_word: there are discrete_inputs too",
        ),
        (
            ["input_registers", "override"],
            {"address": 900, "type": "int16", "unit": "percent", "meaning": ""},
            r"override: stands in",
        ),
        (
            ["holding_registers", "setpoint", "scale"],
            0.0,
            r"scale = 0\.0: Expected `float` >= 1e-09",
        ),
    ],
)
def test_wrong_map_of_another_controller_is_refused(
    tmp_path: Path, path: list[str | int], value: Any, text: str
) -> None:
    """Words, bits and command codes are checked as registers and coils are."""
    with pytest.raises(ConfigError, match=rf"modbus_map\.yaml: .*{text}"):
        load_modbus_map(changed_yaml(SIX, tmp_path, path, value))


def written(folder: Path, layout: ModbusMap) -> Path:
    """Write a map into ``folder`` and return the folder."""
    (folder / "modbus_map.yaml").write_bytes(msgspec.yaml.encode(layout))
    return folder


def without(layout: ModbusMap, *names: str) -> ModbusMap:
    """Return a map that lacks some of its holding registers."""
    kept = {name: one for name, one in layout.holding_registers.items() if name not in names}
    return msgspec.structs.replace(layout, holding_registers=kept)


NEEDED = {name: entry.need for name, entry in ENTRIES.items()}


@pytest.mark.parametrize("name", ENTRIES)
def test_a_map_lacks_only_what_its_robot_need_not_have(tmp_path: Path, name: str) -> None:
    """Each entry of the map of a robot that is led, one by one; the switch's two bits together."""
    gone = ("mode_b0", "mode_b1") if name.startswith("mode_") else (name,)
    folder = written(tmp_path, without(MAP, *gone))
    if not NEEDED[name]:
        assert dict(load_modbus_map(folder).left_out()).keys() == {*gone}
        return
    with pytest.raises(ConfigError, match=rf"modbus_map\.yaml: holding_registers\.{name}: is miss"):
        load_modbus_map(folder)


@pytest.mark.parametrize("name", [name for name, need in NEEDED.items() if need == "follow"])
def test_a_robot_that_is_followed_needs_what_each_controller_gives(
    tmp_path: Path, name: str
) -> None:
    """Nothing of it is written, and each entry says from which variable it comes."""
    layout = load_modbus_map(written(tmp_path, FOLLOW_MAP))
    assert not layout.leads and not layout.has_outputs
    family = layout.holding_registers[name].variable.partition("@")[0]
    assert family in ("POS[0]", "PRG[1]", "ALM[1]", "$MCR.$GENOVERRIDE", "$FAST_CLOCK")
    left = dict(layout.left_out())
    assert left["velocity"].startswith("differences") and "heartbeat_echo" in left
    with pytest.raises(ConfigError, match=rf"holding_registers\.{name}: is missing"):
        load_modbus_map(written(tmp_path, without(FOLLOW_MAP, name)))


def test_who_writes_one_register_needs_all_that_leading_needs(tmp_path: Path) -> None:
    """A set point without a heartbeat, or without signals that stop the robot, moves nothing."""
    setpoint = MAP.holding_registers["setpoint"]
    registers = {**FOLLOW_MAP.holding_registers, "setpoint": setpoint}
    layout = msgspec.structs.replace(FOLLOW_MAP, holding_registers=registers)
    found = list(problems(layout))
    assert "holding_registers.heartbeat: is missing" in found
    assert "coils.hold: is missing" in found and "discrete_inputs.fault: is missing" in found


def test_a_slot_multiplies_what_its_variable_counts() -> None:
    """$FAST_CLOCK counts 2 ms at a time: as it is, or times 2 where the register tells ms."""
    clock = FOLLOW_MAP.holding_registers["clock_ms"]
    assert (clock.scale, clock.multiply) == (2.0, 1.0)
    assert msgspec.structs.replace(clock, scale=1.0).multiply == 2.0
    assert FOLLOW_MAP.holding_registers["position"].multiply == 0.0
    assert FOLLOW_MAP.holding_registers["program_name"].multiply == -1.0
    assert MAP.holding_registers["clock_ms"].multiply == 1.0


def test_five_slots_hold_a_robot_that_is_followed() -> None:
    """What a person types."""
    slots = [(slot.address, slot.size, slot.name, slot.multiply) for slot in own_slots(FOLLOW_MAP)]
    assert slots == [
        (10001, 19, "POS[0]@27.19", 0.0),
        (10020, 2, "$FAST_CLOCK", 1.0),
        (10022, 2, "$MCR.$GENOVERRIDE", 1.0),
        (10024, 18, "PRG[1]", -1.0),
        (10042, 100, "ALM[1]", -1.0),
    ]
    assert not list(slot_problems(FOLLOW_MAP))
