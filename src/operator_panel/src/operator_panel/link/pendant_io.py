"""The real robot's pendant: a program of its own, started for each key."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path

from scara_config.quantities import ServerAddress

from operator_panel.door import Answer


class Pendant:
    """Runs ``rosrun fanuc_emulator pendant`` without waiting in the page's thread."""

    def __init__(self, door: ServerAddress, config_dir: Path, timeout: float) -> None:
        """Remember where the robot is and how long a key may take [s]."""
        self._options = (
            "--host",
            door.host,
            "--port",
            str(door.port),
            "--config-dir",
            str(config_dir),
        )
        self._timeout = timeout

    async def press(self, words: Sequence[str]) -> Answer:
        """Run one command of the pendant and return what it said."""
        command = ("rosrun", "fanuc_emulator", "pendant", *words, *self._options)
        try:
            process = await asyncio.create_subprocess_exec(
                *command,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.STDOUT,
            )
        except OSError as error:
            return Answer(False, f"the pendant cannot be started: {error}")
        try:
            said, _ = await asyncio.wait_for(process.communicate(), self._timeout)
        except asyncio.TimeoutError:
            process.kill()
            await process.wait()
            return Answer(
                False, f"the pendant did not answer within {self._timeout:g} s", lost=True
            )
        lines = said.decode(errors="replace").strip().splitlines()
        return Answer(
            process.returncode == 0, lines[-1] if lines else f"exit code {process.returncode}"
        )
