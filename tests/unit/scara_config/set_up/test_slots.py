"""The slots of $SNPX_ASG that follow from modbus_map.yaml."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import msgspec
import pytest
from fanuc_emulator.snpx.variables import FAMILIES, parse
from harness.workspace import ROOT
from scara_config.modbus_map import ModbusMap, Register, load_modbus_map
from scara_config.set_up.slots import (
    FACTORY,
    NAME_LENGTH,
    Assignment,
    delivered_table,
    own_slots,
    slot_problems,
    slot_table,
)

LAYOUT = load_modbus_map(ROOT / "config")


def layout_of(*rows: tuple[int, str, int, str]) -> ModbusMap:
    """Return a map of registers, each an address, a type, a count and a variable."""
    registers = {
        f"r{address}": Register(address, kind, "", "", count, variable=variable)  # type: ignore[arg-type]
        for address, kind, count, variable in rows
    }
    return msgspec.structs.replace(LAYOUT, holding_registers=registers)


def test_a_person_types_fewer_slots_than_the_map_has_registers() -> None:
    """Position, program and alarm take one slot each; no slot hides another."""
    slots = own_slots(LAYOUT)
    assert len(slots) <= 16 < len(LAYOUT.holding_registers)
    assert {slot.name for slot in slots} >= {"POS[0]@27.19", "PR[1]@27.19", "PRG[1]", "ALM[1]"}
    assert all(slot.address > FACTORY.last and len(slot.name) <= NAME_LENGTH for slot in slots)
    assert all(before.last < after.address for before, after in pairwise(slots))


def test_each_word_of_the_map_is_what_its_register_names() -> None:
    """By the variable of the register, and by that of the slot."""
    for register in LAYOUT.holding_registers.values():
        (slot,) = (s for s in own_slots(LAYOUT) if s.address <= register.address <= s.last)
        own, joined = parse(register.variable), parse(slot.name)
        for word in range(register.words):
            found = joined.place(register.address - slot.address + word)
            assert found == own.place(word)
        kind = FAMILIES[own.family].fields[0].kind
        assert kind.name != "NUMBER" or register.type != "float32" or slot.multiply == 0.0


@pytest.mark.parametrize(
    ("rows", "slots"),
    [
        (
            [(10001, "int16", 1, "R[1]@1.1"), (10002, "int16", 2, "R[2]@1.1")],
            [Assignment(10001, 3, "R[1]@1.1", 1.0)],
        ),
        (
            [(10001, "int16", 1, "R[1]@1.1"), (10002, "int16", 1, "R[3]@1.1")],
            [Assignment(10001, 1, "R[1]@1.1"), Assignment(10002, 1, "R[3]@1.1")],
        ),
        (
            [(10001, "float32", 1, "R[1]"), (10003, "int32", 1, "R[2]")],
            [Assignment(10001, 2, "R[1]", 0.0), Assignment(10003, 2, "R[2]", 1.0)],
        ),
        (
            [(10001, "float32", 9, "PR[1]@27.18"), (10019, "int16", 1, "PR[2]@45.1")],
            [Assignment(10001, 18, "PR[1]@27.18", 0.0), Assignment(10019, 1, "PR[2]@45.1")],
        ),
        (
            [(10001, "int16", 1, "R[1]@1.1"), (10003, "int16", 1, "R[2]@1.1")],
            [Assignment(10001, 1, "R[1]@1.1"), Assignment(10003, 1, "R[2]@1.1")],
        ),
        (
            [(10001, "int32", 1, "$MCR.$GENOVERRIDE"), (10003, "int32", 1, "$FAST_CLOCK")],
            [Assignment(10001, 2, "$MCR.$GENOVERRIDE"), Assignment(10003, 2, "$FAST_CLOCK", 2.0)],
        ),
    ],
)
def test_only_words_in_a_row_share_a_slot(
    rows: list[tuple[int, str, int, str]], slots: list[Assignment]
) -> None:
    """Of one element or of elements in a row, with one factor and no gap."""
    assert own_slots(layout_of(*rows)) == slots


def test_a_delivered_table_has_one_slot_and_the_kits_keeps_it() -> None:
    """A client of the factory's slot goes on; the last ones lead to all others."""
    assert delivered_table()[0] == slot_table(LAYOUT)[0] == FACTORY
    assert {slot.size for slot in delivered_table()[1:]} == {0}
    assert len(slot_table(LAYOUT)) == len(delivered_table()) == 80


@pytest.mark.parametrize(
    ("row", "problem"),
    [
        ((10000, "int16", 1, "R[1]@1.1"), "= 10000: slot 1 of a delivered controller hides it"),
        ((13000, "int32", 1, "R[1]"), "ends at 13001, the last that is free is 13000"),
        ((10001, "int16", 1, "$A" * 19), "is longer than 37 characters"),
        ((10001, "int16", 1, ""), "variable: is missing, but other registers have one"),
    ],
)
def test_a_map_that_no_delivered_controller_can_hold_is_told(row: Any, problem: str) -> None:
    """By register, with what is allowed."""
    found = list(slot_problems(layout_of(row, (12000, "int16", 1, "R[9]@1.1"))))
    assert len(found) == 1 and problem in found[0], found


def test_a_map_without_variables_has_no_slots() -> None:
    """Robots of other makers."""
    assert list(slot_problems(layout_of((1, "int16", 1, "")))) == []
