"""The register layout of modbus_map.yaml, checked: addresses, widths, no overlap."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import msgspec
from msgspec import Meta

from scara_config.loader import ConfigError, load
from scara_config.profile import locate

Address = Annotated[int, Meta(ge=1, le=65536)]
WORDS = {"int16": 1, "int32": 2, "float32": 2, "string": 1}

# What both sides need to find in the map; addresses are free, more registers are welcome.
_AXES = dict.fromkeys(("position", "velocity", "setpoint"), ("float32", 9))
_WORDS = dict.fromkeys(
    ("position_valid", "control_type", "program_speed", "heartbeat_echo", "watchdog_state", "override_now", "setpoint_valid")
    + ("heartbeat", "stream_speed", "program_line", "program_state", "alarm_id", "alarm_number", "alarm_severity"),
    ("int16", 1),
)
_LONGS = dict.fromkeys(("clock_ms", "override"), ("int32", 1))
_TEXTS = ("program_name", "program_caller", "alarm_message", "alarm_cause", "alarm_severity_text")
_NEEDED = {**_AXES, **_WORDS, **_LONGS, "alarm_time": ("int16", 6), **dict.fromkeys(_TEXTS, ("string", None))}
_SIGNALS = {
    "coils": ("imstp", "hold", "sfspd", "cstopi", "fault_reset", "start", "home", "enbl")
    + tuple(f"rsr{number}" for number in range(1, 9))
    + ("pnstrobe", "prod_start"),
    "discrete_inputs": ("cmdenbl", "sysrdy", "progrun", "paused", "held", "fault", "atperch", "tpenbl", "batalm", "busy"),
}


class Register(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One value (or ``count`` equal ones in a row) in the holding registers."""

    address: Address
    type: Literal["int16", "int32", "float32", "string"]
    unit: str
    meaning: str
    count: Annotated[int, Meta(ge=1, le=125)] = 1
    write: bool = False

    @property
    def words(self) -> int:
        """How many 16-bit words it takes; a string counts words, not characters."""
        return WORDS[self.type] * self.count

    @property
    def offset(self) -> int:
        """PDU address: the manual's number minus one."""
        return self.address - 1


class Bit(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One coil or discrete input; ``normal`` is a coil's value at rest."""

    address: Address
    meaning: str
    write: bool = False
    normal: bool = False

    @property
    def offset(self) -> int:
        """PDU address: the manual's number minus one."""
        return self.address - 1


class ModbusMap(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What stands where on the robot's Modbus server."""

    device_id: Annotated[int, Meta(ge=1, le=247)]
    word_order: Literal["low_first", "high_first"]
    holding_registers: dict[str, Register]
    coils: dict[str, Bit]
    discrete_inputs: dict[str, Bit]


def load_modbus_map(directory: Path | str | None = None) -> ModbusMap:
    """Read modbus_map.yaml of ``directory`` (default: the package scara_config).

    Raises:
        ConfigError: The file is missing or wrong, two registers overlap, a needed register is missing or of another type,
            a signal is missing or unknown.
    """
    path = locate("modbus_map.yaml", directory)
    layout = load(path, ModbusMap)
    ordered = sorted(layout.holding_registers.items(), key=lambda item: item[1].address)
    for (name, register), (after, following) in pairwise(ordered):
        if register.address + register.words > following.address:
            raise ConfigError(
                f"{path}: holding_registers.{after}.address = {following.address}: overlaps {name}, "
                f"which ends at {register.address + register.words - 1}"
            )
    for table in ("coils", "discrete_inputs"):
        addresses = [bit.address for bit in getattr(layout, table).values()]
        if len(set(addresses)) != len(addresses):
            raise ConfigError(f"{path}: {table}: an address occurs more than once")
    _check_names(layout, path)
    return layout


def _check_names(layout: ModbusMap, path: Path) -> None:
    """Raise ConfigError unless everything that the two sides use is there, in the form they use it."""
    for name, (kind, count) in _NEEDED.items():
        register = layout.holding_registers.get(name)
        if register is None:
            raise ConfigError(f"{path}: holding_registers.{name}: is missing")
        if register.type != kind or count not in (None, register.count):
            wanted = kind if count in (None, 1) else f"{kind}, count {count}"
            raise ConfigError(f"{path}: holding_registers.{name} = {register.type}, count {register.count}: must be {wanted}")
    for table, names in _SIGNALS.items():
        bits = getattr(layout, table)
        for name in sorted(set(names) ^ set(bits)):
            what = "is unknown, allowed are " + ", ".join(names) if name in bits else "is missing"
            raise ConfigError(f"{path}: {table}.{name}: {what}")
