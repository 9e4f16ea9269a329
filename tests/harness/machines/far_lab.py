"""A lab over three machines behind slow lines: two work for a desk, with the real programs."""

from __future__ import annotations

import os
import signal
from collections.abc import Sequence
from pathlib import Path

from harness.machines.lab_project import Lab
from harness.machines.namespaces import Line, Machines
from harness.processes import Process, wait_until

SLOW = Line(delay_ms=20.0, loss_percent=1.0)
PORT, DEADLINE_S = 8786, 120.0
POINTS = ("judge", "0.5,0.1,0.1", "--variations", "12", "--seed", "7", "--speed", "20-80")


class FarLab:
    """The first machine is the desk, two others work.

    Each has a folder of its own, so files of one are not where the others look.
    """

    def __init__(self, folder: Path, machines: Machines) -> None:
        """Give each machine a project."""
        self._machines = machines
        self.labs = [Lab(folder / f"machine_{number}", built=True) for number in range(3)]
        self.address = f"tls://{machines.address(0)}:{PORT}"

    def open(self) -> None:
        """Invite, join, and start what stays."""
        desk = self.labs[0]
        host = self._machines.address(0)
        for number in (1, 2):
            file = desk.folder / f"pc_{number}.invitation"
            where = ("--address", f"{host}:{PORT}", "--file", str(file))
            desk.farm("invite", f"pc_{number}", "--lab", *where)
            self.labs[number].farm("join", str(file))
        kept = self._start(0, "scheduler", "--listen", host)
        wait_until(lambda: "use it:" in kept.output, DEADLINE_S, "the scheduler")
        for number in (1, 2):
            working = self._start(number, "worker", self.address, "--workers", "1")
            wait_until(lambda w=working: "1 workers at" in w.output, DEADLINE_S, "a worker")

    def far(self, name: str, words: Sequence[str], code: int = 0) -> bytes:
        """Return the results of jobs that the others do."""
        asked = self.begin(name, words)
        assert asked.wait(DEADLINE_S) == code, asked.tail()
        return self.labs[0].results(name)

    def begin(self, name: str, words: Sequence[str]) -> Process:
        """Let the desk ask the others for jobs."""
        folder = str(self.labs[0].folder / name)
        return self._start(0, *words, "--folder", folder, "--scheduler", self.address)

    def kill_a_job_with_its_worker(self, number: int) -> None:
        """Wait for a job on a machine, and kill the worker that runs it with SIGKILL."""
        os.kill(self._worker_with_a_job(number), signal.SIGKILL)

    def cut_during_a_job(self, number: int) -> None:
        """Wait for a job on a machine, and cut its line."""
        self._worker_with_a_job(number)
        self._machines.cut(number, cut=True)

    def _worker_with_a_job(self, number: int) -> int:
        found: list[int] = []

        def there() -> bool:
            found[:] = self._jobs_of(number)
            return bool(found)

        wait_until(there, DEADLINE_S, "a job", period=0.02)
        return found[0]

    def _jobs_of(self, number: int) -> list[int]:
        """Return the parents of jobs that run on a machine: its workers."""
        mark = f"{self.labs[number].folder}/devel/lib/what_if/judge"
        ours = [int(line.split()[0]) for line in self.labs[number].stage.left_over()]
        parents = []
        for pid in ours:
            try:
                words = Path(f"/proc/{pid}/cmdline").read_bytes().decode().split("\0")
                stat = Path(f"/proc/{pid}/stat").read_text()
            except (FileNotFoundError, ProcessLookupError):
                continue  # it has ended meanwhile
            if mark in words:
                parents.append(int(stat.rpartition(")")[2].split()[1]))
        return parents

    def close(self) -> None:
        """End everything."""
        for lab in reversed(self.labs):
            lab.stage.close(grace=20.0)

    def _start(self, number: int, *words: str) -> Process:
        return self.labs[number].start(*words, by=self._machines.words(number, ()))
