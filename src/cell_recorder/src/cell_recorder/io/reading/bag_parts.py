"""The parts of one recording, read as one bag; of several, only one is open at a time."""

from __future__ import annotations

import contextlib
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection
from rosbags.rosbag1 import Reader


class Parts:
    """What the reader of one bag offers, over all parts.

    The recorder repeats the last message of each latched topic at the beginning of a part, so that
    the part can be read alone. Such a repetition is left out here, but it is counted.
    """

    def __init__(self, readers: Sequence[Reader]) -> None:
        """Take over opened readers, at least one, in the order of the parts; see :meth:`close`."""
        self.files = [Path(str(reader.path)) for reader in readers]
        self.connections: list[Connection] = []
        self.counts: Counter[str] = Counter()
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
                # No connection would mean all of them to the reader.
                for connection, stamp, data in reader.messages(wanted) if wanted else ():
                    if getattr(connection.ext, "latching", None):
                        earlier = said.setdefault(connection.topic, set())
                        if number and stamp == reader.start_time and bytes(data) in earlier:
                            continue
                        earlier.add(bytes(data))
                    yield connection, stamp, data

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
