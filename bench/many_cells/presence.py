"""How soon a killed or frozen link is seen, and that a full machine makes nobody look lost."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from rich.console import Console

from bench.many_cells.load import MANY, QUICK_HZ
from bench.many_cells.stage import JOIN_S, end, farm
from bench.second_world.figure import Figure

KILLS = 100
CALM_S = 600.0
LOOK_S = 0.5
BUSY = "while True: pass"


def measure_seen(share: float, folder: Path, console: Console) -> list[Figure]:
    """Kill and freeze links, one after the other."""
    count = max(2, round(KILLS * share))
    with farm(folder / "kills") as stage:
        killed = [stage.ended_by(signal.SIGKILL, k) for k in range(count)]
        frozen = [stage.ended_by(signal.SIGSTOP, count + k) for k in range(count)]
    console.print(f"killed: {np.round(killed, 4)} s, frozen: {np.round(frozen, 2)} s")
    note = f"p99 of {count}"
    return [
        Figure("kill -9 of a link seen", "ms", 50.0, 1e3 * _p99(killed), note=note),
        Figure("SIGSTOP of a link seen", "s", 1.2, _p99(frozen), note=note),
    ]


def measure_calm(share: float, folder: Path, console: Console) -> list[Figure]:
    """Keep 100 cells at 50 Hz beside a busy process for each processor; count who looks lost."""
    seconds = CALM_S * share
    processors = os.sched_getaffinity(0)
    gone: list[str] = []
    silent: set[str] = set()
    with farm(folder / "calm") as stage:
        stage.cells(MANY, QUICK_HZ, 0.0)
        stage.wait(lambda told: told["alive"] == MANY, JOIN_S, "all cells")
        busy = [subprocess.Popen([sys.executable, "-c", BUSY]) for _ in processors]
        try:
            until = time.monotonic() + seconds
            while time.monotonic() < until:
                told = stage.asked("losses")
                gone = told["gone"]
                silent |= set(told["silent"])
                time.sleep(LOOK_S)
        finally:
            for process in busy:
                end(process)
    console.print(f"gone: {gone}, silent: {sorted(silent)}", soft_wrap=True)
    note = f"in {seconds:.0f} s, {MANY} cells x {QUICK_HZ:g} Hz, {len(busy)} busy processes beside"
    wrong = len(gone) + len(silent)
    return [Figure("cells that look lost or silent and are not", "", 0.0, wrong, note=note)]


def _p99(seconds: list[float]) -> float:
    return float(np.percentile(seconds, 99))
