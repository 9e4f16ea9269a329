"""The files of the robot's programs while the stand-in runs: what was saved there is taken."""

from __future__ import annotations

from pathlib import Path

from scara_config import ConfigError, Robot, locate
from scara_config.programs.files import program_files

from fanuc_emulator.config import load_library
from fanuc_emulator.tp.executor import Program

Stamps = tuple[tuple[str, int, int], ...]


class ProgramFiles:
    """Looks whether programs/ or their numbers in emulator.yaml have changed."""

    def __init__(self, robot: Robot, directory: Path | None) -> None:
        """Take notice of the files as they are."""
        self._robot, self._directory = robot, directory
        # The look below answers by it where a file is just being replaced.
        self._seen: Stamps = ()
        self._seen = self._stamps()

    def newer(self) -> tuple[dict[int, Program], dict[str, Program]] | None:
        """Return all programs, by number and by name, if a file has changed since the last look.

        Raises:
            ConfigError: One is wrong: what the robot has stays. It is said once for each change.
        """
        stamps = self._stamps()
        if stamps == self._seen:
            return None
        self._seen = stamps
        return load_library(self._robot, self._directory)

    def _stamps(self) -> Stamps:
        try:
            files = program_files(self._directory).values()
            every = (*files, locate("emulator.yaml", self._directory))
            found = ((str(file), file.stat()) for file in every)
            return tuple((name, stat.st_mtime_ns, stat.st_size) for name, stat in found)
        except (OSError, ConfigError):
            return self._seen  # a file that was there a moment ago is just being replaced
