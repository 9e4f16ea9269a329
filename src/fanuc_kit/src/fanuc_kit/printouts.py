"""Read what a controller prints of itself: signals, variables, version, positions, registers.

Each line of a printout is understood or named: what is not read is not left out in silence.

Source:
    The forms of printouts that controllers of V7.70 to V9.40 made: docs/sources.md.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from html import unescape

Value = int | float | bool | str | None
"""None: the controller calls it uninitialized."""
Open = tuple[str, str]
"""What goes on in the next line: an array, and an element or variable whose value follows."""
_NOTHING: Open = ("", "")

_SECTIONS = frozenset(
    ("IO STATUS", "VARIABLES", "CONFIG", "CONFIG2", "MOTOR", "SERVO")
    + ("VERSION INFORMATION", "CURRENT ROBOT POSITION")
)
_PRE = re.compile(r"<pre[^>]*>(.*?)</pre>", re.DOTALL | re.IGNORECASE)
_TAG = re.compile(r"<[^>]*>")
_SIGNAL = re.compile(r"([A-Z]+)\[\s*(\d+)\]\s*(ON|OFF|-?[\d.]+|\*+)(?:[ \t]+(.*?))?[ \t]*")
_NEXT_SIGNAL = re.compile(r"\s{2,}(?=[A-Z]+\[\s*\d+\]\s*(?:ON|OFF))")
_VARIABLE = re.compile(
    r"\[\*\w+\*\](\$\w+)\s+Storage:.*?Access:\s*\w+\s*:\s*([^=]+?)\s*(?:=\s*(.*))?"
)
_FIELD = re.compile(r"\s*Field:\s*(\$\S+)\s+(?:Access:\s*\w+\s*:\s*)?([^=]+?)\s*(?:=\s*(.*))?")
_ELEMENT = re.compile(r"\s*\[([\d,]+)\]\s*=\s*(.*?)(?:\s+'(.*)')?\s*")
_TEXT = re.compile(r"\s*'(.*)'\s*")
_GROUP = re.compile(r"\s*(?:Group|Config):")
_OPTION = re.compile(r"(.{22})([A-Z0-9]{4})\s*")
_AXIS = re.compile(r"\s*(\d+)\s+(\d+)\s+(\S.*?)\s*")
_JOINT = re.compile(r"Joint\s+(\d+):\s+(-?[\d.]+)\s*")
_SELECTED = re.compile(r"Frame #:\s*(\d+)\s+Tool #:\s*(\d+)\s*")
_COORDINATE = re.compile(r"([XYZWPR]|E\d):\s+(-?[\d.]+)\s*")
_POSITION = re.compile(r"\s*\[(\d+),(\d+)\]\s*=\s*'(.*?)'\s*(.*?)\s*")
_FIRST_GROUP = re.compile(r"\$POSREG\[1,(\d+)\]")
_PAIR = re.compile(r"(J\d|[XYZWPR]|EXT\d|E\d)\s*[=:]\s*(-?\d*\.?\d+|\*+)\s*(deg|mm)?")


@dataclass
class Printout:
    """What printouts say.

    Attributes:
        signals: Of each kind, UI and others, by number: level or value.
        variables: System variables by name, fields and elements with theirs.
        options: Names of options by their order numbers.
        axes: Group and axis of each motor.
        joints: Of the first group, by axis [deg or mm], as the controller shows them.
        pose: X, Y, Z, W, P, R of the tool in the world [mm, deg].
        registers: R[] by number.
        positions: PR[] of the first group by number; each a coordinate by its name [mm, deg].
        unread: Lines that were not understood, with their numbers.
    """

    signals: dict[str, dict[int, Value]] = field(default_factory=dict)
    variables: dict[str, Value] = field(default_factory=dict)
    options: dict[str, str] = field(default_factory=dict)
    axes: list[tuple[int, int]] = field(default_factory=list)
    joints: dict[int, float] = field(default_factory=dict)
    pose: dict[str, float] = field(default_factory=dict)
    registers: dict[int, Value] = field(default_factory=dict)
    positions: dict[int, dict[str, float]] = field(default_factory=dict)
    unread: list[str] = field(default_factory=list)


def read_printout(text: str, name: str, into: Printout) -> None:
    """Add what a printout says.

    Args:
        text: Of the file; a page of the controller's web server is taken too.
        name: Of the file, for what is not read.
        into: Gets what is said.
    """
    found = _PRE.search(text)
    lines = unescape(_TAG.sub("", found[1]) if found else text).splitlines()
    section = ""
    last = _NOTHING
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        if "::" in line and line.strip().endswith("::"):
            section = line.strip().rstrip(":")
            if section not in _SECTIONS:
                into.unread.append(f"{name}, line {number}: no section that is known: {section}")
            continue
        # A file of variables has no head: its first variable tells what it is.
        if line.startswith("[*") and "]$" in line:
            section = "VARIABLES"
        if not section:
            continue  # who printed it, and when
        # It was named once, at its head.
        if section not in _SECTIONS:
            continue
        taken, last = _take(line, section, last, into)
        if not taken:
            into.unread.append(f"{name}, line {number}: {line.strip()}")
    if not section:
        into.unread.append(f"{name}: no printout that is known")


def _take(line: str, section: str, last: Open, into: Printout) -> tuple[bool, Open]:
    """Take one line; return whether it was understood, and what goes on in the next one."""
    match section:
        case "IO STATUS":
            # One signal stands on a line, or two beside each other.
            found = [_SIGNAL.fullmatch(part) for part in _NEXT_SIGNAL.split(line.strip())]
            for one in filter(None, found):
                into.signals.setdefault(one[1], {})[int(one[2])] = value_of(one[3])
            return None not in found, _NOTHING
        case "VARIABLES":
            return _take_variable(line, last, into)
        case "CONFIG" | "CONFIG2":
            # Columns of fixed width: the name may hold blanks, its order number stands behind 22
            # characters.
            option = _OPTION.fullmatch(line.rstrip().ljust(26)[:80]) or re.fullmatch(
                r"(\S.*?)\s+([A-Z0-9]{4})\s*", line
            )
            if option is not None:
                into.options[option[2]] = option[1].strip()
            return option is not None or line.startswith(("FEATURE", "DEMO")), _NOTHING
        case "MOTOR" | "SERVO":
            axis = _AXIS.fullmatch(line)
            if axis is not None and section == "MOTOR":
                into.axes.append((int(axis[1]), int(axis[2])))
            return axis is not None or "AXIS" in line or "GR:" in line, _NOTHING
        case "VERSION INFORMATION":
            return True, _NOTHING
        case "CURRENT ROBOT POSITION":
            return _take_position(line, into), _NOTHING
    return False, _NOTHING


def _take_variable(line: str, last: Open, into: Printout) -> tuple[bool, Open]:
    """Take a line of a file of variables, and return what goes on."""
    array, place = last
    whole = _VARIABLE.fullmatch(line.rstrip()) or _FIELD.fullmatch(line.rstrip())
    if whole is not None:
        if not (whole[3] or "").strip() or _GROUP.match(whole[3]):
            return True, (whole[1], whole[1])
        into.variables[whole[1]] = value_of(whole[3])
        return True, _NOTHING
    if array == "$POSREG" and (position := _POSITION.fullmatch(line)) is not None:
        place = f"{array}[{position[1]},{position[2]}]"
        if position[1] == "1" and "Uninitialized" not in position[4]:
            into.positions[int(position[2])] = {}
        return True, (array, place)
    if place and (_GROUP.match(line) or _PAIR.search(line)):
        _take_coordinates(line, place, into)
        return True, last
    if array and (element := _ELEMENT.fullmatch(line)) is not None:
        if array == "$NUMREG":
            into.registers[int(element[1])] = value_of(element[2])
            return True, last
        place = f"{array}[{element[1]}]"
        # An empty value stands in the lines that follow: a position, or a text.
        into.variables[place] = value_of(element[2] or f"'{element[3]}'" * bool(element[3]))
        return True, (array, place)
    if place and (text := _TEXT.fullmatch(line)) is not None:
        into.variables[place] = text[1]
        return True, last
    return False, last


def _take_coordinates(line: str, place: str, into: Printout) -> None:
    """Take a line of a position: of the first group's registers, or of another variable."""
    register = _FIRST_GROUP.fullmatch(place)
    for name, value, _ in _PAIR.findall(line.partition("Config:")[0]):
        if value.startswith("*"):
            continue
        if register is not None:
            into.positions.setdefault(int(register[1]), {})[name] = float(value)
        else:
            into.variables[f"{place}.{name}"] = float(value)


def _take_position(line: str, into: Printout) -> bool:
    """Take a line of the current position: joints and pose of the first group."""
    if (joint := _JOINT.fullmatch(line.strip())) is not None:
        # The first group comes first, and each group counts its joints from 1.
        into.joints.setdefault(int(joint[1]), float(joint[2]))
        return True
    if (one := _COORDINATE.fullmatch(line.strip())) is not None:
        into.pose[one[1]] = float(one[2])  # that of the world comes last
        return True
    if (selected := _SELECTED.fullmatch(line.strip())) is not None:
        for name, value in zip(("$MNUFRAMENUM[1]", "$MNUTOOLNUM[1]"), selected.groups()):
            into.variables.setdefault(name, int(value))  # the first group comes first
        return True
    heads = ("Group #", "CURRENT", "Tool #", "CFG:", "Cartesian position cannot")
    return line.strip().startswith(heads)


def value_of(text: str) -> Value:
    """Return a value as the controller prints it."""
    text = text.strip()
    if text in ("Uninitialized", "") or set(text) == {"*"}:
        return None
    if text in ("ON", "TRUE", "OFF", "FALSE"):
        return text in ("ON", "TRUE")
    if text.startswith("'"):
        return text.strip("'")
    try:
        return float(text) if re.search(r"[.eE]", text) else int(text)
    except ValueError:
        return text
