"""The stand-in's own keys: a person presses them whatever a robot's map tells a client."""

from __future__ import annotations

import msgspec
from scara_config.modbus_map import Bit, ModbusMap

_LEVELS = {"panel_imstp": 6023, "panel_hold": 6024}
_KEYS = {"panel_start": 6025, "panel_abort": 6026, "panel_reset": 6027} | {
    f"panel_run{number}": 6030 + number for number in range(1, 9)
}
"""Coils, as config/robots/fanuc_sr6ia/modbus_map.yaml has them."""
_PULSE_MS = 30


def with_panel(layout: ModbusMap) -> ModbusMap:
    """Return a map with the keys of the stand-in's pendant, and its override.

    A map with keys or numbered commands of its own stays as it is.
    """
    if layout.command_word is not None or layout.coils:
        return layout
    coils = {
        name: Bit(address, normal=True, meaning="of the stand-in")
        for name, address in _LEVELS.items()
    } | {
        name: Bit(address, pulse_ms=_PULSE_MS, meaning="of the stand-in")
        for name, address in _KEYS.items()
    }
    held = layout.holding_registers
    override = msgspec.structs.replace(held["override_now"], write=True)
    return msgspec.structs.replace(
        layout, coils=coils, holding_registers={**held, "override": override}
    )
