"""Read the real robot's joints over Modbus TCP, as a PLC would: a running cell, no ROS."""

from __future__ import annotations

import struct
import sys

from pymodbus.client import ModbusTcpClient

JOINTS = 5
FIRST = 11000  # holding register of the first joint: a float in two registers, low word first

port = int(sys.argv[1]) if len(sys.argv) > 1 else 5020
robot = ModbusTcpClient("127.0.0.1", port=port, retries=0)
if not robot.connect():
    sys.exit(f"no robot answers at 127.0.0.1:{port}: start a cell first (./cell up)")
with robot:
    words = robot.read_holding_registers(FIRST, count=2 * JOINTS, device_id=1).registers
for number in range(JOINTS):
    low, high = words[2 * number : 2 * number + 2]
    (value,) = struct.unpack("<f", struct.pack("<HH", low, high))
    print(f"J{number + 1} {value:9.3f}")  # [deg], J3 in [mm]
