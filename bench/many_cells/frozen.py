"""A desk that is frozen, or whose disk is full: what a whole cell and its link notice of it."""

from __future__ import annotations

import json
import os
import resource
import signal
import statistics
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from harness.live_cell import LiveCell
from rich.console import Console
from scara_bringup.processes.configuration_io import copy_with_ports
from scara_config import config_directory
from scara_config.writer import write_values

from bench.cells.cell_run import READY_S, run_experiments, started
from bench.cells.whole_cell import setpoint_ages
from bench.many_cells.stage import JOIN_S, Farm, farm
from bench.second_world.figure import Figure

REPEATS, ROUNDS = 5, 3
FROZEN_S = 60.0


@dataclass(frozen=True)
class Seen:
    """Figures of one round.

    Largest path error [percent], age of set points, p99 [ms], last words of attempts that left no
    report.
    """

    error: float
    age: float
    ended: tuple[str, ...]


def measure(share: float, folder: Path, console: Console) -> list[Figure]:
    """Let the robot lead again and again: with a desk, a frozen one, and one with a full disk."""
    rounds, repeats = max(1, round(ROUNDS * share)), max(2, round(REPEATS * share))
    place = folder / "frozen"
    with farm(place / "desk") as stage, _cell(place, stage.port) as cell:
        stage.wait(lambda told: told["shown"] == 1, JOIN_S, "the cell")
        putting = stage.start("bench.many_cells.putting", str(stage.port), piped=True)
        assert putting.stdout is not None
        putting.stdout.readline()

        def lead(what: str, least_s: float = 0.0) -> list[Seen]:
            begun, seen = time.monotonic(), []
            while len(seen) < rounds + 1 or time.monotonic() - begun < least_s:
                seen.append(_lead(cell, f"{what}_{len(seen)}", repeats))
                console.print(f"{what}: {seen[-1]}", highlight=False)
            return seen

        usual = lead("usual")
        with _frozen(stage):
            frozen = lead("frozen", FROZEN_S * share)
        with _full(stage):
            full = lead("full")
        told, _ = putting.communicate("end\n", timeout=JOIN_S)
    link = json.loads(told)
    console.print(json.dumps(link))
    return [
        *_compared("desk frozen", usual, frozen),
        *_compared("disk full", usual, full),
        Figure("desk frozen: worst call of the link", "ms", 10.0, link["show_ms"], note="show"),
        Figure("desk frozen: worst put", "ms", 10.0, link["put_ms"], note="in a thread of its own"),
        Figure("desk frozen: link's memory", "MB", 1.0, link["grown_mb"], note="more than before"),
    ]


def _compared(case: str, usual: list[Seen], now: list[Seen]) -> list[Figure]:
    """Return how far error and age are from usual, in multiples of what usually differs.

    A cell that the desk has stopped has neither: it is counted.
    """
    found = []
    pick: Callable[[Seen], float]
    for what, pick in (("error", lambda s: s.error), ("age", lambda s: s.age)):
        before, after = [pick(s) for s in usual], [pick(s) for s in now]
        noise = max(before) - min(before)
        apart = statistics.median(after) - statistics.median(before)
        note = (
            f"more than usual, times its own noise; medians {statistics.median(before):.3g} and "
            f"{statistics.median(after):.3g} {'%' if what == 'error' else 'ms'}"
        )
        value = apart / noise if noise else float(apart > 0.0)
        found.append(Figure(f"{case}: a cell's {what}", "x", 1.0, value, note=note))
    ended = [text for s in now for text in s.ended]
    what, note = f"{case}: runs that ended without a report", "; ".join(ended)[:300]
    found.append(Figure(what, "", 0.0, float(len(ended)), note=note, always=True))
    return found


def _lead(cell: LiveCell, name: str, repeats: int) -> Seen:
    outcome = run_experiments(cell, cell.folder / name, "real_leads", repeats)
    error = max(entry["path_error_max_percent"] for entry in outcome.entries)
    return Seen(error, 1e3 * float(np.percentile(setpoint_ages(outcome.bag), 99)), outcome.ended)


@contextmanager
def _cell(folder: Path, router_port: int) -> Iterator[LiveCell]:
    """Give a cell that joins the desk."""
    config = copy_with_ports(config_directory(), folder / "changed")
    write_values(config / "farm" / "farm.yaml", {("router", "port"): router_port})

    def start(cell: LiveCell) -> None:
        bringup = cell.start("up", "--farm", env={"SCARA_CONFIG_DIR": str(config)})
        cell.wait_ready(bringup, READY_S)

    with started(folder / "cell", start) as cell:
        yield cell


@contextmanager
def _frozen(stage: Farm) -> Iterator[None]:
    os.kill(stage.desk_pid, signal.SIGSTOP)
    try:
        yield
    finally:
        os.kill(stage.desk_pid, signal.SIGCONT)


@contextmanager
def _full(stage: Farm) -> Iterator[None]:
    """Let the desk write no byte to any file, as a full disk would."""
    _, hard = resource.prlimit(stage.desk_pid, resource.RLIMIT_FSIZE)
    resource.prlimit(stage.desk_pid, resource.RLIMIT_FSIZE, (0, hard))
    try:
        yield
    finally:
        resource.prlimit(stage.desk_pid, resource.RLIMIT_FSIZE, (hard, hard))
