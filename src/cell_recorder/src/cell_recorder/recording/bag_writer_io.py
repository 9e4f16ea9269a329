"""Write raw messages to a bag from a thread of its own.

A crash loses at most two write periods.
"""

from __future__ import annotations

import contextlib
import errno
import os
import threading
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

from rosbag.bag import ROSBagException

from cell_recorder.recording.ordered_bag_io import OrderedBag
from cell_recorder.recording.recording import MARKER, RecorderSettings, RecordingStatus, part_path
from cell_recorder.recording.runs_folder_io import mark_of, parts_of

NEEDED_FIELDS = ("type", "md5sum", "message_definition")
KEPT_FIELDS = (*NEEDED_FIELDS, "callerid", "latching")
LARGEST_CHUNK = (
    256 * 1024
)  # our choice: a burst is cut into chunks of this size, none stays in memory
MARK_TEXT = """This recording belongs to no experiment. When the runs folder has grown beyond
runs_limit_mb of experiments.yaml, the recorder removes it. Delete this file to keep it.
"""
_SET_BACK_NS = 60 * 10**9  # our choice: no thread is overtaken by so much, also in a standstill
CLOSE_DEADLINE_S = 30.0  # our choice: a slow disk gets this long to take the rest


class BagWriterError(RuntimeError):
    """The bag cannot be opened or did not close in time."""


class Raw(NamedTuple):
    """One message as it came from the wire."""

    topic: str
    header: Mapping[str, str]
    data: bytes
    stamp_ns: int


class BagWriter:
    """One recording, in parts that are whole bags.

    Every write period all waiting messages become one complete chunk, handed to the kernel.
    ``put`` may be called by any thread and never waits for the disk. Stamps never run backwards: a
    message that was overtaken gets the stamp of the one before it.

    A part that has become too large or too long is closed, and the next one begins with the last
    message of each latched topic, at the stamp of its first message. Until an experiment marks it,
    a file beside the recording says that it may be removed.
    """

    def __init__(self, path: Path, settings: RecorderSettings) -> None:
        """Create the first part, with its folder if need be.

        Raises:
            BagWriterError: The file, or a part of an older recording of that name, exists already,
                or it cannot be created.
        """
        self.path = path
        self._settings = settings
        self._parts, self._part_start_ns, self._size_before = 0, 0, 0
        # Said once for all: each part begins with these, so that it can be read alone.
        self._latched: dict[tuple[str, str], Raw] = {}
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            if older := parts_of(path):
                raise FileExistsError(errno.EEXIST, f"File exists: {older[0].name}")
            self._open_part()
            # Never before the bag: beside an older one of that name the mark would end it.
            self._mark: Path | None = mark_of(path)
            try:
                self._mark.write_text(MARK_TEXT, encoding="ascii")
            except OSError:
                path.unlink()
                raise
        except OSError as error:
            raise BagWriterError(f"{path}: cannot be created: {error.strerror}") from error
        self._lock = threading.Lock()
        self._waiting: deque[Raw] = deque()
        # Of the newest stamp: bags are read in order, so none may be earlier.
        self._last_ns = 0
        # So much is added to the stamps since the clock was set back, and how often it was.
        self._shift_ns = self._set_back = 0
        # By topic, the header of its first message. Others of that name must have its type.
        self._kept: dict[str, Mapping[str, str]] = {}
        # Refused were unreadable; dropped came while the queue was full or the recording had
        # failed.
        self._messages = self._size = self._dropped = self._refused = 0
        self._failure = ""
        # Cleared before the thread ends: what comes later is counted, not lost in silence.
        self._accepting = True
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, name="bag_writer", daemon=True)
        self._thread.start()

    def put(self, topic: str, header: Mapping[str, str], data: bytes, stamp_ns: int) -> None:
        """Take one message; count it as dropped if the queue is full or the recording has ended.

        Args:
            topic: Resolved name.
            header: Connection header of the publisher.
            data: Serialised message.
            stamp_ns: When it was received [ns], ROS time.
        """
        with self._lock:
            if not self._accepting or len(self._waiting) >= self._settings.queue_messages:
                self._dropped += 1
                return
            if self._last_ns - (stamp_ns + self._shift_ns) > _SET_BACK_NS:
                # Else all that comes until the clock is there again would have one stamp.
                self._shift_ns = self._last_ns - stamp_ns
                self._set_back += 1
            self._last_ns = max(self._last_ns, stamp_ns + self._shift_ns)
            self._waiting.append(Raw(topic, header, data, self._last_ns))

    @property
    def status(self) -> RecordingStatus:
        """Counts of this recording."""
        with self._lock:
            return RecordingStatus(
                path=str(self.path),
                active=self._accepting,
                messages=self._messages,
                size=self._size,
                parts=self._parts,
                waiting=len(self._waiting),
                dropped=self._dropped,
                refused=self._refused,
                set_back=self._set_back,
                failure=self._failure,
            )

    def close(self) -> RecordingStatus:
        """Write what is waiting, finish the index, close the file.

        Raises:
            BagWriterError: The disk did not take the rest in time.
        """
        with self._lock:
            self._accepting = False
        self._stop.set()
        self._thread.join(CLOSE_DEADLINE_S)
        if self._thread.is_alive():
            raise BagWriterError(f"{self.path}: still being written after {CLOSE_DEADLINE_S:g} s")
        return self.status

    def _run(self) -> None:
        """Write until stopped or until the disk refuses; always leave the file closed."""
        try:
            while not self._stop.wait(self._settings.write_period_ms * 1e-3):
                # Raise OSError while there is still room for the index
                disk = os.statvfs(self.path.parent)
                free_mb = disk.f_bavail * disk.f_frsize / 1e6
                if free_mb < self._settings.min_free_mb:
                    raise OSError(
                        f"only {free_mb:.0f} MB free on the disk, min_free_mb is "
                        f"{self._settings.min_free_mb:g}"
                    )
                self._write_waiting()
            self._write_waiting()
        except Exception as error:
            self._fail(error)
        try:
            self._bag.close()
        except Exception as error:
            self._fail(error)
            with contextlib.suppress(OSError):
                self._file.close()

    def _open_part(self) -> None:
        """Create the next part."""
        path = Path(part_path(self.path, self._parts + 1))
        self._file: Any = path.open("x+b")
        self._bag = OrderedBag(self._file, "w", chunk_threshold=LARGEST_CHUNK)
        self._parts += 1

    def _write_waiting(self) -> None:
        """Write all waiting messages as one complete chunk."""
        count, written = len(self._waiting), 0
        if count:
            stamp_ns, size = self._waiting[0].stamp_ns, self._size - self._size_before
            self._part_start_ns = self._part_start_ns or stamp_ns
            long = stamp_ns - self._part_start_ns >= self._settings.part_minutes * 60e9
            if long or size >= self._settings.part_mb * 1e6:
                # Close this part and begin the next one, which then has all that was said only
                # once
                self._bag.close()
                self._size_before += Path(part_path(self.path, self._parts)).stat().st_size
                self._open_part()
                self._part_start_ns = stamp_ns
                for message in self._latched.values():
                    first = self._kept[message.topic]
                    self._bag.append(message.topic, first, message.data, stamp_ns)
        try:
            for _ in range(count):
                written += self._write(self._waiting.popleft())
        finally:
            with self._lock:
                self._messages += written
        if count:
            self._bag.flush()
            self._file.flush()
            size = self._size_before + self._file.tell()
            with self._lock:
                self._size = size
                self._refused += count - written

    def _write(self, message: Raw) -> bool:
        """Write one message; return whether it was taken.

        It is refused without a definition, or if its type is not that of the topic's first.
        """
        first = self._kept.get(message.topic)
        if first is None:
            first = {name: message.header[name] for name in KEPT_FIELDS if name in message.header}
            if not all(first.get(name) for name in NEEDED_FIELDS):
                return False
            self._kept[message.topic] = first
        elif message.header.get("md5sum") != first["md5sum"]:
            return False
        try:
            self._bag.append(message.topic, first, message.data, message.stamp_ns)
        except (ROSBagException, ValueError):
            return False
        if message.header.get("latching") == "1":
            self._latched[message.topic, message.header.get("callerid", "")] = message
        if self._mark is not None and message.topic.endswith(MARKER):
            self._mark.unlink(missing_ok=True)
            self._mark = None
        return True

    def _fail(self, error: Exception) -> None:
        """End the recording by itself; the first reason is kept, what waits is lost and counted."""
        with self._lock:
            self._accepting = False
            self._dropped += len(self._waiting)
            self._waiting.clear()
            self._failure = self._failure or str(error)
