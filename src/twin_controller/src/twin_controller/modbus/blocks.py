"""The plan of the requests: which registers one request carries."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec
from scara_config import ConfigError, Robot
from scara_config.map_entries import GRIPPER_NUMBERS
from scara_config.modbus_map import ModbusMap, Table

from twin_controller.robot_sample import NUMBERS

# As far as the robot gives them.
STATE = (
    *("position", "position_valid", "clock_ms", "velocity", "control_type"),
    *("program_speed", "heartbeat_echo", "watchdog_state", "override_now"),
    *GRIPPER_NUMBERS.values(),
    *("mode_b0", "mode_b1", "motor_torque"),
)
SETPOINT = ("setpoint", "setpoint_valid", "heartbeat", "stream_speed")
# Set points ahead: written in one request behind what has changed.
RING = ("heartbeat", "stream_speed", "ring_write", "ring_clock_ms")
PROGRAM = ("program_name", "program_line", "program_state")
# The first two registers of ALARM are needed, the rest is shown if it is there.
ALARM = (
    "alarm_id",
    "alarm_number",
    "alarm_severity",
    "alarm_message",
    "alarm_cause",
    "alarm_severity_text",
)
# MODBUS Application Protocol V1.1b3, sec. 6.3 and 6.12: what one request may read, and write.
MOST_WORDS = 125
MOST_WRITTEN = 123


class Block(msgspec.Struct, frozen=True):
    """Neighbouring registers, or bits, that one request carries.

    Attributes:
        offset: PDU address of the first.
        count: How many words or bits.
        table: Where the registers stand.
    """

    offset: int
    count: int
    table: Table = "holding_registers"


def state_block(layout: ModbusMap) -> Block:
    """Return the block that is read in each cycle; signals that stand in a word are part of it."""
    shown = [layout.status_word.register] if layout.status_word else []
    echo = [layout.command_word.echo] if layout.command_word else []
    names = [name for name in (*STATE, *NUMBERS) if layout.find(name)]
    names += ["program_name"] * needs_name(layout)
    return span(layout, (*names, *shown, *echo), MOST_WORDS)


def needs_name(layout: ModbusMap) -> bool:
    """Tell whether only the program's name says that a robot streams: it belongs to each reading.

    Who leads would take the stream for a program of the robot's own otherwise, for a cycle or two.
    """
    return layout.leads and not layout.find("control_type")


def setpoint_block(layout: ModbusMap) -> Block | None:
    """Return the block that is written in each cycle of a stream; None: the robot takes none.

    Raises:
        ConfigError: It has a gap, which would be written too.
    """
    return _written(layout, SETPOINT) if layout.leads else None


def ring_block(layout: ModbusMap) -> Block | None:
    """Return the block that is written behind set points ahead; None: the robot takes none.

    Raises:
        ConfigError: It has a gap, which would be written too.
    """
    return _written(layout, RING) if layout.ring_places else None


def _written(layout: ModbusMap, names: Sequence[str]) -> Block:
    expected = [name for name in names if layout.find(name)]
    block = span(layout, expected, MOST_WRITTEN)
    registers = [layout.find(name) for name in expected]
    if block.count != sum(register.words for register in registers if register is not None):
        names = ", ".join(expected)
        raise ConfigError(
            f"modbus_map.yaml: {names}: must follow each other without a gap to be written at once"
        )
    return block


def program_block(layout: ModbusMap) -> Block:
    """Return the block of the running or last program."""
    return span(layout, PROGRAM, MOST_WORDS)


def alarm_block(layout: ModbusMap) -> Block:
    """Return the block of the active alarm, as far as the robot has it."""
    return span(layout, [name for name in ALARM if layout.find(name) is not None], MOST_WORDS)


def outputs_block(layout: ModbusMap) -> Block | None:
    """Return the robot's discrete outputs; None if they stand in a word of the state."""
    offsets = [bit.offset for bit in layout.discrete_inputs.values()]
    if not offsets:
        return None
    return Block(min(offsets), max(offsets) - min(offsets) + 1)


def span(layout: ModbusMap, names: Sequence[str], most: int) -> Block:
    """Return the span of the named registers.

    Raises:
        ConfigError: It has more words than one request may carry, or lies in two tables.
    """
    registers = [register for name in names if (register := layout.find(name)) is not None]
    first = min(register.offset for register in registers)
    count = max(register.offset + register.words for register in registers) - first
    what = f"modbus_map.yaml: {', '.join(names)}:"
    if count > most:
        raise ConfigError(f"{what} span {count} words, one request carries {most}")
    tables = {layout.table_of(name) for name in names}
    table = tables.pop()
    if tables or table is None:
        raise ConfigError(f"{what} stand in two tables, one request reads one")
    return Block(first, count, table)


def check_robot(layout: ModbusMap, robot: Robot) -> None:
    """Refuse a robot that has an axis without a place, or is to be led by a map of one that is not.

    Raises:
        ConfigError: It is so.
    """
    if robot.lead and not layout.leads:
        raise ConfigError(
            "modbus_map.yaml: no register has write: true, so robot.yaml must say lead: false"
        )
    position = layout.find("position")
    axes = position.count if position is not None else 0
    for joint in robot.joints:
        if joint.axis_number > axes:
            raise ConfigError(
                f"modbus_map.yaml: position has {axes} values,"
                f" {joint.name} is axis {joint.axis_number}"
            )
