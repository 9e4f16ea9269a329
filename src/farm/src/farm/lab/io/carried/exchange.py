"""Files between machines of the lab, by way of the scheduler.

The lab gives its files to the scheduler, a worker asks the scheduler for those that it has not. No
worker speaks to another one: workers obey the desk alone. The scheduler keeps them in its own
bounded folder, and answers which version of the project it has.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
from distributed import Client, Scheduler, Worker
from distributed.utils import sync

from farm.lab.io.carried.store import HALF, PIECE_BYTES, Store
from farm.lab.io.carried.version import Version
from farm.lab.io.running import LabError


class Counter:
    """What the scheduler answers about files; its handlers run in its loop, one at a time."""

    def __init__(self, store: Store, version: Version, folder: Path) -> None:
        """Keep files in ``store``, and halves of those that come in ``folder``."""
        self._store, self._version, self._folder = store, version, folder

    def attach(self, scheduler: Scheduler) -> None:
        """Let a scheduler answer."""
        scheduler.handlers.update(
            lab_version=self.version, lab_has=self.has, lab_put=self.put, lab_get=self.get
        )

    def version(self) -> bytes:
        """Return which version the scheduler's machine has."""
        return msgspec.json.encode(self._version)

    def has(self, digest: str) -> bool:
        """Return whether a file is here."""
        return self._store.find(digest) is not None

    def put(self, digest: str, upload: str, offset: int, data: bytes, last: bool) -> str:
        """Take a piece of a file; return what is wrong with it, or an empty text.

        Args:
            digest: Of the whole.
            upload: Which of those who send it at this moment.
            offset: Where the piece begins.
            data: The piece.
            last: Whether it is the last one.
        """
        if not upload.isalnum():
            return f"{upload!r} is no name of an upload"
        half = self._folder / f"{upload}{HALF}"
        try:
            self._folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            with half.open("ab" if offset else "wb") as stream:
                if stream.tell() != offset:
                    return f"a piece came at {offset}, expected at {stream.tell()}"
                stream.write(data)
            if last:
                self._store.keep(digest, pieces_of(half))
                half.unlink()
        except (OSError, LabError) as error:
            half.unlink(missing_ok=True)
            return str(error)
        return ""

    def get(self, digest: str, offset: int) -> bytes | None:
        """Return a piece of a file, empty at its end; None: it is not here."""
        file = self._store.find(digest)
        if file is None:
            return None
        with file.open("rb") as stream:
            stream.seek(offset)
            return stream.read(PIECE_BYTES)


def pieces_of(file: Path) -> Iterator[bytes]:
    """Yield the pieces of a file."""
    with file.open("rb") as stream:
        while piece := stream.read(PIECE_BYTES):
            yield piece


def bring(client: Client, digest: str, file: Path, upload: str) -> None:
    """Give a file to the scheduler, unless it has it.

    Args:
        client: A connection to it.
        digest: Of the file.
        file: Where it is here.
        upload: A name that no other upload has; letters and digits.

    Raises:
        LabError: The scheduler cannot keep it.
        OSError: It cannot be read, or the scheduler has gone.
    """
    if asked(client, "lab_has", digest=digest):
        return
    size, offset = file.stat().st_size, 0
    pieces = pieces_of(file) if size else iter((b"",))
    for piece in pieces:
        last = offset + len(piece) >= size
        said = asked(
            client,
            "lab_put",
            digest=digest,
            upload=upload,
            offset=offset,
            data=piece,
            last=last,
        )
        if said:
            raise LabError(f"{file}: the scheduler cannot keep it: {said}")
        offset += len(piece)


def asked(client: Client, operation: str, **words: Any) -> Any:
    """Return what the scheduler answers to one of its operations above.

    Raises:
        OSError: It has gone.
    """
    if client.scheduler is None:
        raise OSError("the scheduler has gone")
    return client.sync(getattr(client.scheduler, operation), **words)


def fetch(worker: Worker, store: Store, digest: str) -> None:
    """Fetch a file from the scheduler into the worker's own folder; called in a job's thread.

    Raises:
        LabError: The scheduler has it no more.
        OSError: It cannot be kept, or the scheduler has gone.
    """

    def pieces() -> Iterator[bytes]:
        offset = 0
        while piece := _piece(worker, digest=digest, offset=offset):
            yield piece
            offset += len(piece)

    store.keep(digest, pieces())


def _piece(worker: Worker, **words: Any) -> bytes:
    ask: Callable[..., Any] = worker.scheduler.lab_get
    piece = sync(worker.loop, ask, **words)
    if piece is None:
        raise LabError(
            f"the scheduler has the file {words['digest']} no more: too many others came after it; "
            "go on with the same words and --folder, with fewer recordings at a time"
        )
    return bytes(piece)
