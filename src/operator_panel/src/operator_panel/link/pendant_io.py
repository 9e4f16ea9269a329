"""The real robot's pendant: a program of its own, started for each key."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from scara_config.quantities import ServerAddress
from scara_ros.shell.program_io import command_of

from operator_panel.door import Answer

LOOK_S = 0.02  # our choice: a key takes a second to start; a stop that comes meanwhile ends that


class Pendant:
    """Runs ``pendant`` of fanuc_emulator without waiting in the page's thread."""

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

    async def press(self, words: Sequence[str], stopped: Callable[[], str]) -> Answer:
        """Run one command of the pendant and return what it said.

        Once ``stopped`` tells why the key may no longer be pressed, the command is ended.
        """
        pendant = command_of("fanuc_emulator", "pendant", os.environ)
        command = (*pendant, *words, *self._options)
        try:
            process = await asyncio.create_subprocess_exec(
                *command,
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.STDOUT,
                start_new_session=True,
            )
        except OSError as error:
            return Answer(False, f"the pendant cannot be started: {error}")
        said, until = asyncio.ensure_future(process.communicate()), time.monotonic() + self._timeout
        why = stopped()
        while not (said.done() or why or time.monotonic() > until):
            await asyncio.wait({said}, timeout=LOOK_S)
            why = stopped()
        if not said.done():
            said.cancel()
            # With what it has started itself, which would keep the output open.
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            await process.wait()
            if why:
                return Answer(False, why)
            return Answer(
                False, f"the pendant did not answer within {self._timeout:g} s", lost=True
            )
        lines = said.result()[0].decode(errors="replace").strip().splitlines()
        return Answer(
            process.returncode == 0, lines[-1] if lines else f"exit code {process.returncode}"
        )
