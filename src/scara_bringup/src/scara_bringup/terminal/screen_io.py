"""What the bring-up shows to a person."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Iterable, Mapping
from pathlib import Path

from rich.console import Console
from rich.text import Text
from scara_config import load_robot
from scara_config.profile import CHOICE, PLANT_CHOICE
from scara_ros.shell.program_io import say as print_line

from scara_bringup.config import Doors
from scara_bringup.plan import CONTROLLER, PANEL, PENDANT_PAGE, NodePlan

DEFAULT_MASTER = "http://127.0.0.1:11311"
EXAMPLES = {
    "emulator": "rosrun fanuc_emulator pendant run ARTICLE",
    CONTROLLER: "rosservice call twin_controller/why 5",
}
"""What one can type, by the node that answers."""
TOKENS = {
    PANEL: ("OPERATOR_PANEL_TOKEN", "operator_token"),
    PENDANT_PAGE: ("PENDANT_PAGE_TOKEN", "pendant_token"),
}
"""Of each page: the variable that holds its token, else the file in ROS_HOME."""
TITLES = {PANEL: "Operator's page", PENDANT_PAGE: "Robot's pendant"}


def say(text: str) -> None:
    """Print one message at once.

    Who reads it may be gone, a terminal or `tee`, mostly when the cell shall end: that is no error,
    for it would keep the nodes from being told to end in order.
    """
    print_line(text)


def complain(text: str) -> None:
    """Print one message about a fault."""
    print_line(f"cell: {text}", sys.stderr)


def show_log(path: str, lines: Iterable[str]) -> None:
    """Print the last lines of a log."""
    text = [f"--- the last lines of {path}:", *(f"    {line}" for line in lines)]
    print_line("\n".join(text), sys.stderr)


def page_addresses(doors: Doors, nodes: Iterable[NodePlan], folder: Path) -> dict[str, str]:
    """Return the address with its token of each page that belongs to the cell, by its title."""
    names = {node.name for node in nodes}
    places = {PANEL: doors.panel, PENDANT_PAGE: doors.pendant}
    found = {}
    for name, door in places.items():
        if name in names:
            variable, file_name = TOKENS[name]
            file, token = folder / "ros_home" / file_name, os.environ.get(variable, "")
            if not token and file.is_file():
                token = file.read_text(encoding="ascii").strip()
            query = f"?token={token}" if token else ""
            found[TITLES[name]] = f"http://{door.host}:{door.port}/{query}"
    return found


def show_cell(
    nodes: Iterable[NodePlan],
    addresses: Mapping[str, str],
    master_uri: str,
    folder: Path,
    seconds: float,
    trouble: str = "",
) -> None:
    """Print what one can do now; the addresses of the pages come last, where nobody misses them.

    All of it goes out in one piece, so that whoever waits for the first line has the last one too.
    ``trouble`` is the mode of a pair that does not work, and why.
    """
    names = {node.name for node in nodes}
    examples = [line for node, line in EXAMPLES.items() if node in names]
    text = Text()
    if trouble:
        text.append(f"cell: up after {seconds:.1f} s; Ctrl-C ends it\n")
        text.append(f"the pair is not ready: {trouble}\n", style="bold")
        text.append("the operator's page and docs/operator.md say what to press next\n")
    else:
        text.append(f"cell: ready after {seconds:.1f} s; Ctrl-C ends it\n")
    text.append(f"results and logs: {folder}\n")
    text.append("nodes, what they use and what they say: ./cell status\n")
    text.append("\nIn another shell, after `source env.sh`:\n")
    robot = load_robot()
    if robot.lead:
        x, y, z = list(robot.positions_m.values())[-1]
        examples.insert(0, f'rosservice call move_to "{{x: {x}, y: {y}, z: {z}}}"')
    for line in (*_settings(master_uri), *examples):
        text.append(f"  {line}\n")
    for title, address in addresses.items():
        text.append("\n  ")
        text.append(f" {title.upper()} ", style="bold reverse")
        text.append("\n  ")
        text.append(address, style="bold underline")
        text.append("\n")
    console = Console(highlight=False, soft_wrap=True)
    with console.capture() as captured:
        console.print(text)
    say(captured.get().rstrip("\n"))


def _settings(master_uri: str) -> list[str]:
    """Return the exports without which another shell would not meet this very cell.

    A shell that was given nothing meets the default master, and no namespace.
    """
    wanted = {"ROS_MASTER_URI": master_uri if master_uri != DEFAULT_MASTER else ""}
    wanted |= {
        name: os.environ.get(name, "")
        for name in ("ROS_NAMESPACE", "SCARA_CONFIG_DIR", CHOICE, PLANT_CHOICE)
    }
    there = {name: value for name, value in wanted.items() if value not in ("", "/")}
    return [f"export {name}={shlex.quote(value)}" for name, value in there.items()]
