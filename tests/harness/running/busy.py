"""Keep every core of this machine busy for a part of its time, for a while.

A late machine to test on.

Usage: python -m harness.running.busy SECONDS [PERCENT], from tests/. It ends by itself, at the
latest after an hour, and with the process that started it.
"""

from __future__ import annotations

import os
import sys
import time
from multiprocessing import Process

PERIOD_S = 0.02
LONGEST_S = 3600.0


def work(core: int, seconds: float, percent: float, starter: int) -> None:
    """Compute on one core for a part of each period.

    It ends when the time is over or the starter is gone.
    """
    os.sched_setaffinity(0, {core})
    end = time.monotonic() + seconds
    due = time.monotonic()
    while time.monotonic() < end and os.getppid() == starter:
        until = due + PERIOD_S * percent * 1e-2
        while time.monotonic() < until:
            pass
        due = max(due + PERIOD_S, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))


def main(words: list[str]) -> int:
    """Read the command line and keep the machine busy."""
    try:
        seconds = min(float(words[0]), LONGEST_S)
        percent = float(words[1]) if len(words) > 1 else 50.0
    except (IndexError, ValueError):
        print(__doc__)
        return 2
    if not (seconds > 0.0 and 0.0 < percent <= 100.0):
        print(f"{seconds:g} s, {percent:g} %: Expected more than 0 s, and up to 100 %")
        return 2
    workers = [
        Process(target=work, args=(core, seconds, percent, os.getpid()), daemon=True)
        for core in sorted(os.sched_getaffinity(0))
    ]
    for worker in workers:
        worker.start()
    for worker in workers:
        worker.join()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
