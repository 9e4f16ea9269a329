"""Fetch a recording from a cell, piece by piece; one that was interrupted goes on where it was."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Callable
from pathlib import Path

import msgspec
import zenoh
from scara_config.files.whole_file import sync_folder

from farm.keys import PIECE, RECORDINGS, CellName
from farm.wire import PieceAsked, Recording, encode

ANSWER_S = 5.0
"""Our choice: a piece takes a tenth of a second."""
HALF, NOTE = ".part", ".part.json"
"""Endings of what is there of a recording, and of what it is a part of."""


class FetchError(RuntimeError):
    """The recording cannot be fetched; the text says why and what to do."""


def recordings_of(session: zenoh.Session, cell: CellName) -> list[Recording]:
    """Return the recordings of a cell, the newest first.

    Raises:
        FetchError: The cell does not answer, or with something else.
    """
    data = _asked(session, cell, RECORDINGS, b"")
    try:
        return msgspec.json.decode(data, type=list[Recording])
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise FetchError(f"{cell}: its list of recordings cannot be read: {error}") from error


def fetch(
    session: zenoh.Session,
    cell: CellName,
    recording: Recording,
    target: Path,
    told: Callable[[int], None] = lambda _: None,
) -> None:
    """Fetch a recording; the file has its name when all of it is there, and the cell's time of it.

    Args:
        session: An open session.
        cell: Whose it is.
        recording: As it was listed.
        target: The file.
        told: Is called with how many bytes are there.

    Raises:
        FetchError: The cell does not answer, the recording has changed, the disk is full, or
            another call fetches it. What has come stays beside the target, and the next call goes
            on there.
    """
    half, note = target.with_name(target.name + HALF), target.with_name(target.name + NOTE)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with half.open("ab") as stream:
            # Two calls would write their pieces between each other's.
            fcntl.flock(stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # Another call may have given this file its whole name before it let go of the lock.
            if not half.exists() or not os.path.samestat(os.fstat(stream.fileno()), half.stat()):
                raise BlockingIOError
            wanted = encode(recording)
            # The part of another state of the recording would spoil this one.
            if not note.exists() or note.read_bytes() != wanted:
                stream.truncate(0)
                note.write_bytes(wanted)
            stream.seek(0, os.SEEK_END)
            while (there := stream.tell()) < recording.size:
                told(there)
                asked = PieceAsked(recording.name, recording.size, recording.modified, there)
                piece = _asked(session, cell, PIECE, encode(asked))
                if not piece:
                    raise FetchError(f"{recording.name}: ends after {there} bytes: list again")
                stream.write(piece)
                stream.flush()
            if there != recording.size:
                half.unlink()
                raise FetchError(f"{recording.name}: {there} bytes of {recording.size}: list again")
            told(there)
            os.utime(half, ns=(recording.modified, recording.modified))
            # On the disk before its name is: a power cut must not leave half a file of that name.
            os.fsync(stream.fileno())
            # The file first: a note that is left without its part only has it fetched again.
            half.replace(target)
            note.unlink()
            sync_folder(target.parent)
    except BlockingIOError as error:
        raise FetchError(f"{target}: is being fetched already: wait for its end") from error
    except OSError as error:
        raise FetchError(f"{target}: {error.strerror}") from error


def _asked(session: zenoh.Session, cell: CellName, what: str, payload: bytes) -> bytes:
    """Return a cell's answer.

    Raises:
        FetchError: There is none (at once if nobody there can answer, else after ANSWER_S), or it
            says why not.
    """
    for reply in session.get(cell.key(what), payload=payload, timeout=ANSWER_S):
        if reply.ok is not None:
            return bytes(reply.ok.payload)
        if reply.err is not None:
            raise FetchError(f"{cell}: {bytes(reply.err.payload).decode('utf-8', 'replace')}")
    raise FetchError(f"{cell}: no answer; ./cell farm cells shows which cells are there")
