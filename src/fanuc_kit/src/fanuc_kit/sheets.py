"""The sheets of the kit: what to set, to type and to try, each from the table of who judges it."""

from __future__ import annotations

import re
from collections.abc import Mapping

import msgspec
from scara_config import Robot
from scara_config.map_entries import INPUTS, OUTPUTS
from scara_config.modbus_map import Bit, ModbusMap, Register
from scara_config.set_up.kit_programs import texts
from scara_config.set_up.settings import SETTINGS
from scara_config.set_up.slots import LAST_OWN, WAY_IN, slot_table

from fanuc_kit.sheet import Boxes, Sheet, SheetTable, SheetText

_NO_SAFETY = (
    "None of this is a safety function. Guards, enabling device, emergency stop and the robot's "
    "own limits work without it. No real robot has been set up by these sheets yet."
)


def sheets_of(robot: Robot, layout: ModbusMap) -> list[Sheet]:
    """Return all sheets, in the order in which they are used; fewer for who only follows."""
    if not robot.lead:
        return [_settings(robot), _slots(robot, layout), _acceptance(robot)]
    return [
        _settings(robot),
        _slots(robot, layout),
        _signals(layout),
        _programs(),
        _acceptance(robot),
    ]


def _settings(robot: Robot) -> Sheet:
    rows = tuple(
        (
            "☐",
            row.menu,
            row.wanted,
            row.why,
            row.section or "HMI device",
            ", ".join(["then off and on"] * row.restart + ["also to follow"] * (not row.leads)),
        )
        for row in SETTINGS
        if robot.lead or not row.leads
    )
    head = ("", "MENU > ..., or a switch", "set to", "else", "B-83284EN/09", "")
    return Sheet(
        "1_settings", f"{robot.name}: settings", (SheetText(_NO_SAFETY), SheetTable(head, rows))
    )


def _slots(robot: Robot, layout: ModbusMap) -> Sheet:
    table = slot_table(layout)
    rows = tuple(
        (str(at), str(slot.address), str(slot.size), slot.name, f"{slot.multiply:g}")
        for at, slot in enumerate(table, start=1)
        if slot.size
    )
    return Sheet(
        "2_slots",
        "Slots: MENU > SYSTEM > Variables > $SNPX_ASG",
        (
            SheetText(
                f"Slot 1 is as delivered: leave it. Type slots {LAST_OWN + 1} to "
                f"{LAST_OWN + len(WAY_IN)}; `rosrun fanuc_kit write ADDRESS --robot "
                f"{robot.name}` writes the others through them, and reads all back. Or type "
                "them all."
            ),
            SheetTable(("slot", "$ADDRESS", "$SIZE", "$VAR_NAME", "$MULTIPLY"), rows),
        ),
    )


def _signals(layout: ModbusMap) -> Sheet:
    inputs = tuple(
        (
            f"UI[{number}]",
            name.upper(),
            f"F[{number}]",
            str(bit.address),
            "ON" if bit.normal else "OFF",
            "the pair" if bit.write else "",
        )
        for number, name in enumerate(INPUTS, start=1)
        if (bit := layout.coils.get(name)) is not None
    )
    outputs = tuple(
        (f"UO[{number}]", name.upper(), str(bit.address))
        for number, name in enumerate(OUTPUTS, start=1)
        if (bit := layout.discrete_inputs.get(name)) is not None
    )
    return Sheet(
        "3_signals",
        "Signals: MENU > I/O > UOP, MENU > I/O > Interconnect",
        (
            SheetText(
                "A client cannot switch an input whose source is a wire: it falls back at the next "
                "scan. I/O > UOP > CONFIG: assign UI[1] to UI[18] to rack 34, slot 1, start 1, so "
                "that each input is the flag of its number. Then switch the power off and on."
            ),
            # B-83284EN/09, 9.12.4.
            SheetText(
                "All flags are OFF then, and after each cold start: I/O > Flag, switch F[1], F[2], "
                "F[3], F[8] ON. The pair itself switches on F[1] and F[2] alone."
            ),
            SheetText(
                "Two texts of the maker differ on where a client finds them. Switch F[2] at the "
                "pendant and read the coil of UI[2] below, and coil 20002: the one that follows is "
                "the right table. Write its numbers into modbus_map.yaml before anything is led."
            ),
            SheetTable(
                ("input", "name", "flag", "coil in the map", "at rest", "written by"), inputs
            ),
            SheetTable(("output", "name", "discrete input in the map"), outputs),
            SheetText(
                "I/O > Interconnect, ES to DO: EMGOP, EMGTP, FENCE. No client sees an emergency "
                "stop of the panel otherwise."
            ),
        ),
    )


def _programs() -> Sheet:
    blocks = []
    # Whoever leads counts R[1] up from its first connection on, whatever a program keeps there.
    used = set(re.findall(r"\bP?R\[\d+\]", "".join(texts().values())))
    own = ", ".join(sorted(used, key=lambda name: (len(name), name)))
    for name, text in texts().items():
        # Lines alone: the controller itself writes the head and the positions of a listing.
        typed = text.partition("/MN\n")[2].partition("/POS")[0]
        blocks.append(SheetText(f"{name}\n{typed}", typed=True))
    return Sheet(
        "4_programs",
        "Programs to type",
        (
            SheetText(
                f"The pair alone may use {own} and F[1] to F[18]. Change each program of yours "
                "that does, before these are typed and before the cell is started."
            ),
            SheetText(
                "RSR0101: MENU > SELECT > CREATE, group mask 1. BGTWIN: group mask *, then MENU > "
                "SETUP > BG Logic, program BGTWIN, RUN. Joint speeds and the ring of set points "
                "need more than can be typed: the modbus_map.yaml beside these sheets is without "
                "them."
            ),
            *blocks,
        ),
    )


def _acceptance(robot: Robot) -> Sheet:
    check = f"rosrun robot_doctor doctor --robot {robot.name} --host ADDRESS --port 502"
    led = (
        "HOLD on the pendant, 10 s, resume: both stand, both go on",
        f"`{check} --stops`: each input that stops it is in its robot.yaml; override 10 % again",
        "STOP on the page: both ramp down, the program is aborted or paused",
        "E-STOP on the page: the drives go off",
        "the network plug out while a program runs: the robot stops by BGTWIN",
        "plugged in again: nothing moves",
        "Jog, Step joint, 10 deg, each joint: signs and ends are right",
        "STOP during a Target move at 5 %: both ramp down; ALIGN moves the twin alone",
        "mode switch to T1, T2, AUTO, RESET and ALIGN after each: the page shows the same",
    )
    followed = (
        "the page says that it follows only, and why",
        "STOP on the page: the twin stands, the robot goes on; the page says so",
        "the network plug out and in again: the robot goes on; the twin stands, aligns, follows",
    )
    return Sheet(
        "5_acceptance",
        "Acceptance: override 10 %, nobody inside the guard",
        (
            SheetText("Stop where a step shows something else."),
            Boxes(
                (
                    f"`{check}`: no WRONG; nothing was written, nothing moved",
                    "five poses, jogged by the pendant: real/joint_states agrees to the last digit",
                    "a slow program on the pendant: the twin follows",
                    "the robot's own emergency stop: it stops by itself, the twin freezes",
                    "released and reset: nothing moves",
                    *(led if robot.lead else followed),
                )
            ),
            SheetText("All steps with their limits: docs/operating/acceptance.md"),
        ),
    )


_MAP_HEAD = """\
# What stands where on a robot that was set up by the kit: its slots and programs, nothing else.
# Use: cp --remove-destination modbus_map.yaml config/robots/NAME/
# That file may be a link to another robot's, which cp alone would write over.
"""


def map_file(layout: ModbusMap) -> str:
    """Return modbus_map.yaml as text."""
    tables: tuple[tuple[str, Mapping[str, Register] | Mapping[str, Bit]], ...] = (
        ("holding_registers", layout.holding_registers),
        ("coils", layout.coils),
        ("discrete_inputs", layout.discrete_inputs),
    )
    parts = [f"{_MAP_HEAD}device_id: {layout.device_id}\nword_order: {layout.word_order}\n"]
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
