"""The third group: the registers.

Each quantity that control needs has one, with its unit, fine and large enough.
"""

from __future__ import annotations

from collections.abc import Iterator

from scara_config import ConfigError, Robot
from scara_config.modbus_map import AXES, ModbusMap, Register, problems
from scara_config.set_up.slots import FREE, FREE_SLOTS, slot_problems
from twin_controller.registers import RegisterCodec

from robot_doctor.finding import Finding, Group, fine, or_fine, wrong

UNITS = {
    **dict.fromkeys(("position", "setpoint"), "axis"),
    "velocity": "axis/s",
    "clock_ms": "ms",
    **dict.fromkeys(("program_speed", "override_now", "override", "stream_speed"), "percent"),
    **dict.fromkeys(("heartbeat", "heartbeat_echo"), "count"),
}
"""What the numbers mean; ``axis`` is deg for a turning and mm for a sliding joint."""
STATE_ONLY = (
    "position",
    "position_valid",
    "velocity",
    "clock_ms",
    "control_type",
    "watchdog_state",
    "heartbeat_echo",
)
LARGEST = {"int16": 2**15 - 1, "int32": 2**31 - 1}


def check_registers(robot: Robot, layout: ModbusMap, decimals: int) -> Iterator[Finding]:
    """Check modbus_map.yaml against the robot.

    Args:
        robot: The profile.
        layout: The map, as it is, right or wrong.
        decimals: To so many in deg and mm positions are compared.
    """
    found = [
        wrong(Group.REGISTERS, f"modbus_map.yaml: {text}", _advice(text))
        for text in (*problems(layout), *slot_problems(layout))
    ]
    yield from or_fine(found, Group.REGISTERS, "all quantities have registers, none overlap")
    yield from or_fine(
        _wrong_units(layout),
        Group.REGISTERS,
        "each register has the unit that control reckons with",
    )
    yield from or_fine(
        _wrong_numbers(robot, layout, decimals),
        Group.REGISTERS,
        "numbers are fine and large enough",
    )
    for name in (
        name for name in STATE_ONLY if (entry := layout.find(name)) is not None and entry.write
    ):
        yield wrong(
            Group.REGISTERS,
            f"{name} has write: true",
            "the robot writes its state; remove `write`",
            f"modbus_map.yaml {layout.table_of(name)}.{name}.write",
        )
    # The codec would only fail at what was just told.
    if found:
        return
    try:
        codec = RegisterCodec(layout, robot)
    except ConfigError as error:
        yield wrong(
            Group.REGISTERS,
            str(error),
            "lay the registers out so that one request reads, and one writes, what belongs "
            "together",
            "modbus_map.yaml holding_registers",
        )
        return
    where = codec.state.table.replace("_", " ")
    yield fine(
        Group.REGISTERS,
        f"the state is one request of {codec.state.count} {where} from {codec.state.offset + 1}",
    )
    if codec.setpoint is not None:
        yield fine(
            Group.REGISTERS,
            f"the set point is one request of {codec.setpoint.count} words from "
            f"{codec.setpoint.offset + 1}",
        )
    for name, instead in layout.left_out():
        yield fine(Group.REGISTERS, f"{name} is left out: {instead}")


def _advice(text: str) -> str:
    """Return what to do about a problem of the map."""
    if "heartbeat" in text and "missing" in text:
        return (
            "the robot must stop by itself when nobody counts on: add a counter that it watches, "
            "or do not stream to it"
        )
    if "missing" in text:
        return (
            "find where the robot has it and add it to the map; without it the pair cannot be "
            "controlled"
        )
    if "overlaps" in text:
        return (
            "correct address, type or count: int32 and float32 take two words, a string one for "
            "two characters"
        )
    if "$SNPX_ASG" in text or "delivered controller" in text:
        return (
            f"a controller has {FREE_SLOTS} free slots, for registers from {FREE.start} to "
            f"{FREE.stop - 1}: move it there"
        )
    return "correct the entry in modbus_map.yaml"


def _wrong_units(layout: ModbusMap) -> Iterator[Finding]:
    for name, unit in UNITS.items():
        register = layout.find(name)
        if register is not None and register.unit != unit:
            what = f"{name} has unit {register.unit!r}, control reckons with {unit!r}"
            yield wrong(
                Group.REGISTERS,
                what,
                "convert on the robot, or give the register the scale that brings it there; then "
                f"`unit: {unit}`",
                f"modbus_map.yaml {layout.table_of(name)}.{name}.unit",
            )


def _wrong_numbers(robot: Robot, layout: ModbusMap, decimals: int) -> Iterator[Finding]:
    """Yield registers that are too coarse, too small or have no place for a joint."""
    for name in AXES:
        register = layout.find(name)
        if register is None:
            continue
        outside = [joint for joint in robot.joints if joint.axis_number > register.count]
        for joint in outside:
            what = f"{name} has {register.count} values, {joint.name} is axis {joint.axis_number}"
            yield wrong(
                Group.REGISTERS,
                what,
                "correct axis_number in robot.yaml or count in the map",
                f"modbus_map.yaml {layout.table_of(name)}.{name}.count",
            )
        at = f"modbus_map.yaml {layout.table_of(name)}.{name}"
        if register.type == "string":
            yield wrong(
                Group.REGISTERS,
                f"{name} is a text, a number is needed",
                "take float32, int32 or int16",
                f"{at}.type",
            )
        elif register.type != "float32":
            yield from _too_small(robot, name, register, at)
            if name != "velocity" and register.scale > 10.0**-decimals:
                what = (
                    f"one count of {name} is {register.scale:g}: positions are compared to "
                    f"{10.0**-decimals:g}"
                )
                yield wrong(
                    Group.REGISTERS,
                    what,
                    "take a finer scale, or fewer change.decimals in twin_controller.yaml",
                    f"modbus_map.yaml {layout.table_of(name)}.{name}.scale",
                )


def _too_small(robot: Robot, name: str, register: Register, at: str) -> Iterator[Finding]:
    most = LARGEST[register.type] * register.scale
    for joint in robot.joints:
        needed = joint.velocity if name == "velocity" else max(abs(joint.lower), abs(joint.upper))
        if needed / joint.scale > most:
            what = (
                f"{name} holds up to {most:g}, {joint.name} needs {needed / joint.scale:g} "
                f"{joint.unit}"
            )
            yield wrong(Group.REGISTERS, what, "take int32, or a coarser scale", at)
