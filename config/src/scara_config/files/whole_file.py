"""Write a file that is whole, or as it was: a reader never sees half of one."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

OWNER_ONLY = 0o600
"""Mode of a file that nobody else may read."""


@contextlib.contextmanager
def whole_file(path: Path, mode: int = 0o644, half: str = "") -> Iterator[BinaryIO]:
    """Yield a stream whose content takes the place of ``path`` when the body has ended.

    It is written beside ``path``, synced, then renamed over it. A symbolic link is replaced.

    Args:
        path: In a folder that is there.
        mode: Of the file.
        half: Ending of the name of the file that is not whole yet; a process that is killed
            leaves it behind.

    Raises:
        OSError: The folder or the file cannot be written; the old file is untouched then, as
            after any error of the body.
    """
    # mkstemp's files are their owner's alone until they are whole.
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=half, dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as stream:
            yield stream
            # On the disk before its name is: a power cut must not leave an empty file of that name.
            stream.flush()
            os.fsync(stream.fileno())
        os.chmod(name, mode)
        os.replace(name, path)
    # Ctrl-C too: half a file must not stay beside the one that is whole.
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def write_whole(path: Path, content: bytes, mode: int = 0o644) -> None:
    """Write a file at once; see :func:`whole_file`.

    Raises:
        OSError: It cannot be written.
    """
    with whole_file(path, mode) as stream:
        stream.write(content)


def sync_folder(folder: Path) -> None:
    """Make the names in a folder safe from a power cut: a file's own sync keeps its content only.

    Raises:
        OSError: The disk fails.
    """
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
