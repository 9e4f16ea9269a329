"""The robot's answer with its state block, on the wire: where in it each value stands."""

from __future__ import annotations

from scara_config.modbus_map import load_modbus_map
from twin_controller.modbus.blocks import state_block

from harness.workspace import ROOT

MAP = load_modbus_map(ROOT / "config")
BLOCK = state_block(MAP)
HEAD = 9
"""Bytes in front of the words: the header of Modbus TCP, function, count of bytes."""


def is_state(unit: bytes, answers: bool) -> bool:
    """Return whether a unit is such an answer; no other one is as long."""
    size = 2 * BLOCK.count
    return answers and len(unit) == HEAD + size and unit[7:9] == bytes((3, size))


def place_of(address: int) -> int:
    """Return where the first byte of a register of the map is, in each answer."""
    return HEAD + 2 * (address - 1 - BLOCK.offset)


def bytes_of(name: str) -> slice:
    """Return where the bytes of a value are, in each answer."""
    register = MAP.find(name)
    assert register is not None, name
    begin = place_of(register.address)
    return slice(begin, begin + 2 * register.words)
