"""Registers and signals as the page lists them, held against the twin controller's own decoder."""

from __future__ import annotations

import struct

import pytest
from harness.workspace import ROOT
from operator_panel.view.robot.registers import entries, matching, value_text, with_bit, with_words
from scara_config.modbus_map import ModbusMap, Register, load_modbus_map
from twin_controller.modbus.words import text_of, to_words


@pytest.fixture
def layout() -> ModbusMap:
    """Return the shipped robot's map."""
    return load_modbus_map(ROOT / "config")


@pytest.mark.parametrize("low_first", [True, False])
@pytest.mark.parametrize(
    ("kind", "scale", "value"),
    [("int16", 1.0, -7.0), ("int32", 0.001, 12.345), ("float32", 1.0, -29.5), ("int32", 1.0, 7e8)],
)
def test_value_is_what_the_twin_controller_writes(
    kind: str, scale: float, value: float, low_first: bool
) -> None:
    """Two decoders of one wire, each written by itself."""
    register = Register(1, kind, "deg", "", scale=scale)  # type: ignore[arg-type]
    words = to_words("one", register, value, low_first)
    assert float(value_text(register, words, low_first)) == pytest.approx(value)


def test_string_ends_at_its_first_zero() -> None:
    """Two characters a word."""
    words = struct.unpack(">4H", b"ARTIC\0\0x")
    register = Register(1, "string", "text", "", count=4)
    assert value_text(register, words, True) == text_of(words) == "ARTIC"
    assert value_text(register, [0] * 4, True) == "(empty)"


def test_every_register_and_signal_of_the_map_is_listed_once(layout: ModbusMap) -> None:
    """With the number that the robot's manual counts."""
    listed = list(entries(layout))
    expected = sum(
        len(getattr(layout, table))
        for table in ("holding_registers", "input_registers", "coils", "discrete_inputs")
    )
    assert len(listed) == len({(one.table, one.name) for one in listed}) == expected
    found = {(one.table, one.name): one.address for one in listed}
    assert found["holding_registers", "position"] == 11001
    assert found["coils", "imstp"] == 6001


def test_search_finds_by_name_address_meaning_and_value(layout: ModbusMap) -> None:
    """All words must be there, in any order."""
    listed = [
        with_bit(one, one.name == "imstp")
        if one.table in ("coils", "discrete_inputs")
        else with_words(one, layout, [0] * one.count)
        for one in entries(layout)
    ]
    assert [one.name for one in matching(listed, "11001")] == ["position"]
    assert [one.name for one in matching(listed, "servo POWER immediate")] == ["imstp"]
    signals = [one.name for one in matching(listed, "signal off imstp")]
    assert signals == ["imstp", "panel_imstp"], "off stands in the meaning of one, is the other"
    assert len(matching(listed, "")) == len(listed) and matching(listed, "no such thing") == []


def test_long_rows_are_cut_with_a_word(layout: ModbusMap) -> None:
    """Ninety set points ahead are no value that anybody reads."""
    ring = next(one for one in entries(layout) if one.name == "ring_setpoint")
    shown = with_words(ring, layout, [0] * ring.count)
    assert shown.value.endswith("0 and 81 more") and shown.raw == "0000 0000 0000 0000 ..."
