"""The robot's own teach pendant, as the operator would use it.

It is a program of its own that talks only Modbus.
"""

from __future__ import annotations

import os
import subprocess
from collections.abc import Sequence

from scara_ros.shell.program_io import command_of


class PendantCallError(RuntimeError):
    """The pendant refused, or did not answer in time; the text is what it said."""


class PendantCalls:
    """Calls ``pendant`` of fanuc_emulator."""

    def __init__(self, options: Sequence[str], deadline: float) -> None:
        """Remember options for each call (``--host``, ``--port``) and its time-out [s]."""
        self._options = list(options)
        self._deadline = deadline

    def __call__(self, *words: str) -> str:
        """Run one command of the pendant and return what it says.

        Raises:
            PendantCallError: It ended with an error, or not in time.
        """
        pendant = command_of("fanuc_emulator", "pendant", os.environ)
        command = [*pendant, *words, *self._options]
        try:
            done = subprocess.run(
                command,
                capture_output=True,
                text=True,
                timeout=self._deadline,
                # What is typed meanwhile is not for the pendant.
                stdin=subprocess.DEVNULL,
            )
        except subprocess.TimeoutExpired as error:
            raise PendantCallError(
                f"pendant {' '.join(words)}: no answer within {self._deadline:g} s"
            ) from error
        except OSError as error:
            raise PendantCallError(
                f"pendant {' '.join(words)}: cannot be started: {error}"
            ) from error
        if done.returncode:
            said = (done.stderr.strip() or done.stdout.strip()).splitlines()
            raise PendantCallError(
                f"pendant {' '.join(words)}: {said[-1] if said else f'exit code {done.returncode}'}"
            )
        return done.stdout.strip()
