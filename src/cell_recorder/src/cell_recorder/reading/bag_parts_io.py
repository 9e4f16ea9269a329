"""The parts of one recording, read as one bag; of several, only one is open at a time.

A chunk that cannot be unpacked costs its own messages, and it is said which are missing.
"""

from __future__ import annotations

import contextlib
import heapq
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection
from rosbags.rosbag1 import Reader
from rosbags.rosbag1.reader import Header, ReaderError, RecordType, read_bytes, read_uint32


class BagParts:
    """What the reader of one bag offers, over all parts.

    The recorder repeats the last message of each latched topic at the beginning of a part, so that
    the part can be read alone. Such a repetition is left out here, but it is counted.
    """

    def __init__(self, readers: Sequence[Reader]) -> None:
        """Take over opened readers, at least one, in the order of the parts; see :meth:`close`."""
        self.files = [Path(str(reader.path)) for reader in readers]
        self.connections: list[Connection] = []
        self.counts: Counter[str] = Counter()
        self.missing: dict[tuple[str, int], set[int]] = {}
        """Messages that could not be read so far: where they stand in a chunk, by file and chunk.

        Who reads a topic twice misses no more than who reads it once.
        """
        for reader in readers:
            self.connections += reader.connections
            self.counts.update({name: info.msgcount for name, info in reader.topics.items()})
        held = [reader for reader in readers if reader.message_count] or list(readers)
        self.start_time = held[0].start_time
        self.end_time = held[-1].end_time
        self._only = readers[0] if len(readers) == 1 else None
        if self._only is None:
            for reader in readers:
                reader.close()

    def messages(self, topics: Collection[str]) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield connection, time of receipt [ns] and data of the messages of ``topics``, in order.

        Args:
            topics: Names as recorded.
        """
        said: dict[str, set[bytes]] = {}
        for number, file in enumerate(self.files):
            opened = contextlib.nullcontext(self._only) if self._only else Reader(file)
            with opened as reader:
                wanted = [each for each in reader.connections if each.topic in topics]
                for connection, stamp, data in self._whole_messages(reader, wanted):
                    if getattr(connection.ext, "latching", None):
                        earlier = said.setdefault(connection.topic, set())
                        if number and stamp == reader.start_time and bytes(data) in earlier:
                            continue
                        earlier.add(bytes(data))
                    yield connection, stamp, data

    def _whole_messages(
        self, reader: Reader, wanted: Collection[Connection]
    ) -> Iterator[tuple[Connection, int, bytes]]:
        """Yield the messages of connections in order, by the index of an open bag.

        What the index names and cannot be read is left out, and noted once for each chunk.
        """
        connections = list(wanted)
        entries = heapq.merge(
            *(
                [(one.time, one.chunk_pos, one.offset, number) for one in reader.indexes[each.id]]
                for number, each in enumerate(connections)
            )
        )
        held, records = -1, None
        for stamp, position, offset, number in entries:
            if position != held:
                held, records = position, self._unpack(reader, position)
            data = None if records is None else _message(records, offset, stamp)
            if data is None:
                self.missing.setdefault((str(reader.path), position), set()).add(offset)
            else:
                yield connections[number], stamp, data

    def _unpack(self, reader: Reader, position: int) -> bytes | None:
        """Return the records of the chunk at ``position``, None if they cannot be read."""
        chunk = reader.chunks.get(position)
        if chunk is None or reader.bio is None:
            return None
        try:
            reader.bio.seek(chunk.datapos)
            return chunk.decompressor(read_bytes(reader.bio, chunk.datasize))
        except Exception:  # each library has errors of its own for what it cannot unpack
            return None

    def arrivals(self) -> Iterator[NDArray[np.int64]]:
        """Yield the times of receipt [ns] of all messages, sorted, one part after another."""
        for file in self.files:
            opened = contextlib.nullcontext(self._only) if self._only else Reader(file)
            with opened as reader:
                times = [entry.time for index in reader.indexes.values() for entry in index]
            yield np.sort(np.array(times, dtype=np.int64))

    def close(self) -> None:
        """Close the file that is still open."""
        if self._only is not None:
            self._only.close()


def _message(records: bytes, offset: int, stamp: int) -> bytes | None:
    """Return the data of the message at ``offset`` of a chunk, None if it is not what was indexed.

    A connection's record may stand before it.
    """
    stream = BytesIO(records)
    stream.seek(offset)
    try:
        while True:
            header = Header.read(stream)
            kind, data = header.get_uint8("op"), read_bytes(stream, read_uint32(stream))
            if kind == RecordType.MSGDATA:
                return data if header.get_time("time") == stamp else None
            if kind != RecordType.CONNECTION:
                return None
    except (ReaderError, UnicodeDecodeError):
        return None
