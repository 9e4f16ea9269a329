"""The twin controller of a live cell is stopped and let go on again and again."""

from __future__ import annotations

import os
import signal
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from random import Random

import numpy as np
from cell_recorder.reading.bag_reader_io import open_bag
from scara_config import Robot
from twin_experiments.report.run_reader_io import read_run
from typing_extensions import Self

SHORTEST_S, LONGEST_S, LENGTHS = 0.005, 0.1, 30
PERIOD_S = (0.4, 0.9)
"""Between two stops; the moves last about a second, so most of them are hit."""
MOVES = 0.1
"""A joint that is faster than this part of its largest speed moves."""


@dataclass
class Stops:
    """SIGSTOP and SIGCONT of a process at random times, from 5 to 100 ms; a context manager.

    Attributes:
        pid: Of the process. It goes on at the end, whatever happens.
        rng: For order and times.
        done: When each stop began [s, wall clock], and how long it lasted [s].
    """

    pid: int
    rng: Random
    done: list[tuple[float, float]] = field(default_factory=list)
    _ended: threading.Event = field(default_factory=threading.Event)
    _thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        lengths = [float(length) for length in np.linspace(SHORTEST_S, LONGEST_S, LENGTHS)]
        while True:
            self.rng.shuffle(lengths)
            for length in lengths:
                if self._ended.wait(self.rng.uniform(*PERIOD_S)):
                    return
                self._stop_for(length)

    def _stop_for(self, length: float) -> None:
        begun = time.time()
        os.kill(self.pid, signal.SIGSTOP)
        try:
            time.sleep(length)
        finally:
            os.kill(self.pid, signal.SIGCONT)
        self.done.append((begun, time.time() - begun))


def while_it_moved(
    bag: Path, robot: Robot, stops: list[tuple[float, float]]
) -> tuple[list[float], float]:
    """Return the lengths [s] of the stops during which the twin moved, and its largest speed.

    The speed is that of its fastest joint, as a part of the joint's largest.
    """
    joints = robot.twin_joints
    with open_bag(bag) as opened:
        recorded = read_run(opened, [joint.name for joint in joints])
    # The stamps of a recording count from its begin.
    twin, origin = recorded.twin, recorded.origin
    shares = np.abs(twin.velocities / [joint.velocity for joint in joints]).max(axis=1)
    at = twin.stamps + origin
    hit = [
        length
        for begun, length in stops
        if np.any(shares[(at >= begun) & (at <= begun + length + 0.01)] > MOVES)
    ]
    return hit, float(shares.max())
