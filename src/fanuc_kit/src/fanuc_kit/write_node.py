"""Write the slots of $SNPX_ASG into a controller: rosrun fanuc_kit write ADDRESS.

Slots 76 to 79 must be typed before, and Modbus must be on. What differs is shown, with what stands
there now, and written once somebody agrees; then all is read back. Exit code 0: the slots are
there, 1: they are not, 2: the controller cannot be asked.
"""

from __future__ import annotations

from typing import Annotated

import typer
from rich.console import Console
from scara_config import ConfigError, load_robot
from scara_config.modbus_map import load_modbus_map
from scara_config.set_up.kit_map import kit_map
from scara_config.set_up.slots import LAST_OWN, Assignment, slot_table
from scara_ros.shell.command_line_io import CommandLine, ConfigDir, RobotName, choose_robot
from scara_ros.shell.program_io import WRONG
from twin_controller.modbus.port_io import LinkLostError, WriteRefusedError

from fanuc_kit.slots_io import SlotError, SlotWriter

FAILURES = (ConfigError, SlotError, LinkLostError, WriteRefusedError)
EMPTY = "empty"
app = CommandLine("write", dict.fromkeys(FAILURES, WRONG), help="Write the slots.")


@app.command()
def write(
    host: Annotated[str, typer.Argument(help="The robot.")],
    port: Annotated[int, typer.Option(help="Its Modbus port.", min=1, max=65535)] = 502,
    yes: Annotated[bool, typer.Option("--yes", help="Do not ask.")] = False,
    robot: RobotName = None,
    config_dir: ConfigDir = None,
) -> None:
    """Write the slots of $SNPX_ASG into a controller."""
    choose_robot(robot)
    layout = kit_map(load_modbus_map(config_dir), load_robot(config_dir).lead)
    console = Console(highlight=False, soft_wrap=True)
    with SlotWriter(host, port, layout.device_id) as writer:
        # Not slots 76 to 80: everything here is written through them.
        wanted = dict(enumerate(slot_table(layout)[:LAST_OWN], start=1))
        found = {number: writer.read(number) for number in wanted}
        differ = {number: slot for number, slot in wanted.items() if found[number] != slot}
        for number, slot in differ.items():
            console.print(f"slot {number}: {_said(found[number])} -> {_said(slot)}", markup=False)
        # A panel or a PLC of a robot in production lives by its own slots.
        lost = sum(_said(found[number]) != EMPTY for number in differ)
        ask = f"Write {len(differ)} slots to {host}? {lost} of them hold something, gone then"
        if differ and not yes and not typer.confirm(ask):
            raise typer.Exit(1)
        for number, slot in differ.items():
            writer.write(number, slot)
        left = [number for number, slot in wanted.items() if writer.read(number) != slot]
    said = f"not as written: slots {', '.join(map(str, left))}" if left else "all slots are there"
    console.print(f"{len(differ)} written; {said}", markup=False)
    raise typer.Exit(1 if left else 0)


def _said(slot: Assignment) -> str:
    """Return what a slot holds, in words."""
    if not (slot.address and slot.size):
        return EMPTY
    return f"{slot.name} at {slot.address}, {slot.size}, {slot.multiply:g}"


main = app.run
