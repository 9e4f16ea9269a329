"""Copy what can be read of a bag without an index.

A recorder was killed, a disk was full, a file was cut.
"""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

from rosbags.rosbag1 import Writer
from rosbags.rosbag1.reader import (
    Header,
    ReaderError,
    RecordType,
    decompressors,
    read_bytes,
    read_uint32,
)

MAGIC = b"#ROSBAG V2.0\n"


def is_indexed(path: Path) -> bool:
    """Say whether the recording of a bag was finished, so that its index can be expected.

    Raises:
        ReaderError: The file is no bag.
    """
    with path.open("rb") as stream:
        if stream.readline(len(MAGIC)) != MAGIC:
            raise ReaderError("File magic is invalid.")
        return Header.read(stream, RecordType.BAGHEADER).get_uint64("index_pos") != 0


def repair(damaged: Path, repaired: Path) -> int:
    """Copy all whole messages of ``damaged`` to the new bag ``repaired``.

    The original is left alone.

    Returns:
        Number of messages.
    """
    writer = Writer(repaired)
    count = 0
    with writer, damaged.open("rb") as stream:
        connections = {}
        for header, data in _whole_records(stream):
            kind = header.get_uint8("op")
            number = header.get_uint32("conn") if "conn" in header else -1
            if kind == RecordType.CONNECTION and number not in connections:
                fields = Header.read(BytesIO(len(data).to_bytes(4, "little") + data))
                connections[number] = writer.add_connection(
                    header.get_string("topic"),
                    fields.get_string("type").replace("/", "/msg/"),
                    msgdef=fields.get_string("message_definition"),
                    md5sum=fields.get_string("md5sum"),
                )
            elif kind == RecordType.MSGDATA and number in connections:
                writer.write(connections[number], header.get_time("time"), data)
                count += 1
    return count


def _whole_records(stream: BinaryIO) -> Iterator[tuple[Header, bytes]]:
    """Yield connection and message records of all chunks, until the file breaks off.

    The unfinished last chunk is included.
    """
    stream.seek(len(MAGIC))
    try:
        while True:
            header = Header.read(stream)
            kind, size = header.get_uint8("op"), read_uint32(stream)
            if kind != RecordType.CHUNK:
                yield header, read_bytes(stream, size)
            elif header.get_string("compression") != "none":
                yield from _records_of_chunk(
                    decompressors[header.get_string("compression")](read_bytes(stream, size))
                )
            # the records of a plain chunk simply follow, whether its size is known, still zero, or
            # beyond the end of the file
    except (ReaderError, UnicodeDecodeError):
        return


def _records_of_chunk(data: bytes) -> Iterator[tuple[Header, bytes]]:
    """Yield the records of one whole chunk."""
    stream = BytesIO(data)
    while stream.tell() < len(data):
        header = Header.read(stream)
        yield header, read_bytes(stream, read_uint32(stream))
