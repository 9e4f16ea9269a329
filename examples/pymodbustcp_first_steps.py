"""Read the robot's joints and set its override: pyModbusTCP, a running cell, no ROS."""

import sys

from pyModbusTCP.client import ModbusClient
from pyModbusTCP.utils import decode_ieee, word_list_to_long

robot = ModbusClient(port=int(sys.argv[1]) if len(sys.argv) > 1 else 5020, unit_id=1)
if not robot.open():
    sys.exit("no robot answers: start a cell first (./cell up)")
words = robot.read_holding_registers(11000, 18)  # registers 11001 to 11018, the low word first
joints = [round(decode_ieee(number), 3) for number in word_list_to_long(words, big_endian=False)]
print("J1 to J9 in deg and mm:", joints)
print("override 50 %:", robot.write_multiple_registers(11100, [50, 0]))
robot.close()
