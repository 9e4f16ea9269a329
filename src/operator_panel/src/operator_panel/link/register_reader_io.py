"""Reads all of the robot's registers and signals once, over a connection of its own."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from pymodbus.client import ModbusTcpClient
from pymodbus.exceptions import ModbusException
from scara_config.frames import Kind, Numbered
from scara_config.modbus_map import ModbusMap
from scara_config.quantities import ServerAddress
from scara_config.set_up.slots import FRAMES, frames_of, has_slots

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


def read_frames(door: ServerAddress, layout: ModbusMap) -> Numbered:
    """Return the robot's user and tool frames, from the kit's slots; nothing is written.

    Raises:
        RegisterReadError: As :func:`read_registers`, or no frame is shown.
        ConfigError: What is shown is no number.
    """
    if not has_slots(layout):
        raise RegisterReadError("this robot's map has no variables, and no frames")
    words: dict[Kind, list[Any]] = {}
    with _robot(door) as (client, name):
        for kind, slot in FRAMES.items():
            words[kind] = _words(
                client, "holding_registers", slot.address - 1, slot.size, layout, name, slot.name
            )
    if not any(map(any, words.values())):
        raise RegisterReadError(
            f"the robot at {name} shows no frame: nobody has set one, or the slots of the kit are "
            "not there"
        )
    return frames_of(words)


def read_registers(door: ServerAddress, layout: ModbusMap) -> list[Entry]:
    """Return every register and signal with its value now; blocks for as long as that takes.

    Raises:
        RegisterReadError: The robot accepts no connection, is lost meanwhile, or refuses a request.
    """
    with _robot(door) as (client, name):
        return [_read(client, entry, layout, name) for entry in entries(layout)]


@contextmanager
def _robot(door: ServerAddress) -> Iterator[tuple[Any, str]]:
    """Yield a connection and its name.

    Raises:
        RegisterReadError: The robot accepts none, or is lost meanwhile.
    """
    client: Any = ModbusTcpClient(door.host, port=door.port, timeout=TIMEOUT_S, retries=0)
    name = f"{door.host}:{door.port}"
    try:
        if not client.connect():
            raise RegisterReadError(f"no robot answers at {name}: is it on, and is Modbus allowed?")
        yield client, name
    except (ModbusException, OSError) as error:
        raise RegisterReadError(
            f"the robot at {name} was lost while it was read: {error}"
        ) from error
    finally:
        client.close()


def _read(client: Any, entry: Entry, layout: ModbusMap, name: str) -> Entry:
    """Read one register, in several requests if it is long, or one signal."""
    values = _words(client, entry.table, entry.offset, entry.count, layout, name, entry.name)
    return (
        with_words(entry, layout, values) if entry.table in TABLES else with_bit(entry, values[0])
    )


def _words(
    client: Any, table: str, offset: int, total: int, layout: ModbusMap, name: str, what: str
) -> list[Any]:
    """Return registers in a row, or signals.

    Raises:
        RegisterReadError: The robot refuses, or gives fewer.
    """
    values: list[Any] = []
    for first in range(0, total, MOST_WORDS):
        count = min(MOST_WORDS, total - first)
        answer = getattr(client, REQUESTS[table])(
            offset + first, count=count, device_id=layout.device_id
        )
        if answer.isError():
            raise RegisterReadError(
                f"the robot at {name} refuses {what} at {offset + 1}: exception "
                f"{getattr(answer, 'exception_code', answer)}"
            )
        found = answer.registers if table in TABLES else answer.bits[:count]
        # A short answer passes the client unseen, and all that is read after it would move up.
        if len(found) < count:
            raise RegisterReadError(f"the robot at {name} gave only a part of {what}")
        values += found
    return values
