"""Copy what can be read of a bag without an index.

A recorder was killed, a disk was full, a file was cut, a disk gave back other bytes.
"""

from __future__ import annotations

import mmap
import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any

from rosbags.rosbag1 import Writer
from rosbags.rosbag1.reader import Header, ReaderError, RecordType, decompressors

MAGIC = b"#ROSBAG V2.0\n"
_OP = b"\x04\x00\x00\x00op="
"""The field that each record's header has: a length of four and a name, then the kind."""
_LONGEST_HEADER = 65_536  # our choice: a topic's name is all in it that has no bound
_LENGTH = struct.Struct("<L")
_KINDS = frozenset(int(kind) for kind in RecordType)


@dataclass
class Repaired:
    """What was copied of a damaged bag: so many messages, and in words what is missing."""

    count: int = 0
    missing: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class _BagRecord:
    """A record at a place: its header, and where its data begins and ends."""

    header: Header
    kind: int
    begin: int
    end: int


def is_indexed(path: Path) -> bool:
    """Say whether the recording of a bag was finished, so that its index can be expected.

    Raises:
        ReaderError: The file is no bag.
    """
    with path.open("rb") as stream:
        if stream.readline(len(MAGIC)) != MAGIC:
            raise ReaderError("File magic is invalid.")
        if path.stat().st_size <= len(MAGIC):
            raise ReaderError("Header could not be read: nothing follows the first line.")
        try:
            return Header.read(stream, RecordType.BAGHEADER).get_uint64("index_pos") != 0
        except (ReaderError, ValueError):  # its first record is damaged
            return False


def repair(damaged: Path, repaired: Path) -> Repaired:
    """Copy all whole messages of ``damaged`` to the new bag ``repaired``.

    The original is left alone. What cannot be read is skipped: a broken chunk costs its own
    messages, a broken record in a plain chunk itself.
    """
    found = Repaired()
    with (
        Writer(repaired) as writer,
        damaged.open("rb") as stream,
        mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data,
    ):
        copy = _Copy(writer, found)
        for header, body in _whole_records(data, len(MAGIC), found.missing):
            copy.take(header, body)
    return found


class _Copy:
    """Writes records of connections and messages into a new bag."""

    def __init__(self, writer: Writer, found: Repaired) -> None:
        self._writer, self._found = writer, found
        self._connections: dict[int, Any] = {}

    def take(self, header: Header, data: bytes) -> None:
        """Copy one record, or note why it cannot be."""
        kind = header.get_uint8("op")
        try:
            number = header.get_uint32("conn") if "conn" in header else -1
            if kind == RecordType.CONNECTION and number not in self._connections:
                fields = Header.read(BytesIO(_LENGTH.pack(len(data)) + data))
                self._connections[number] = self._writer.add_connection(
                    header.get_string("topic"),
                    fields.get_string("type").replace("/", "/msg/"),
                    msgdef=fields.get_string("message_definition"),
                    md5sum=fields.get_string("md5sum"),
                    # Else what a recorder repeats in each part would count as said again.
                    callerid=fields.get_string("callerid") if "callerid" in fields else None,
                    latching=int(fields.get_string("latching")) if "latching" in fields else None,
                )
            elif kind == RecordType.MSGDATA and number in self._connections:
                self._writer.write(self._connections[number], header.get_time("time"), data)
                self._found.count += 1
        except Exception as error:  # whatever the library says to damaged names, types and times
            self._found.missing.append(f"a record that does not fit: {error}")


def _whole_records(
    data: mmap.mmap | bytes, at: int, missing: list[str]
) -> Iterator[tuple[Header, bytes]]:
    """Yield connection and message records from ``at`` on, those of chunks too.

    What is broken is skipped and noted. The records of a plain chunk simply follow its header,
    whether its size is known, still zero, or beyond the end of the file.
    """
    while at < len(data):
        record = _record(data, at)
        if record is None:
            after = _next_record(data, at + 1)
            missing.append(f"{after - at} bytes from byte {at} on are no record")
            at = after
        elif record.kind != RecordType.CHUNK:
            if _is_whole(data, record):
                yield record.header, bytes(data[record.begin : record.end])
                at = record.end
            else:
                at = _next_record(data, record.begin)
                missing.append(f"the record at byte {record.begin} is cut or has a wrong length")
        elif record.header.get("compression") == b"none":
            at = record.begin
        elif record.end > len(data):
            missing.append(f"the chunk at byte {record.begin} is cut")
            at = _next_record(data, record.begin)
        else:
            inner = unpack(record.header, bytes(data[record.begin : record.end]))
            if inner is None:
                missing.append(f"the chunk at byte {record.begin} cannot be unpacked")
            else:
                yield from _whole_records(inner, 0, missing)
            at = record.end


def unpack(header: Header, data: bytes) -> bytes | None:
    """Return a chunk's records, None if they cannot be unpacked."""
    try:
        return decompressors[header.get_string("compression")](data)
    except Exception:  # each library has errors of its own for what it cannot unpack
        return None


def _is_whole(data: mmap.mmap | bytes, record: _BagRecord) -> bool:
    """Return whether a record ends where the data does, or another one begins.

    Where what follows is broken, its length is believed if no record begins within it.
    """
    if record.end >= len(data):
        return record.end == len(data)
    return _record(data, record.end) is not None or (_next_record(data, record.begin) >= record.end)


def _record(data: mmap.mmap | bytes, at: int) -> _BagRecord | None:
    """Return the record that begins at ``at``, None if there is none."""
    if at + _LENGTH.size > len(data):
        return None
    (size,) = _LENGTH.unpack_from(data, at)
    begin = at + _LENGTH.size + size
    if size > _LONGEST_HEADER or begin + _LENGTH.size > len(data):
        return None
    try:
        header = Header.read(BytesIO(bytes(data[at:begin])))
        kind = header.get_uint8("op")
    except (ReaderError, UnicodeDecodeError):
        return None
    if kind not in _KINDS:
        return None
    (length,) = _LENGTH.unpack_from(data, begin)
    return _BagRecord(header, kind, begin + _LENGTH.size, begin + _LENGTH.size + length)


def _next_record(data: mmap.mmap | bytes, at: int) -> int:
    """Return where the next record begins, the end if there is none.

    Each header has the field ``op``, and begins a few hundred bytes before it at most.
    """
    found = data.find(_OP, at)
    while found >= 0:
        for start in range(found - _LENGTH.size, max(at, found - 512) - 1, -1):
            end = start + _LENGTH.size + _LENGTH.unpack_from(data, start)[0]
            holds_it = found + len(_OP) < end <= found + _LONGEST_HEADER
            if holds_it and _record(data, start) is not None:
                return start
        found = data.find(_OP, found + 1)
    return len(data)
