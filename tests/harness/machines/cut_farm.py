"""A desk and two machines with certificates, one of which is cut off for a while."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from harness.machines.namespaces import Line, Machines
from harness.processes import Process, Stage, wait_until
from harness.workspace import ROOT, workspace_environment

SLOW = Line(delay_ms=20.0, loss_percent=1.0)
CELLS, EVENTS_HZ = 2, 2.0
BEFORE_S, AFTER_S, DEADLINE_S = 10.0, 10.0, 60.0
COUNTED = (
    "SELECT machine, cell, count(*), count(DISTINCT number), max(number) FROM events GROUP BY ALL"
)
FARM = (sys.executable, "-m", "farm")


@dataclass(frozen=True)
class Seen:
    """What became of the events, and of a STOP.

    Attributes:
        missing: Events that were not kept.
        doubled: Events that were kept twice.
        expected: How many there were.
        lost_s: After how long the cut was seen [s].
        back_s: After how long the machine was seen again, after the cut [s].
        stopped: How many cells obeyed STOP at the end.
    """

    missing: int
    doubled: int
    expected: int
    lost_s: float
    back_s: float
    stopped: int


def cut_for(seconds: float, folder: Path, say: Callable[[str], object]) -> Seen:
    """Let two machines join, cut one off, and count when it is back.

    Args:
        seconds: How long the line is cut [s].
        folder: For everything.
        say: Is told how it goes.
    """
    events = round((BEFORE_S + seconds + AFTER_S) * EVENTS_HZ)
    with Machines(2, SLOW) as machines:
        stage = Stage(folder / "processes", workspace_environment())
        try:
            return _Scene(machines, stage, folder, events, say).play(seconds)
        finally:
            stage.close(grace=20.0)


class _Scene:
    def __init__(
        self,
        machines: Machines,
        stage: Stage,
        folder: Path,
        events: int,
        say: Callable[[str], object],
    ) -> None:
        self._machines, self._stage, self._folder = machines, stage, folder
        self._events, self._say = events, say

    def play(self, seconds: float) -> Seen:
        for number in (1, 2):
            invitation = self._folder / f"pc_{number}.invitation"
            host = self._machines.address(0)
            words = ("invite", f"pc_{number}", "--address", host, "--file", str(invitation))
            self._done(self._farm(0, *words))
            self._done(self._farm(number, "join", str(invitation)))
        history = ("--folder", str(self._folder / "farm"))
        desk = self._farm(0, "--no-page", "--listen", self._machines.address(0), *history)
        wait_until(lambda: "ready" in desk.output, DEADLINE_S, "the desk")
        for number in (1, 2):
            made = ("--cells", str(CELLS), "--first", str(number * CELLS))
            rates = ("--events-rate", str(EVENTS_HZ), "--events-until", str(self._events))
            words = ("-m", "bench.synthetic", *made, *rates, "--begin", str(time.time()))
            self._start(number, sys.executable, *words)
        wait_until(lambda: self._lost() == 0, DEADLINE_S, "all cells", period=0.2)
        self._say(f"{2 * CELLS} cells on two machines; the line of one is cut for {seconds:g} s")
        self._machines.cut(1, cut=True)
        begun = time.monotonic()
        wait_until(lambda: self._lost() == CELLS, DEADLINE_S, "the lost machine", period=0.1)
        lost = time.monotonic() - begun
        wait_until(lambda: time.monotonic() - begun >= seconds, seconds + 1.0, "the cut's end")
        self._machines.cut(1, cut=False)
        begun = time.monotonic()
        wait_until(lambda: self._lost() == 0, DEADLINE_S, "the machine again", period=0.1)
        back = time.monotonic() - begun
        expected = 2 * CELLS * self._events
        wait_until(lambda: self._counted()[0] >= expected, DEADLINE_S, "all events", period=0.5)
        kept, distinct = self._counted()
        stop = self._farm(0, "stop", "all")
        stop.wait(DEADLINE_S)
        stopped = stop.output.count("STOP received")
        return Seen(expected - distinct, kept - distinct, expected, lost, back, stopped)

    def _lost(self) -> int:
        """Return how many of all cells are lost, all while some have not come yet."""
        asked = self._farm(0, "cells")
        asked.wait(DEADLINE_S)
        summary = f"{2 * CELLS} cells, "
        if summary not in asked.output:
            return -1
        return int(asked.output.split(summary)[1].split()[0])

    def _counted(self) -> tuple[int, int]:
        """Return how many events are kept, and how many different ones."""
        asked = self._farm(0, "sql", COUNTED, "--folder", str(self._folder / "farm"))
        asked.wait(DEADLINE_S)
        rows = [line.split() for line in asked.output.splitlines() if line.startswith("pc_")]
        return sum(int(row[2]) for row in rows), sum(int(row[3]) for row in rows)

    def _farm(self, number: int, *words: str) -> Process:
        return self._start(number, *FARM, *words)

    def _start(self, number: int, *words: str) -> Process:
        env = {"FARM_KEYS": str(self._folder / f"keys_{number}"), "CELL_ROOT": str(self._folder)}
        command = self._machines.words(number, words)
        return self._stage.start(*command, name="machine", env=env, cwd=ROOT)

    @staticmethod
    def _done(process: Process) -> None:
        assert process.wait(DEADLINE_S) == 0, process.output
