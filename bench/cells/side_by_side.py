"""Two whole cells on one machine, both with the article's experiments all the time."""

from __future__ import annotations

import contextlib
import json
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field

from harness.live_cell import LiveCell

from bench.cells.cell_run import EXPERIMENT_S, recover, started
from bench.cells.whole_cell import start_cell
from bench.room import Room

CELLS, TOGETHER_S = 2, 600.0


@dataclass
class Seen:
    """What became of the experiments of one cell.

    Attributes:
        lost: How often a link was lost.
        runs: Runs of both experiments that have a report.
        ended: What the others said at last.
        errors: Largest path error of each experiment [percent of reach].
    """

    lost: int = 0
    runs: int = 0
    ended: list[str] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)


def work_together(room: Room) -> list[Seen]:
    """Start the cells, and let both work for ten minutes at the same time."""
    with contextlib.ExitStack() as stack:
        cells = [
            stack.enter_context(started(room.place(f"side_by_side_{number}"), start_cell))
            for number in range(CELLS)
        ]
        room.say(f"{CELLS} cells, {TOGETHER_S / 60.0:.0f} min of experiments")
        until = time.monotonic() + TOGETHER_S
        with ThreadPoolExecutor(CELLS) as pool:
            return list(pool.map(lambda cell: _work(cell, until), cells))


def _work(cell: LiveCell, until: float) -> Seen:
    seen, log = Seen(), cell.output / "log" / "twin_controller.log"
    before = _lost(log.read_text(encoding="utf-8"))
    number = 0
    while time.monotonic() < until:
        number += 1
        folder = cell.folder / f"run_{number}"
        words = ("real_leads", "twin_leads", "--output", str(folder))
        process = cell.stage.start(
            "rosrun", "twin_experiments", "run_experiment", *words, env=cell.environment
        )
        code = process.wait(EXPERIMENT_S)
        report = folder / "report.json"
        if not report.is_file():
            seen.ended.append(f"exit code {code}: {process.tail(1)}")
            recover(cell)
            continue
        entries = json.loads(report.read_text(encoding="utf-8"))["experiments"]
        seen.runs += 1
        seen.errors += [entry["path_error_max_percent"] for entry in entries]
    seen.lost = _lost(log.read_text(encoding="utf-8")) - before
    return seen


def _lost(text: str) -> int:
    return text.count("-> OFFLINE")
