"""The farm under load: many invented cells, one desk; each in processes of its own."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from harness.faults.rows import Row
from harness.processes import free_port
from rich.console import Console

MANY, QUICK_HZ, QUICK_S = 100, 50.0, 60.0
CROWD, SLOW_HZ, SLOW_S = 1000, 5.0, 20.0
KILLS = 20
PROCESSES = 4
"""Invented cells are spread over so many processes."""
JOIN_S = 60.0
DEADLINE_S = 120.0


def run(seconds: float, folder: Path, console: Console) -> list[Row]:
    """Measure the desk with many cells, with a crowd, and with links that are killed.

    Args:
        seconds: How long the many cells send [s]; the crowd sends a third of that.
        folder: For the desk's data.
        console: For progress.
    """
    rows = [*_many(seconds, folder, console), *_crowd(seconds / 3.0, folder, console)]
    return [*rows, *_kills(folder, console), *_stops(folder, console)]


def _many(seconds: float, folder: Path, console: Console) -> list[Row]:
    case = f"{MANY} cells x {QUICK_HZ:g} Hz, {seconds:.0f} s"
    console.print(f"{case} ...", highlight=False)
    with _farm(folder / "many") as farm:
        farm.cells(MANY, QUICK_HZ, seconds)
        farm.wait(lambda told: told["alive"] == MANY, JOIN_S, "all cells")
        farm.desk_asked("begin")
        put = farm.put_by_cells()
        told = farm.desk_asked("end")
    console.print(f"  {put} put, {json.dumps(told)}", highlight=False, soft_wrap=True)
    return [
        Row(case, "states lost", 0.0, float(put - told["received"])),
        Row(case, "age p99 [ms]", 2.0, told["age_p99_ms"]),
        Row(case, "desk's processor time [% of a core]", 40.0, told["cpu_percent"]),
    ]


def _crowd(seconds: float, folder: Path, console: Console) -> list[Row]:
    case = f"{CROWD} cells x {SLOW_HZ:g} Hz"
    console.print(f"{case} ...", highlight=False)
    with _farm(folder / "crowd") as farm:
        farm.cells(CROWD, SLOW_HZ, 0.0)
        farm.wait(lambda told: told["shown"] == CROWD, DEADLINE_S, "the crowd")
        farm.restart()
        begun = time.monotonic()
        farm.wait(lambda told: told["shown"] == CROWD, DEADLINE_S, "the crowd again")
        joined = time.monotonic() - begun
        farm.desk_asked("begin")
        time.sleep(seconds)
        told = farm.desk_asked("end")
    console.print(f"  {json.dumps(told)}", highlight=False, soft_wrap=True)
    return [
        Row(case, "all there after the desk's start [s]", 10.0, joined),
        Row(case, "states lost", 0.0, told["lost"]),
        Row(case, "desk's memory [MB]", 300.0, told["memory_mb"]),
    ]


def _kills(folder: Path, console: Console) -> list[Row]:
    case = f"{KILLS} links killed, {KILLS} frozen"
    console.print(f"{case} ...", highlight=False)
    with _farm(folder / "kills") as farm:
        killed = [farm.ended_by(signal.SIGKILL, k) for k in range(KILLS)]
        frozen = [farm.ended_by(signal.SIGSTOP, KILLS + k) for k in range(KILLS)]
    return [
        Row(case, "kill -9 seen, worst [ms]", 50.0, 1000.0 * max(killed)),
        Row(case, "SIGSTOP seen, worst [s]", 1.2, max(frozen)),
    ]


def _stops(folder: Path, console: Console) -> list[Row]:
    case = "STOP to one of 20 cells"
    console.print(f"{case} ...", highlight=False)
    with _farm(folder / "stops") as farm:
        farm.cells(20, SLOW_HZ, 0.0)
        farm.wait(lambda told: told["alive"] == 20, JOIN_S, "all cells")
        told = farm.desk_asked("stops")
    return [
        Row(case, "answered, p99 [ms]", 50.0, told["stop_p99_ms"]),
        Row(case, "not answered", 0.0, told["stop_unanswered"]),
    ]


class _Farm:
    """A desk and invented cells, all in processes of their own."""

    def __init__(self, folder: Path, ends: ExitStack) -> None:
        self._folder, self._ends, self._port = folder, ends, free_port()
        self._cells: list[subprocess.Popen[str]] = []
        self._desk = self._start_desk()

    def _start(self, *words: str, piped: bool = False) -> subprocess.Popen[str]:
        pipe = subprocess.PIPE
        process = subprocess.Popen(
            [sys.executable, "-m", *words], text=True, stdin=pipe if piped else None, stdout=pipe
        )
        self._ends.callback(_end, process)
        return process

    def _start_desk(self) -> subprocess.Popen[str]:
        desk = self._start(
            "bench.farm_desk", str(self._folder / "events"), str(self._port), piped=True
        )
        assert desk.stdout is not None
        desk.stdout.readline()
        return desk

    def restart(self) -> None:
        """Kill the desk and start it again."""
        _end(self._desk)
        self._desk = self._start_desk()

    def cells(self, count: int, rate_hz: float, seconds: float) -> None:
        """Start invented cells."""
        part = count // PROCESSES
        for k in range(PROCESSES):
            self._cells.append(self._cell(k * part, part, rate_hz, seconds))

    def _cell(
        self, first: int, count: int, rate_hz: float, seconds: float
    ) -> subprocess.Popen[str]:
        words = {"cells": count, "rate": rate_hz, "first": first, "seconds": seconds}
        words |= {"router-port": self._port, "events-rate": 0.02}
        return self._start(
            "farm.synthetic", *(text for k, v in words.items() for text in (f"--{k}", str(v)))
        )

    def put_by_cells(self) -> int:
        """Wait for the cells' end; return how many states they have put."""
        total = 0
        for process in self._cells:
            text, _ = process.communicate(timeout=DEADLINE_S + JOIN_S)
            total += int(text.rsplit("states put", 1)[0].split()[-1])
        return total

    def desk_asked(self, word: str) -> dict[str, Any]:
        """Return the desk's answer to a word."""
        desk = self._desk
        assert desk.stdin is not None and desk.stdout is not None
        desk.stdin.write(word + "\n")
        desk.stdin.flush()
        answer: dict[str, Any] = json.loads(desk.stdout.readline())
        return answer

    def wait(self, done: Any, timeout: float, what: str) -> None:
        """Ask the desk until it is done."""
        until = time.monotonic() + timeout
        while not done(told := self.desk_asked("count")):
            if time.monotonic() > until:
                raise TimeoutError(f"{what}: not within {timeout:g} s: {told}")
            time.sleep(0.05)

    def ended_by(self, number: signal.Signals, first: int) -> float:
        """Return how long it took the desk to see that a link was ended by a signal [s]."""
        process = self._cell(first, 1, SLOW_HZ, 0.0)
        name = f"made_up_{first:03d}"
        self.wait(lambda told: name in told["names"], JOIN_S, name)
        before = time.time()
        process.send_signal(number)
        self.wait(lambda told: name not in told["names"], DEADLINE_S, f"the loss of {name}")
        since = float(self.desk_asked("count")["lost_since"][name])
        process.kill()
        return since - before


@contextmanager
def _farm(folder: Path) -> Iterator[_Farm]:
    with ExitStack() as ends:
        yield _Farm(folder, ends)


def _end(process: subprocess.Popen[str]) -> None:
    process.kill()
    process.wait()
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            stream.close()
