"""Child processes in groups of their own, with their output in files.

None outlives this process, however it ends.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import time
from collections import deque
from collections.abc import Iterable, Mapping
from pathlib import Path

from scara_ros.shell.program_io import command_of

from scara_bringup.plan import NodePlan
from scara_bringup.processes.forked_io import ForkedChild, WarmParent, runs_here
from scara_bringup.processes.log_file_io import cut_off


class Processes:
    """The children of the bring-up, by name.

    As a context manager it kills on leaving whatever still lives.
    """

    def __init__(
        self, log_folder: Path, env: Mapping[str, str], warm: WarmParent | None = None
    ) -> None:
        """Keep logs in ``log_folder``.

        Python keeps back what it prints into a file; a node that dies would take its last lines
        with it.

        Args:
            log_folder: One file a child.
            env: Environment of all children.
            warm: What forks the nodes that are Python scripts, in the same environment; None: all
                are started as programs of their own.
        """
        log_folder.mkdir(parents=True, exist_ok=True)
        self.log_folder = log_folder
        self._env = {**env, "PYTHONUNBUFFERED": "1"}
        self._warm = warm
        self._children: dict[str, subprocess.Popen[bytes] | ForkedChild] = {}
        self._reported: set[str] = set()

    def start(self, node: NodePlan, foreground: bool = False) -> int:
        """Start a node as rosrun would (the master directly) and return its process id.

        What finds the node replaces itself by it, so this is the node's own id. The kernel kills
        the child when this process is gone, even by SIGKILL: the children are out of reach of the
        terminal's Ctrl-C and of its end.

        Args:
            node: What to start.
            foreground: Its output goes to the terminal instead of its log.
        """
        words = [node.executable]
        if node.package:
            words = command_of(node.package, node.executable, self._env)
        words = [*words, *node.arguments]
        command = ["setpriv", "--pdeathsig", "KILL", "--", *words]
        with self.log_of(node.name).open("ab") as log:
            if self._warm is not None and runs_here(words[0]):
                outputs = (1, 2) if foreground else (log.fileno(), log.fileno())
                self._children[node.name] = self._warm.fork(words, *outputs)
                return self._children[node.name].pid
            self._children[node.name] = subprocess.Popen(
                command,
                env=self._env,
                stdin=subprocess.DEVNULL,
                stdout=None if foreground else log,
                stderr=None if foreground else subprocess.STDOUT,
                start_new_session=True,
            )
        return self._children[node.name].pid

    def log_of(self, name: str) -> Path:
        """Return the file with a node's output."""
        return self.log_folder / f"{name}.log"

    def last_lines(self, name: str, count: int) -> list[str]:
        """Return the last lines of a node's output."""
        try:
            with self.log_of(name).open(errors="replace") as stream:
                return [line.rstrip("\n") for line in deque(stream, count)]
        except OSError:
            return []

    def limit_logs(self, limit_mb: float) -> list[Path]:
        """Begin each log anew that is larger than ``limit_mb`` [MB]; return those.

        A node that a full disk keeps from being cut off is left alone until the next call.
        """
        cut = []
        for name in self._children:
            with contextlib.suppress(OSError):
                if cut_off(self.log_of(name), limit_mb):
                    cut.append(self.log_of(name))
        return cut

    def ended(self) -> list[tuple[str, int]]:
        """Return name and exit code of every child that has ended since the last call."""
        found = []
        for name, child in self._children.items():
            code = child.poll()
            if code is not None and name not in self._reported:
                self._reported.add(name)
                found.append((name, code))
        return found

    def signal(self, names: Iterable[str], number: int) -> None:
        """Send a signal to the whole groups of these children."""
        for name in names:
            if name in self._children:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(self._children[name].pid, number)

    def pids(self) -> dict[str, int]:
        """Return the process id of each child."""
        return {name: child.pid for name, child in self._children.items()}

    def __enter__(self) -> Processes:
        """Return itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Kill every group: a child that has ended may have left children of its own in it."""
        self.signal(self._children, signal.SIGKILL)
        deadline = time.monotonic() + 5.0
        for child in self._children.values():
            with contextlib.suppress(subprocess.TimeoutExpired):
                child.wait(max(0.0, deadline - time.monotonic()))
