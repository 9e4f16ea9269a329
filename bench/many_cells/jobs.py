"""64 jobs of the lab: one after the other, side by side, and with a worker killed."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import time
from pathlib import Path

from dask.system import CPU_COUNT
from harness.processes import Process, Stage, wait_until
from harness.workspace import ROOT, workspace_environment
from rich.console import Console

from bench.second_world.figure import Figure

JOBS, LEAST = 64, 8
POINT = "0.51,0.16,0.10"
DEADLINE_S = 1200.0


def measure(share: float, folder: Path, console: Console) -> list[Figure]:
    """Judge 64 points around one, each in a process of its own."""
    count = max(LEAST, round(JOBS * share))
    stage = Stage(folder / "jobs", {**workspace_environment(), "CELL_ROOT": str(ROOT)})

    def start(name: str, *words: str) -> Process:
        target = ("judge", POINT, "--variations", str(count), "--spread-mm", "5", "--seed", "7")
        place = ("--folder", str(folder / "jobs" / name))
        return stage.start(sys.executable, "-m", "farm.lab", *target, *place, *words)

    def timed(name: str, *words: str) -> float:
        begun = time.monotonic()
        start(name, *words).wait(DEADLINE_S)
        took = time.monotonic() - begun
        console.print(f"{count} jobs, {name}: {took:.1f} s", highlight=False)
        return took

    def results(name: str) -> bytes:
        return (folder / "jobs" / name / "results.jsonl").read_bytes()

    try:
        serial = timed("serial", "--workers", "1")
        parallel = timed("parallel")
        hurt = start("hurt")
        done = folder / "jobs" / "hurt"
        wait_until(lambda: len(list(done.glob("0*.json"))) >= count // 4, DEADLINE_S, "a quarter")
        os.kill(wait_until(lambda: _worker(hurt.pid), DEADLINE_S, "a worker"), signal.SIGKILL)
        hurt.wait(DEADLINE_S)
    finally:
        stage.close()
    there = results("hurt").count(b"\n")
    other = sum(results(name) != results("serial") for name in ("parallel", "hurt"))
    case = f"{count} jobs on {CPU_COUNT} processors"
    return [
        Figure(f"{case}", "x", 0.65, parallel / serial, note=f"times serial, {serial:.0f} s"),
        Figure(f"{case}, a worker killed: missing", "", 0.0, count - there, always=True),
        Figure(f"{case}: results that differ from serial", "", 0.0, other, always=True),
    ]


def _worker(lab: int) -> int:
    """Return the process of dask that has started a job of a lab; 0: none has one now."""
    parents, jobs = {}, []
    for entry in Path("/proc").iterdir():
        with contextlib.suppress(OSError, ValueError):
            pid = int(entry.name)
            fields = (entry / "stat").read_text().rpartition(")")[2].split()
            parents[pid] = int(fields[1])
            if b"/what_if/judge" in (entry / "cmdline").read_bytes():
                jobs.append(pid)
    for job in jobs:
        pid, worker = job, parents.get(job, 0)
        while pid and pid != lab:
            pid = parents.get(pid, 0)
        if pid == lab:
            return worker
    return 0
