"""What the monitor of wear costs beside a live cell.

Usage: PYTHONPATH=tests:$PYTHONPATH python -m bench.cells.wear_cost

At rest, then while each cycle of ARTICLE is taken; and what that makes of an hour in which the
robot never rests, with the shipped ``~every_s``.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from harness.live_cell import LiveCell
from harness.processes import wait_until
from twin_analysis.health.live.health_watch_node import EVERY_S
from twin_analysis.health.live.taking import LONGEST_S

from bench.cells.whole_cell import process_id
from bench.many_cells.cost import cpu_s, memory_mb

NODE, PROGRAM = "health_watch", "ARTICLE"
REST_S, MOVES_S = 60.0, 120.0


def main() -> None:
    """Measure, and print percents of a core."""
    with tempfile.TemporaryDirectory() as folder:
        cell = LiveCell(Path(folder))
        cell.arguments[NODE] = (f"_directory:={folder}", "_every_s:=0")
        with cell.ready(env={"SCARA_PLANT": "field"}):
            node = cell.start_node(NODE)
            wait_until(lambda: "is ready" in node.output, 30.0, "the monitor")
            pid = process_id(cell, NODE)
            cell.pendant("override", "100")
            rest = _percent(pid, time.monotonic() + REST_S, lambda: time.sleep(1.0))
            moves = _percent(pid, time.monotonic() + MOVES_S, lambda: _run(cell))
            memory = memory_mb(pid)
    share = LONGEST_S / EVERY_S
    print(f"at rest {rest:.2f} %, each cycle taken {moves:.2f} %, {memory:.0f} MB")
    print(f"at most {LONGEST_S:.0f} s taken of {EVERY_S:.0f} s: {rest + share * moves:.2f} %")


def _run(cell: LiveCell) -> None:
    """Let the program run once, to its end."""
    wait_until(lambda: cell.mode() == "IDLE", 30.0, "a pair at rest", period=0.2)
    cell.pendant("run", PROGRAM)
    wait_until(lambda: cell.mode() == "REAL_LEADS", 30.0, "a robot that moves", period=0.1)


def _percent(pid: int, end: float, step: Callable[[], None]) -> float:
    """Return what a process takes until ``end`` [s, monotonic], in percent of a core."""
    began, before = time.monotonic(), cpu_s(pid)
    while time.monotonic() < end:
        step()
    return 100.0 * (cpu_s(pid) - before) / (time.monotonic() - began)


if __name__ == "__main__":
    main()
