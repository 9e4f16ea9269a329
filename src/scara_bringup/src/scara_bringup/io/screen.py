"""What the bring-up shows to a person."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable, Mapping
from pathlib import PurePath

from rich.console import Console
from rich.table import Table

from scara_bringup.config import Doors
from scara_bringup.plan import NodePlan

DEFAULT_MASTER = "http://127.0.0.1:11311"
EXAMPLES = (
    'rosservice call move_to "{x: 0.51, y: 0.16, z: 0.10}"',
    "rosrun fanuc_emulator pendant status",
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


def show_cell(nodes: Iterable[NodePlan], pids: Mapping[str, int], doors: Doors, master_uri: str, folder: PurePath) -> None:
    """Print the running nodes, the addresses and what one can do now."""
    table = Table(title=None)
    for heading in ("node", "pid", "by hand", "log"):
        table.add_column(heading)
    for node in nodes:
        words = ("rosrun", node.package, node.executable) if node.package else ("roscore",)
        table.add_row(node.name, str(pids.get(node.name, "")), " ".join((*words, *node.arguments)), f"log/{node.name}.log")
    console = Console(width=None if sys.stdout.isatty() else 140)
    console.print(table)
    say(f"ROS master   {master_uri}")
    say(f"web socket   ws://{doors.gateway.host}:{doors.gateway.port}   rosbridge v2, the twin's door")
    say(f"Modbus TCP   {doors.modbus.host}:{doors.modbus.port}   the real robot's stand-in")
    say(f"output       {folder}")
    say("In another shell, after `source env.sh`:")
    for line in (*_settings(master_uri), *EXAMPLES):
        say(f"  {line}")


def _settings(master_uri: str) -> list[str]:
    """Return the exports without which another shell would not meet this very cell."""
    wanted = {"ROS_MASTER_URI": master_uri if master_uri != DEFAULT_MASTER else ""}
    wanted |= {name: os.environ.get(name, "") for name in ("ROS_NAMESPACE", "SCARA_CONFIG_DIR")}
    return [f"export {name}={value}" for name, value in wanted.items() if value]
