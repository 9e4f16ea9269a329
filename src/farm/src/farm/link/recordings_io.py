"""The recordings of a cell for the farm: which there are, and pieces of them; read only."""

from __future__ import annotations

import os
from pathlib import Path

from farm.wire import PieceAsked, Recording

LONGEST_PIECE = 256 * 1024
"""Our choice: an answer that is read from the disk in a millisecond [bytes]."""
MOST = 1000
"""Our choice: recordings of one answer, the newest."""


class RecordingError(Exception):
    """A recording that cannot be given; the text says why and what to do."""


class RecordingFiles:
    """Reads the recordings below a folder, and nothing else."""

    def __init__(self, folder: Path) -> None:
        """Remember the folder; it need not be there yet."""
        self._folder = folder.resolve()

    def listed(self) -> list[Recording]:
        """Return the recordings, the newest first."""
        found = []
        # Links are not followed: "latest" would list a run twice.
        for place, folders, names in os.walk(self._folder):
            # What begins with a dot, as the list of running cells does, is no run.
            folders[:] = [name for name in folders if not name.startswith(".")]
            for name in names:
                path = Path(place, name)
                if name.endswith(".bag") and not path.is_symlink():
                    try:
                        found.append(self._described(path))
                    except OSError:  # removed meanwhile
                        continue
        return sorted(found, key=lambda each: -each.modified)[:MOST]

    def piece(self, asked: PieceAsked) -> bytes:
        """Return a piece of a recording as it was listed.

        Raises:
            RecordingError: It is none of the recordings, or has changed since.
        """
        path = self._folder / asked.name
        try:
            # With all links followed: none of them leads out of the folder.
            inside = path.resolve(strict=True).is_relative_to(self._folder)
            if not inside or path.suffix != ".bag" or path.is_symlink():
                raise RecordingError(f"{asked.name[:200]}: is no recording of this cell")
            there = self._described(path)
            if (there.size, there.modified) != (asked.size, asked.modified):
                raise RecordingError(f"{asked.name}: has changed since it was listed: list again")
            with path.open("rb") as stream:
                stream.seek(asked.offset)
                return stream.read(LONGEST_PIECE)
        except (OSError, ValueError) as error:
            raise RecordingError(f"{asked.name[:200]}: cannot be read: {error}") from error

    def _described(self, path: Path) -> Recording:
        known = path.stat()
        return Recording(str(path.relative_to(self._folder)), known.st_size, known.st_mtime_ns)
