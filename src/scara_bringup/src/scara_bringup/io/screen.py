"""What the bring-up shows to a person."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table
from scara_config import load_robot
from scara_config.profile import CHOICE, PLANT_CHOICE

from scara_bringup.config import Doors
from scara_bringup.plan import PANEL, NodePlan

DEFAULT_MASTER = "http://127.0.0.1:11311"
EXAMPLES = (
    "rosrun fanuc_emulator pendant status",
    "rosrun fanuc_emulator pendant_page",
    "rosservice call twin_controller/why 5",
    "rostopic echo twin_controller/state",
)


def say(text: str) -> None:
    """Print one message at once."""
    print(text, flush=True)


def complain(text: str) -> None:
    """Print one message about a fault."""
    print(f"cell: {text}", file=sys.stderr, flush=True)


def show_log(path: str, lines: Iterable[str]) -> None:
    """Print the last lines of a log."""
    print(f"--- the last lines of {path}:", file=sys.stderr)
    for line in lines:
        print(f"    {line}", file=sys.stderr)
    sys.stderr.flush()


def panel_address(doors: Doors, nodes: Iterable[NodePlan], folder: Path) -> str:
    """Return the address of the operator's page with its token.

    The text is empty if the page is no part of the cell.
    """
    if PANEL not in [node.name for node in nodes]:
        return ""
    file = folder / "ros_home" / "operator_token"
    token = os.environ.get("OPERATOR_PANEL_TOKEN") or (
        file.read_text(encoding="ascii").strip() if file.is_file() else ""
    )
    return f"http://{doors.panel.host}:{doors.panel.port}/" + (f"?token={token}" if token else "")


def show_cell(
    nodes: Sequence[NodePlan], pids: Mapping[str, int], doors: Doors, master_uri: str, folder: Path
) -> None:
    """Print the running nodes, the addresses and what one can do now."""
    table = Table(title=None)
    for heading in ("node", "pid", "by hand", "log"):
        table.add_column(heading)
    for node in nodes:
        words = ("rosrun", node.package, node.executable)
        table.add_row(
            node.name,
            str(pids.get(node.name, "")),
            " ".join((*words, *node.arguments)),
            f"log/{node.name}.log",
        )
    console = Console(width=None if sys.stdout.isatty() else 140)
    console.print(table)
    say(f"ROS master   {master_uri}")
    say(
        f"web socket   ws://{doors.gateway.host}:{doors.gateway.port}   rosbridge v2, the "
        "twin's door"
    )
    say(f"Modbus TCP   {doors.modbus.host}:{doors.modbus.port}   the real robot's stand-in")
    if address := panel_address(doors, nodes, folder):
        say(f"operator     {address}   the operator's page; without the token it only watches")
    say(f"output       {folder}")
    say("In another shell, after `source env.sh`:")
    for line in (*_settings(master_uri), _move(), *EXAMPLES):
        say(f"  {line}")


def _move() -> str:
    """Return a call that sends the tool of this very robot somewhere."""
    x, y, z = list(load_robot().positions_m.values())[-1]
    return f'rosservice call move_to "{{x: {x}, y: {y}, z: {z}}}"'


def _settings(master_uri: str) -> list[str]:
    """Return the exports without which another shell would not meet this very cell."""
    wanted = {"ROS_MASTER_URI": master_uri if master_uri != DEFAULT_MASTER else ""}
    wanted |= {
        name: os.environ.get(name, "")
        for name in ("ROS_NAMESPACE", "SCARA_CONFIG_DIR", CHOICE, PLANT_CHOICE)
    }
    return [f"export {name}={value}" for name, value in wanted.items() if value]
