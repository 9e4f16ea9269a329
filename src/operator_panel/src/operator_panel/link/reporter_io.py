"""Makes the report of a recording: a program of its own, of low priority, one at a time."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path

from scara_ros.shell.program_io import command_of

from operator_panel.door import Answer

NICENESS = 15  # our choice: a report can wait, the cell cannot
FAILED_VERDICT = 1
"""Exit code of a report that was written and says that a limit was missed."""


class Reporter:
    """Runs ``report`` of twin_experiments without waiting in the page's thread."""

    def __init__(self, config_dir: Path, timeout: float) -> None:
        """Remember where the configuration is and how long a report may take [s]."""
        self._config_dir, self._timeout = config_dir, timeout
        self._running = ""

    @property
    def running(self) -> str:
        """Return the folder whose report is being made, empty while none is."""
        return self._running

    async def make(self, bag: Path) -> Answer:
        """Write the report of a bag into its folder; return what became of it."""
        name = bag.parent.name
        if self._running:
            return Answer(False, f"the report of {self._running} is being made: wait for its end")
        # Nothing is awaited since it was looked at, so no two pages can both find it free.
        self._running = name
        try:
            return await self._run(bag)
        finally:
            self._running = ""

    async def _run(self, bag: Path) -> Answer:
        command = (*command_of("twin_experiments", "report", os.environ), str(bag))
        options = ("--config-dir", str(self._config_dir))
        try:
            process = await asyncio.create_subprocess_exec(
                *command,
                *options,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.DEVNULL,
                stderr=asyncio.subprocess.PIPE,
                preexec_fn=be_nice,
            )
        except OSError as error:
            return Answer(False, f"the report cannot be started: {error}")
        try:
            _, said = await asyncio.wait_for(process.communicate(), self._timeout)
        except asyncio.TimeoutError:
            process.kill()
            await process.wait()
            return Answer(
                False,
                f"the report was not ready within {self._timeout:g} s: make it on a shell with "
                f"`rosrun twin_experiments report {bag.name}`",
            )
        if process.returncode in (0, FAILED_VERDICT):
            return Answer(True, f"the report of {bag.parent.name} is ready")
        lines = said.decode(errors="replace").strip().splitlines()
        return Answer(False, lines[-1] if lines else f"exit code {process.returncode}")


def be_nice() -> None:
    """Give way to the cell: for a program that is about to start."""
    os.nice(NICENESS)
