"""A delivered robot with Modbus switched on and nothing else: what a twin that follows gets."""

from __future__ import annotations

from scara_config import load
from scara_config.modbus_map import ModbusMap

from harness.workspace import ROOT

MAP_FILE = ROOT / "examples" / "follow_only_map.yaml"
FOLLOW_MAP: ModbusMap = load(MAP_FILE, ModbusMap)
