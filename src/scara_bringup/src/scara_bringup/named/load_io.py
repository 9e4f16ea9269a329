"""Look at what the processors do: the kernel's counters, those of the control group too."""

from __future__ import annotations

import contextlib
import os
import time
from pathlib import Path

from scara_bringup.named.room import ProcessorLoad, cores_left

WINDOW_S = 1.0  # our choice: long enough for what runs ten times a second
IDLE, IOWAIT = 3, 4
GROUP = Path("/sys/fs/cgroup")


def load() -> ProcessorLoad:
    """Return what the processors that this process may use have done so far."""
    mine = os.sched_getaffinity(0)
    tick = os.sysconf("SC_CLK_TCK")
    idle = 0.0
    for line in Path("/proc/stat").read_text().splitlines():
        name, *counts = line.split()
        if name.startswith("cpu") and name[3:].isdigit() and int(name[3:]) in mine:
            # Who waits for a disk leaves the processor to others.
            idle += (int(counts[IDLE]) + int(counts[IOWAIT])) / tick
    granted, quota = 0.0, None
    # Inside a container this is its own group; elsewhere the root, which has no limit.
    with contextlib.suppress(OSError, ValueError):
        allowed, period = (GROUP / "cpu.max").read_text().split()
        quota = None if allowed == "max" else int(allowed) / int(period)
        stat = dict(line.split() for line in (GROUP / "cpu.stat").read_text().splitlines())
        granted = int(stat["usage_usec"]) * 1e-6
    return ProcessorLoad(idle, granted, len(mine), quota)


def measure_cores_left() -> float:
    """Return how many processors are free in the next second."""
    before, begun = load(), time.monotonic()
    time.sleep(WINDOW_S)
    return cores_left(before, load(), time.monotonic() - begun)
