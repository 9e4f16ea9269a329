"""Reads all of the robot's registers and signals once, over a connection of its own."""

from __future__ import annotations

from typing import Any

from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException
from scara_config.modbus_map import ModbusMap
from scara_config.quantities import ServerAddress

from operator_panel.view.robot.registers import TABLES, Entry, entries, with_bit, with_words

TIMEOUT_S = 1.0  # our choice: a robot that is busy answers within some milliseconds
MOST_WORDS = 120  # below the 125 that a request may carry
REQUESTS = {
    "holding_registers": "read_holding_registers",
    "input_registers": "read_input_registers",
    "coils": "read_coils",
    "discrete_inputs": "read_discrete_inputs",
}


class RegisterReadError(Exception):
    """The robot cannot be read; the text says why and what to do."""


def read_registers(door: ServerAddress, layout: ModbusMap) -> list[Entry]:
    """Return every register and signal with its value now; blocks for as long as that takes.

    Raises:
        RegisterReadError: The robot accepts no connection, is lost meanwhile, or refuses a request.
    """
    client: Any = ModbusTcpClient(door.host, port=door.port, timeout=TIMEOUT_S, retries=0)
    name = f"{door.host}:{door.port}"
    try:
        if not client.connect():
            raise RegisterReadError(f"no robot answers at {name}: is it on, and is Modbus allowed?")
        return [_read(client, entry, layout, name) for entry in entries(layout)]
    except (ModbusException, OSError) as error:
        raise RegisterReadError(
            f"the robot at {name} was lost while it was read: {error}"
        ) from error
    finally:
        client.close()


def _read(client: Any, entry: Entry, layout: ModbusMap, name: str) -> Entry:
    """Read one register, in several requests if it is long, or one signal."""
    values: list[Any] = []
    for first in range(0, entry.count, MOST_WORDS):
        count = min(MOST_WORDS, entry.count - first)
        answer = getattr(client, REQUESTS[entry.table])(
            entry.offset + first, count=count, device_id=layout.device_id
        )
        if answer.isError():
            raise RegisterReadError(
                f"the robot at {name} refuses {entry.name} at {entry.address}: exception "
                f"{getattr(answer, 'exception_code', answer)}"
            )
        found = answer.registers if entry.table in TABLES else answer.bits[:count]
        if len(found) < count:
            raise RegisterReadError(f"the robot at {name} gave only a part of {entry.name}")
        values += found
    return (
        with_words(entry, layout, values) if entry.table in TABLES else with_bit(entry, values[0])
    )
