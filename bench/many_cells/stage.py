"""A desk and invented cells for a measurement, each in a process of its own."""

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

from harness.processes import free_port

PROCESSES = 4
"""Invented cells are spread over so many processes."""
JOIN_S = 60.0
DEADLINE_S = 120.0


class Farm:
    """A desk that is measured, and invented cells; all of it ends with :func:`farm`."""

    def __init__(self, folder: Path, ends: ExitStack) -> None:
        self.folder, self._ends, self.port = folder, ends, free_port()
        self._cells: list[subprocess.Popen[str]] = []
        self._desk = self._start_desk()

    @property
    def desk_pid(self) -> int:
        """The desk's process."""
        return self._desk.pid

    def start(self, *words: str, piped: bool = False) -> subprocess.Popen[str]:
        """Start a module of Python, whose output is a pipe."""
        pipe = subprocess.PIPE
        process = subprocess.Popen(
            [sys.executable, "-m", *words], text=True, stdin=pipe if piped else None, stdout=pipe
        )
        self._ends.callback(end, process)
        return process

    def _start_desk(self) -> subprocess.Popen[str]:
        words = ("bench.many_cells.desk", str(self.folder / "events"), str(self.port))
        desk = self.start(*words, piped=True)
        assert desk.stdout is not None
        desk.stdout.readline()
        return desk

    def restart(self) -> None:
        """Kill the desk and start it again."""
        end(self._desk)
        self._desk = self._start_desk()

    def cells(self, count: int, rate_hz: float, seconds: float) -> None:
        """Start invented cells."""
        part = count // PROCESSES
        for k in range(PROCESSES):
            self._cells.append(self.cell(k * part, part, rate_hz, seconds))

    def cell(self, first: int, count: int, rate_hz: float, seconds: float) -> subprocess.Popen[str]:
        """Start a process of invented cells."""
        words = {"cells": count, "rate": rate_hz, "first": first, "seconds": seconds}
        words |= {"router-port": self.port, "events-rate": 0.02}
        return self.start(
            "bench.synthetic", *(text for k, v in words.items() for text in (f"--{k}", str(v)))
        )

    def put_by_cells(self) -> int:
        """Wait for the cells' end; return how many states they have put."""
        return sum(put_by(process) for process in self._cells)

    def asked(self, word: str) -> dict[str, Any]:
        """Return the desk's answer to a word."""
        desk = self._desk
        assert desk.stdin is not None and desk.stdout is not None
        desk.stdin.write(word + "\n")
        desk.stdin.flush()
        answer: dict[str, Any] = json.loads(desk.stdout.readline())
        return answer

    def wait(self, done: Any, timeout: float, what: str) -> None:
        """Ask the desk until it is done.

        Raises:
            TimeoutError: It is not within the time.
        """
        until = time.monotonic() + timeout
        while not done(told := self.asked("count")):
            if time.monotonic() > until:
                raise TimeoutError(f"{what}: not within {timeout:g} s: {told}")
            time.sleep(0.05)

    def ended_by(self, number: signal.Signals, first: int) -> float:
        """Return how long it took the desk to see that a link was ended by a signal [s]."""
        process = self.cell(first, 1, 5.0, 0.0)
        name = f"made_up_{first:03d}"
        self.wait(lambda told: name in told["names"], JOIN_S, name)
        before = time.time()
        process.send_signal(number)
        self.wait(lambda told: name not in told["names"], DEADLINE_S, f"the loss of {name}")
        since = float(self.asked("count")["lost_since"][name])
        process.kill()
        return since - before


@contextmanager
def farm(folder: Path) -> Iterator[Farm]:
    """Give a desk; it and its cells end with the block."""
    with ExitStack() as ends:
        yield Farm(folder, ends)


def put_by(process: subprocess.Popen[str]) -> int:
    """Wait for the end of invented cells; return how many states they have put."""
    text, _ = process.communicate(timeout=DEADLINE_S + JOIN_S)
    return int(text.rsplit("states put", 1)[0].split()[-1])


def end(process: subprocess.Popen[str]) -> None:
    """Kill a process and close its pipes."""
    process.kill()
    process.wait()
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            stream.close()
