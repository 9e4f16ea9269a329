"""Nodes as forks of one process that has loaded what they share, as the bring-up starts them.

A node that is a program of its own loads for half a second of processor time, and a run starts some
hundred. tests/ros/test_harness.py and what has to be a program of its own give ``ROSRUN``.
"""

from __future__ import annotations

import functools
import json
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

from scara_bringup.processes.forked_io import ForkedChild, WarmParent, runs_here
from scara_bringup.processes.warm_parent_io import PAGES

from harness.processes import MARK
from harness.workspace import workspace_environment

STARTER = Path(__file__).with_name("forked_node.py")
NO_MARK = "-" * 32
READ_LATE = ("ROS_", "SCARA_", "CELL_")
"""Beginnings of variables that a node reads when it runs; others may be read while it loads."""
LOOK_S = 0.05


class Forks(WarmParent):
    """The process that becomes the nodes; several threads may ask for their ends."""

    def __init__(self, env: Mapping[str, str]) -> None:
        """Begin to load; ``env`` is what the environments of most nodes have in common."""
        self.env = {**env, MARK: NO_MARK}
        self._turn = threading.Lock()
        super().__init__(self.env, PAGES)

    def differs(self, env: Mapping[str, str]) -> dict[str, str] | None:
        """Return what is set differently in ``env``, None where a fork may come too late for it."""
        told = {name: value for name, value in env.items() if self.env.get(name) != value}
        fits = self.env.keys() <= env.keys() and all(name.startswith(READ_LATE) for name in told)
        return told if fits else None

    def start(self, words: Sequence[str], told: Mapping[str, str], log: Path) -> ForkedChild:
        """Start a node whose environment differs so, with its output in ``log``."""
        with self._turn, log.open("wb") as stream:
            output = stream.fileno()
            return self.fork([str(STARTER), json.dumps(told), *words], output, output)

    def code(self, pid: int, wait: float = 0.0) -> int | None:
        """Return the exit code of a child once it has ended, after ``wait`` [s] at most."""
        until = time.monotonic() + wait
        while True:
            with self._turn:
                code = super().code(pid, min(LOOK_S, until - time.monotonic()))
            if code is not None or time.monotonic() >= until:
                return code


@functools.cache
def _forks() -> Forks:
    """Return the one of this process; it ends with it."""
    return Forks(workspace_environment())


def forked(words: Sequence[str], env: Mapping[str, str], log: Path) -> ForkedChild | None:
    """Start a node as a fork; None: it has to be a program of its own."""
    if not runs_here(words[0]):
        return None
    told = _forks().differs(env)
    return None if told is None else _forks().start(words, told, log)
