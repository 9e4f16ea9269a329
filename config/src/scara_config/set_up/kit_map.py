"""The map of a robot that holds what a person can type, and nothing else.

A robot's own modbus_map.yaml may name more: joint speeds, a stamp of each reading, set points ahead
of their time, a word that says whether PR[1] counts, a signal that switches its gripper and the
keys beside it. A program of its own has to keep those, longer than anybody types. Without them the
pair takes speeds from differences, the robot's plain clock as its stamp, and PR[1] alone. A gripper
is switched by the robot's own programs then, and two slots show it.
"""

from __future__ import annotations

import msgspec

from scara_config.loader import ConfigError
from scara_config.map_entries import ENTRIES, FAST_CLOCK, FAST_CLOCK_MS, INPUTS, OUTPUTS
from scara_config.modbus_map import ModbusMap, Register
from scara_config.set_up.slots import FREE, has_slots

_STATE = (
    *("position", "position_valid", "clock_ms", "override_now"),
    *("program_name", "program_line", "program_state", "program_caller"),
    *("heartbeat_echo", "watchdog_state"),
)
"""One request in each cycle, without a gap; the program's name says whether the robot streams."""
_OF_PROGRAMS = ("heartbeat_echo", "watchdog_state")
"""BGTWIN keeps them."""
_OF_SWITCH = ("mode_b0", "mode_b1")
"""Only who leads has to know at what the mode switch stands."""
_OF_GRIPPER = ("suction_now", "vacuum_now")
"""Of a robot with a gripper; where nobody needs them they are left out."""
_PLAIN = {
    "clock_ms": Register(
        address=FREE.start,
        type="int32",
        scale=FAST_CLOCK_MS,
        unit="ms",
        variable=FAST_CLOCK,
        meaning="the controller's own clock, ticks of 2 ms [src]",
    ),
    "override_now": Register(
        address=FREE.start,
        type="int32",
        unit="percent",
        variable="$MCR.$GENOVERRIDE",
        meaning="$MCR.$GENOVERRIDE, 1..100",
    ),
    "suction_now": Register(
        address=FREE.start,
        type="int16",
        unit="flag",
        variable="RO[1]",
        meaning="RO[1]: the suction is on; leave it out where there is no gripper",
    ),
    "vacuum_now": Register(
        address=FREE.start,
        type="int16",
        unit="flag",
        variable="RI[1]",
        meaning="RI[1]: there is vacuum, a part is held",
    ),
}


def kit_map(layout: ModbusMap, leads: bool = True) -> ModbusMap:
    """Return the map of a robot on which somebody typed slots and programs of the kit.

    Args:
        layout: The robot's own modbus_map.yaml.
        leads: With the kit's programs and signals; else nothing of it is written, and no program
            is needed.

    Raises:
        ConfigError: The robot has variables of another maker, or it leads and the map is that of a
            robot that is only followed.
    """
    if not has_slots(layout):
        raise ConfigError("modbus_map.yaml: its registers name no variables of this maker")
    lacks = [name for name in INPUTS if leads and name not in layout.coils]
    lacks += [name for name in OUTPUTS if leads and name not in layout.discrete_inputs]
    if lacks:
        raise ConfigError(
            f"modbus_map.yaml: has no signal {lacks[0]}, as that of a robot that is only followed: "
            "put the robot's own map back, or lead: false into robot.yaml"
        )
    registers: dict[str, Register] = {}
    address = FREE.start

    def take(*names: str) -> None:
        nonlocal address
        for name in names:
            # What a person can type wins over what the robot's own map has.
            register = _PLAIN.get(name) or layout.find(name)
            if register is None:
                continue
            registers[name] = msgspec.structs.replace(register, address=address)
            address += register.words

    take(*[name for name in _STATE if leads or name not in _OF_PROGRAMS])
    take(*[name for name in _OF_SWITCH if leads])
    take(*[name for name in _OF_GRIPPER if leads and layout.shows_gripper])
    take(*[name for name, entry in ENTRIES.items() if leads and entry.need == "lead"])
    take(*[name for name in layout.holding_registers if name.startswith("alarm_")])
    return msgspec.structs.replace(
        layout,
        holding_registers=registers,
        coils={name: layout.coils[name] for name in INPUTS if leads},
        discrete_inputs={name: layout.discrete_inputs[name] for name in OUTPUTS if leads},
    )
