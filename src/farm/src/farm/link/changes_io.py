"""Changes of the cell's configuration that the farm asks for: they hold from its next start on.

Nothing that runs is changed, and nothing moves by it. The cell looks at a change itself before it
keeps it.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

from scara_config import ConfigError
from scara_config.rollout.change import Change
from scara_config.rollout.kept import (
    Kept,
    changed_copy,
    faults_of,
    read_kept,
    running_change,
    write_kept,
)

from farm.wire import Answer, Command, Configuration

Doctor = Callable[[Path], list[str]]
"""Looks at a folder of configuration and returns what is wrong with it, a line each."""
_looking = threading.Lock()
"""One look at a time: a cell's processor is for the cell, and msgspec must not learn a type in two
threads at once (it ends the process)."""
Tell = Callable[[Command, Answer], None]
"""Is told what was asked and answered, for the audit."""


class CellChanges:
    """What a cell keeps of changes, and what it says to new ones."""

    def __init__(self, file: Path, config: Path, doctor: Doctor, tell: Tell) -> None:
        """Find out with which change the cell was started.

        Args:
            file: Where the cell keeps changes (:func:`scara_config.rollout.kept.kept_file`).
            config: Folder of the configuration that the cell runs with.
            doctor: Is asked where the files themselves are right.
            tell: Is told about each question that was let through.

        Raises:
            ConfigError: What is in the folder beside the configuration cannot be read.
        """
        running = running_change(config)
        self._running = running.change.text if running is not None else ""
        self._base = Path(running.base) if running is not None else config
        self._file, self._doctor, self._tell = file, doctor, tell
        self._lock = threading.Lock()

    @property
    def number(self) -> int:
        """Counts what was decided; -1: it cannot be read, and no question is based on that."""
        try:
            return read_kept(self._file).number
        except ConfigError:
            return -1

    def shown(self) -> Configuration:
        """Return how the cell's configuration differs from its own files."""
        try:
            kept = read_kept(self._file)
        except ConfigError as error:
            return Configuration(-1, self._running, note=str(error))
        return Configuration(
            kept.number,
            self._running,
            _text(kept.wanted),
            _text(kept.before),
            kept.proven,
            kept.note,
        )

    def obey(self, command: Command) -> Answer:
        """Look at a change, keep it for the next start, or take it back."""
        try:
            answer = self._obeyed(command)
        except ConfigError as error:
            answer = Answer(False, str(error))
        # A full disk, on which no copy can be tried: whoever asks hears of it, and the audit too.
        except OSError as error:
            answer = Answer(False, f"the change cannot be tried here: {error.strerror or error}")
        self._tell(command, answer)
        return answer

    def _obeyed(self, command: Command) -> Answer:
        by = f"{command.person}@{command.desk}"
        change = command.change
        if change is None:
            return Answer(False, f"{command.command}: names no change")
        if command.command == "TAKE_BACK":
            # A cell with another one keeps that, however often this is said.
            kept = self._decide(
                command,
                lambda known: known.taken_back(by) if _text(known.wanted) == change.text else known,
            )
            what = _text(kept.wanted) or "the cell's own files"
            if kept.number == command.revision:
                return Answer(True, f"has {what}, not {change.text}: nothing was changed")
            return Answer(True, f"from the next start on: {what}")
        if faults := self._faults(change):
            return Answer(False, "; ".join(faults))
        if command.command == "EXAMINE":
            return Answer(True, f"{change.text}: nothing is wrong with it here")
        self._decide(command, lambda known: known.offered(change, by))
        return Answer(True, f"from the next start on: {change.text}")

    def _decide(self, command: Command, decide: Callable[[Kept], Kept]) -> Kept:
        """Keep what was decided, unless somebody else was quicker.

        Raises:
            ConfigError: Somebody was, or the file cannot be read or written.
        """
        with self._lock:
            known = read_kept(self._file)
            if known.number != command.revision:
                raise ConfigError("somebody else has decided meanwhile: look again")
            kept = decide(known)
            if kept != known:
                write_kept(self._file, kept)
            return kept

    def _faults(self, change: Change) -> list[str]:
        """Return why a change is not taken; the quick reasons first."""
        if faults := list(change.faults()):
            return faults
        with _looking:
            if faults := faults_of(change, self._base):
                return faults
            with changed_copy(change, self._base) as folder:
                return self._doctor(folder)


def _text(change: Change | None) -> str:
    return change.text if change is not None else ""
