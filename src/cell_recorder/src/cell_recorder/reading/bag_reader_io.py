"""Read a bag without ROS.

Message types come from the bag itself, an unfinished bag is repaired on a copy. The parts of a long
recording are read as one.
"""

from __future__ import annotations

import contextlib
import itertools
import logging
import tempfile
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection, MessageDefinitionFormat
from rosbags.rosbag1 import Reader
from rosbags.rosbag1.reader import ReaderError
from rosbags.rosbag1.writer import WriterError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from cell_recorder.reading.bag_parts_io import BagParts
from cell_recorder.reading.bag_repair_io import is_indexed, repair
from cell_recorder.recording.recording import part_path
from cell_recorder.recording.runs_folder_io import parts_of

Array = NDArray[np.float64]

_LOG = logging.getLogger("rosout.bag_reader")
_TOLD = 20  # our choice: so many gaps of a bag are told; all of them are in Bag.missing


class BagError(RuntimeError):
    """The bag cannot be read, or does not hold what is needed; the text names it."""


class Bag:
    """An open bag.

    Topics are asked for by their relative name, in any namespace of the cell.
    """

    def __init__(self, path: Path, reader: BagParts, repaired: bool, lost: list[str]) -> None:
        """Wrap what is open; use :func:`open_bag`."""
        self.path = path
        self.repaired = repaired
        self._lost = lost
        self._reader = reader
        self._store = get_typestore(Stores.EMPTY)
        self._known: set[str] = set()

    @property
    def readable(self) -> list[Path]:
        """The files that are read.

        The bag itself with its further parts; for one that was damaged its repaired copy, which
        lasts as long as this bag is open.
        """
        return self._reader.files

    @property
    def missing(self) -> list[str]:
        """What could not be read, in words: parts, by the repair, and of what was read so far."""
        return self._lost + [
            f"{len(gone)} {'message' if len(gone) == 1 else 'messages'} of the chunk at byte "
            f"{position} of {Path(file).name}"
            for (file, position), gone in self._reader.missing.items()
        ]

    @property
    def topics(self) -> dict[str, int]:
        """Topic, as recorded, to number of messages."""
        return dict(sorted(self._reader.counts.items()))

    @property
    def start(self) -> float:
        """Time of receipt of the first message [s], ROS time."""
        return self._reader.start_time * 1e-9

    @property
    def end(self) -> float:
        """Time of receipt of the last message [s], ROS time."""
        return self._reader.end_time * 1e-9

    def count(self, topic: str) -> int:
        """Return how many messages of a topic there are."""
        return sum(c.msgcount for c in self._connections(topic))

    def kind(self, topic: str) -> str:
        """Return the message type of a topic, ``package/msg/Type``.

        Empty if it is not in the bag.
        """
        return next((each.msgtype for each in self._connections(topic)), "")

    def require(self, topics: Collection[str]) -> None:
        """Check that each topic has messages.

        Raises:
            BagError: Some have none; all of them are named.
        """
        missing = [topic for topic in topics if not self.count(topic)]
        if missing:
            held = (
                ", ".join(f"{name} ({count})" for name, count in self.topics.items()) or "nothing"
            )
            raise BagError(f"{self.path}: no message of {', '.join(missing)}; the bag holds {held}")

    def messages(self, topic: str) -> Iterator[tuple[float, Any]]:
        """Yield receive time [s] and message of a topic, in order.

        Raises:
            BagError: The bag holds this topic of more than one cell, or a message does not fit its
                definition.
        """
        connections = self._connections(topic)
        if not connections:
            return
        for connection in connections:
            self._learn(connection)
        names = {connection.topic for connection in connections}
        for connection, stamp, raw in self._reader.messages(names):
            yield stamp * 1e-9, self._read(raw, connection)

    def merged(self, topics: Collection[str]) -> Iterator[tuple[float, str, Callable[[], Any]]]:
        """Yield receive time [s], topic and a reader of the message of several topics, in order.

        What is not read costs nothing but its copy. ``topics`` are relative names; one that is not
        in the bag is left out.

        Raises:
            BagError: As :meth:`messages`; what the reader of a message raises is one too.
        """
        names: dict[str, str] = {}
        for topic in topics:
            for connection in self._connections(topic):
                self._learn(connection)
                names[connection.topic] = topic
        for connection, stamp, raw in self._reader.messages(names.keys()):
            yield stamp * 1e-9, names[connection.topic], partial(self._read, raw, connection)

    def _read(self, raw: bytes, connection: Connection) -> Any:
        """Return the message that ``raw`` is."""
        try:
            return self._store.deserialize_ros1(raw, connection.msgtype)
        except Exception as error:  # what the library's code for this type meets in damaged data
            raise BagError(
                f"{self.path}: {connection.topic}: a message is no {connection.msgtype}: {error!r}"
            ) from error

    def arrivals(self) -> Iterator[Array]:
        """Yield the times of receipt of all messages of all topics [s], sorted, part by part."""
        for times in self._reader.arrivals():
            yield np.asarray(times * 1e-9, dtype=np.float64)

    def _connections(self, topic: str) -> list[Connection]:
        """Return the connections of a relative topic name."""
        suffix = topic if topic.startswith("/") else f"/{topic}"
        found = [c for c in self._reader.connections if c.topic.endswith(suffix)]
        names = sorted({c.topic for c in found})
        if len(names) > 1:
            raise BagError(
                f"{self.path}: {topic} was recorded of more than one cell: {', '.join(names)}"
            )
        return found

    def _learn(self, connection: Connection) -> None:
        """Register the message type of a connection from the definition in the bag."""
        if connection.msgtype in self._known:
            return
        if connection.msgdef.format != MessageDefinitionFormat.MSG:
            raise BagError(
                f"{self.path}: {connection.topic}: the bag holds no definition of "
                f"{connection.msgtype}"
            )
        try:
            types = get_types_from_msg(connection.msgdef.data, connection.msgtype)
            self._store.register(
                {name: kind for name, kind in types.items() if name not in self._store.fielddefs}
            )
        except Exception as error:  # the grammar's own errors for a damaged definition
            raise BagError(
                f"{self.path}: {connection.topic}: the definition of {connection.msgtype} in the "
                f"bag cannot be read: {error!r}"
            ) from error
        self._known.add(connection.msgtype)


@contextmanager
def open_bag(path: Path | str) -> Iterator[Bag]:
    """Open a bag for reading, with the further parts of the recording that it begins.

    One that was not finished, or is cut, is repaired on a temporary copy first.

    Raises:
        BagError: There is no such file, it is no bag, or no message of it can be read.
    """
    path = Path(path)
    with tempfile.TemporaryDirectory(prefix="bag_") as folder, contextlib.ExitStack() as opened:
        parts = [path, *(part for part in parts_of(path) if part != path)]
        readers, lost, repaired = [], _gone(parts), False
        for number, part in enumerate(parts):
            try:
                reader = _try_index(part) if is_indexed(part) else None
                if reader is None:
                    repaired = True
                    copy = Path(folder) / f"repaired_{number}.bag"
                    found = repair(part, copy)
                    lost += [f"{part.name}: {text}" for text in found.missing]
                    reader = _try_index(copy) if found.count else None
            except FileNotFoundError as error:
                raise BagError(f"{part}: there is no such bag") from error
            except (ReaderError, WriterError, OSError) as error:
                # A power cut leaves a last part without its first bytes: the others are whole.
                if number == 0 or not isinstance(error, ReaderError):
                    raise BagError(f"{part}: is no readable bag: {error}") from error
                repaired, reader = True, None
                lost.append(f"{part.name}: is no readable bag: {error}")
            if reader is not None:
                opened.callback(reader.close)
                readers.append(reader)
        if not readers:
            raise BagError(f"{path}: the recording was not finished and no whole message is in it")
        opened.pop_all()
        reader_of_all = BagParts(readers)
        bag = Bag(path, reader_of_all, repaired, lost)
        try:
            yield bag
        finally:
            for text in bag.missing[:_TOLD]:
                _LOG.warning("%s: missing: %s", path, text)
            reader_of_all.close()


def _gone(parts: list[Path]) -> list[str]:
    """Return which parts before the last one are not there, in words."""
    numbers = [1, *(int(part.stem.rpartition(".part")[2]) for part in parts[1:])]
    texts = []
    for before, behind in itertools.pairwise(numbers):
        if before + 1 < behind:
            names = [part_path(parts[0], k).name for k in sorted({before + 1, behind - 1})]
            texts.append(f"{' to '.join(names)}: there is no such part")
    return texts


def _try_index(path: Path) -> Reader | None:
    """Return the opened bag, or None if its index is damaged."""
    reader = Reader(path)
    try:
        reader.open()
    except Exception:  # whatever the library meets in a damaged index; it has closed the file
        return None
    return reader
