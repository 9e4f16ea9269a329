"""``cell status``: look at the nodes of each running cell, and listen to what they say."""

from __future__ import annotations

import os
import threading
import time
from collections import defaultdict

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from scara_ros.diagnosis import Diagnosis

from scara_bringup.status.running_io import RunningCell, running_cells, usage_of
from scara_bringup.status.status import NodeState, in_words, node_state

LOOK_S = 1.5  # our choice: nodes speak once a second (REP-107), and processor time is counted in it
NOBODY, DEAD = 3, 1


class Listener:
    """Keeps what each node has said last; this makes the process a node of the master."""

    def __init__(self, uri: str) -> None:
        """Listen at the master ``uri``."""
        self._lock = threading.Lock()
        self._said: dict[str, dict[str, Diagnosis]] = defaultdict(dict)
        self._subscriber: rospy.Subscriber | None = None
        if rosgraph.Master("/cell_status", uri).is_online():
            rospy.init_node("cell_status", anonymous=True, disable_signals=True)
            self._subscriber = rospy.Subscriber("/diagnostics", DiagnosticArray, self._keep)

    def said(self, node: str) -> tuple[Diagnosis, ...]:
        """Return what a node of this absolute name has said."""
        with self._lock:
            return tuple(self._said[node].values())

    def _keep(self, array: DiagnosticArray) -> None:
        who = array._connection_header.get("callerid", "")
        with self._lock:
            for status in array.status:
                # A subscriber gets a level as a byte string of one sign.
                level = status.level if isinstance(status.level, int) else ord(status.level)
                self._said[who][status.name] = Diagnosis(level, status.name, status.message)


def show_status(commands: bool, name: str | None = None) -> int:
    """Print every running cell; return 0, 1 if a node has ended, 3 if no cell runs.

    Args:
        commands: Whether to print what starts each node.
        name: Of the one cell that is wanted; None: all.

    The nodes of one ROS master are heard: that of ROS_MASTER_URI, else that of the first cell.
    """
    cells = running_cells()
    console = Console(highlight=False)
    if not cells:
        console.print("cell: no cell of this workspace runs. Start one: ./cell up")
        return NOBODY
    if name is not None:
        there = ", ".join(cell.name for cell in cells)
        cells = [cell for cell in cells if cell.name == name]
        if not cells:
            console.print(f"cell: no cell called {name} runs; there are: {there}", markup=False)
            return NOBODY
    # The environment's own, if it is among them.
    heard = os.environ.get("ROS_MASTER_URI", "")
    if all(cell.master_uri != heard for cell in cells):
        heard = os.environ["ROS_MASTER_URI"] = cells[0].master_uri
    listener = Listener(heard)
    before = {node.pid: usage_of(node.pid) for cell in cells for node in cell.nodes}
    begun = time.monotonic()
    time.sleep(LOOK_S)
    dt = time.monotonic() - begun
    dead = False
    for cell in cells:
        states = []
        for node in cell.nodes:
            said = listener.said(f"{cell.namespace.rstrip('/')}/{node.name}")
            states.append(
                node_state(node.name, node.pid, before[node.pid], usage_of(node.pid), dt, said)
            )
        _print_cell(console, cell, states)
        if cell.master_uri != heard:
            console.print(
                f"its nodes were not heard: ROS_MASTER_URI={cell.master_uri} ./cell status",
                soft_wrap=True,
            )
        for node in cell.nodes if commands else ():
            console.print(escape(node.command), soft_wrap=True)
            console.print(escape(f"    {node.log}"), soft_wrap=True)
        dead = dead or not all(state.alive for state in states)
    return DEAD if dead else 0


def _print_cell(console: Console, cell: RunningCell, states: list[NodeState]) -> None:
    """Print a cell: what it is, its nodes, its addresses."""
    where = "" if cell.namespace == "/" else f", namespace {cell.namespace}"
    stand_in = f", stand-in {cell.plant}" if cell.plant else ""
    title = f"{cell.name}: {cell.robot}{stand_in}: ./cell {cell.verb}, pid {cell.pid}{where}"
    console.print(escape(title), style="bold", soft_wrap=True)
    table = Table(box=None, pad_edge=False)
    table.add_column("node", no_wrap=True)
    table.add_column("pid", justify="right", no_wrap=True)
    table.add_column("CPU", justify="right", no_wrap=True)
    table.add_column("memory", justify="right", no_wrap=True)
    table.add_column("says")
    for state in states:
        words = escape(in_words(state))
        style = "" if words in ("ok", "-") else "bold red" if not state.alive else "yellow"
        table.add_row(
            state.name,
            str(state.pid),
            "-" if state.cpu_percent is None else f"{state.cpu_percent:.0f} %",
            "-" if state.memory_mb is None else f"{state.memory_mb:.0f} MB",
            f"[{style}]{words}[/]" if style else words,
        )
    console.print(table)
    for title, address in {
        **cell.addresses,
        "ROS master": cell.master_uri,
        "Output": cell.folder,
    }.items():
        console.print(escape(f"{title + ':':19} {address}"), soft_wrap=True)
