"""Hold a controller's printouts against its set-up, and propose values of robot.yaml."""

from __future__ import annotations

from collections.abc import Iterator

from scara_config import Robot
from scara_config.modbus_map import ModbusMap
from scara_config.set_up.settings import WANTED, connections_needed, setting
from scara_config.set_up.slots import Assignment, slot_table

from fanuc_kit.printouts import Printout, Value

HMI_DEVICE = "R553"
"""The option without which there is no Modbus server of this kind."""
_TOOL = "$MNUTOOL[1,1]"
_TOOL_MENU = "MENU > SETUP > Frames > Tool Frame > DETAIL: all 0"
_LIMITS = (
    ("lower", "$PARAM_GROUP[1].$LOWERLIMS[{}]"),
    ("upper", "$PARAM_GROUP[1].$UPPERLIMS[{}]"),
    ("velocity", "$PARAM_GROUP[1].$JNTVELLIM[{}]"),
)


def missing(
    layout: ModbusMap, found: Printout, leads: bool = True, tool_is_set: bool = False
) -> Iterator[str]:
    """Yield what the printouts show that is not set, each with its menu.

    What no printout says is not judged.

    Args:
        layout: modbus_map.yaml.
        found: What the printouts say.
        leads: False: the robot is only followed, and needs less.
        tool_is_set: A program of the profile sets the numbers of its tool frame.
    """
    if found.options and HMI_DEVICE not in found.options:
        yield f"option {HMI_DEVICE}, HMI Device (SNPX), is not there: order it from the maker"
    clients = found.variables.get("$SNPX_PARAM.$NUM_MODBUS")
    if isinstance(clients, int) and clients < connections_needed(leads):
        yield _line("num_modbus", f"$SNPX_PARAM.$NUM_MODBUS is {clients}")
    if "$SNPX_ASG[1].$ADDRESS" in found.variables:
        yield from _slots(layout, found)
    if not leads:
        return
    for each in WANTED:
        value = found.variables.get(each.variable, each.value)
        if value != each.value:
            yield _line(each.key, f"{each.variable} is {value}")
    frame = [found.variables.get(f"{_TOOL}.{axis}") for axis in "XYZWPR"]
    # Half of the last of the three decimals that are printed.
    if not tool_is_set and any(isinstance(at, float) and abs(at) > 5e-4 for at in frame):
        numbers = ", ".join(f"{at:g}" for at in frame if isinstance(at, float))
        what = f"{_TOOL} is {numbers}, and no program sets UTOOL[1]: Cartesian positions are of"
        yield f"{what} that tool -> {_TOOL_MENU}"
    inputs = found.signals.get("UI")
    # The full allocation has all of UI[1] to UI[18], the simple one leaves some out.
    if inputs is not None and len(inputs) < 18:
        have = ", ".join(map(str, sorted(inputs)))
        yield _line("uop", f"only UI {have or 'none'} are allocated")
    # *IMSTP, *HOLD, *SFSPD and ENBL act while they are off.
    for number in (1, 2, 3, 8):
        if inputs is not None and inputs.get(number) is False:
            yield _line("unwired", f"UI[{number}] is off")


def unheard(found: Printout) -> list[str]:
    """Return what no printout said, so that it was not judged."""
    names = [
        "$SNPX_PARAM.$NUM_MODBUS",
        "$SNPX_ASG[1].$ADDRESS",
        *[each.variable for each in WANTED],
        f"{_TOOL}.X",
    ]
    silent = [name for name in names if name not in found.variables]
    silent += ["options"] * (not found.options) + ["UI"] * ("UI" not in found.signals)
    return silent


def proposals(robot: Robot, found: Printout) -> Iterator[str]:
    """Yield values of robot.yaml that differ from what the printouts show."""
    motors = {axis for group, axis in found.axes if group == 1}
    for joint in robot.joints:
        number = joint.axis_number
        if motors and number not in motors:
            yield f"joints.{joint.name}: axis {number} has no motor; leave the joint out"
        for key, form in _LIMITS:
            shown = found.variables.get(form.format(number))
            # To Python TRUE and FALSE are numbers as well.
            if not isinstance(shown, (int, float)) or isinstance(shown, bool):
                continue
            filed = getattr(joint, key) / joint.scale
            unit = joint.unit if key != "velocity" else f"{joint.unit}_s"
            if abs(filed - shown) > 0.005:
                yield f"joints.{joint.name}.{key}_{unit}: {shown:g}   # filed: {filed:g}"
    for number in sorted(motors - {joint.axis_number for joint in robot.joints}):
        yield f"joints: axis {number} has a motor, and no joint"


def _slots(layout: ModbusMap, found: Printout) -> Iterator[str]:
    """Yield slots that differ from the kit's sheet."""
    for number, slot in enumerate(slot_table(layout), start=1):
        shown = _shown(found, number)
        if slot.size and shown != slot:
            if isinstance(shown, str):
                what = shown
            else:
                what = f"{shown.name} at {shown.address}, {shown.size}" if shown.size else "empty"
            wanted = f"{slot.name} at {slot.address}, {slot.size}, $MULTIPLY {slot.multiply:g}"
            yield _line("slots", f"slot {number} is {what}; wanted {wanted}")


def _shown(found: Printout, number: int) -> Assignment | str:
    """Return a slot as it was printed, or in words which of its numbers is none."""

    def of(name: str, other: Value) -> Value:
        return found.variables.get(f"$SNPX_ASG[{number}].{name}") or other

    address, size, multiply = of("$ADDRESS", 0), of("$SIZE", 0), of("$MULTIPLY", 0.0)
    # A printout that was typed off or sent by mail may be damaged.
    if not isinstance(address, int):
        return f"damaged: $ADDRESS = {address}"
    if not isinstance(size, int):
        return f"damaged: $SIZE = {size}"
    if not isinstance(multiply, (int, float)):
        return f"damaged: $MULTIPLY = {multiply}"
    return Assignment(address, size, str(of("$VAR_NAME", "")), float(multiply))


def _line(key: str, what: str) -> str:
    """Return a gap with its menu."""
    return f"{what} -> {setting(key).advice}"
