"""Files by their content: a folder that never grows beyond a bound.

A file's name is its sha256, so it is the same wherever it lies, and a broken one is seen. What was
not used for longest goes first. The folder is one of all processes of a machine.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import tempfile
import time
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from farm.lab.io.running import LabError

MOST_BYTES = 4_000_000_000
"""Our choice: some hundred recordings of an hour."""
PIECE_BYTES = 4_000_000
"""Our choice: of a file, in one message."""
FORGOTTEN_S = 3600.0
"""Our choice: a half file that nobody has written to for so long has no writer any more."""
HALF = ".part"
DIGEST = re.compile(r"[0-9a-f]{64}")


class Store:
    """The folder; files come in whole or not at all."""

    def __init__(self, folder: Path, most_bytes: int = MOST_BYTES) -> None:
        """Use ``folder``, which is made when it is needed."""
        self._folder, self._most_bytes = folder, most_bytes

    def find(self, digest: str) -> Path | None:
        """Return a file, and count it as used; None: it is not here.

        Raises:
            LabError: ``digest`` is none.
        """
        file = self._path(digest)
        try:
            os.utime(file)
        except FileNotFoundError:
            return None
        return file

    def keep(self, digest: str, pieces: Iterable[bytes]) -> Path:
        """Keep a file that comes in pieces.

        Raises:
            LabError: It is not what its digest says.
            OSError: It cannot be written.
        """
        file, read = self._path(digest), hashlib.sha256()
        self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        number, half = tempfile.mkstemp(suffix=HALF, dir=self._folder)
        try:
            with os.fdopen(number, "wb") as stream:
                for piece in pieces:
                    read.update(piece)
                    stream.write(piece)
            if read.hexdigest() != digest:
                raise LabError(f"a file came as {read.hexdigest()}, not as {digest}")
            os.replace(half, file)
        finally:
            with suppress(FileNotFoundError):
                os.unlink(half)
        self._bound(file)
        return file

    def copy(self, digest: str, target: Path) -> bool:
        """Copy a file out, so that a job cannot change it here; return whether it is here, whole.

        Raises:
            OSError: It cannot be copied.
        """
        file = self.find(digest)
        if file is None:
            return False
        try:
            shutil.copyfile(file, target)
        except FileNotFoundError:
            return False  # it went meanwhile
        if digest_of(target) == digest:
            return True
        file.unlink(missing_ok=True)
        target.unlink()
        return False

    def _path(self, digest: str) -> Path:
        if not DIGEST.fullmatch(digest):
            raise LabError(f"{digest!r} is no sha256")
        return self._folder / digest

    def _bound(self, newest: Path) -> None:
        """Remove what was not used for longest, and halves that nobody writes any more."""
        files = []
        for file in self._folder.iterdir():
            with suppress(FileNotFoundError):
                known = file.stat()
                if file.suffix != HALF:
                    files.append((known.st_mtime, file, known.st_size))
                elif known.st_mtime < time.time() - FORGOTTEN_S:
                    file.unlink()
        held = sum(size for _, _, size in files)
        for _, file, size in sorted(files):
            if held <= self._most_bytes:
                return
            if file != newest:
                file.unlink(missing_ok=True)
                held -= size


def digest_of(file: Path) -> str:
    """Return the sha256 of a file.

    Raises:
        OSError: It cannot be read.
    """
    found = hashlib.sha256()
    with file.open("rb") as stream:
        while piece := stream.read(PIECE_BYTES):
            found.update(piece)
    return found.hexdigest()
