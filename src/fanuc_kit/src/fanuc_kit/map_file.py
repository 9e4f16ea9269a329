"""The map as a file: what stands where on a robot that is set up by the kit."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec
from scara_config.modbus_map import Bit, ModbusMap, Register

_HEAD = """\
# What stands where on a robot that was set up by the kit: its slots and programs, nothing else.
# Use: copy over config/robots/NAME/modbus_map.yaml.
"""


def map_file(layout: ModbusMap) -> str:
    """Return modbus_map.yaml as text."""
    tables: tuple[tuple[str, Mapping[str, Register] | Mapping[str, Bit]], ...] = (
        ("holding_registers", layout.holding_registers),
        ("coils", layout.coils),
        ("discrete_inputs", layout.discrete_inputs),
    )
    parts = [f"{_HEAD}device_id: {layout.device_id}\nword_order: {layout.word_order}\n"]
    for name, table in tables:
        if table:
            lines = (f"  {key}: {_entry(value)}\n" for key, value in table.items())
            parts.append(f"\n{name}:\n{''.join(lines)}")
    return "".join(parts)


def _entry(value: Register | Bit) -> str:
    """Return one line of the file; JSON is YAML, and what is as by default is left out."""
    usual = {field.name: field.default for field in msgspec.structs.fields(value)}
    given = {key: each for key, each in msgspec.structs.asdict(value).items() if each != usual[key]}
    return msgspec.json.format(msgspec.json.encode(given), indent=0).decode()
