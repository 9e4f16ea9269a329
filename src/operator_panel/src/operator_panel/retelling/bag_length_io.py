"""How long a bag is, from its last few kilobytes: a list of runs must not read whole bags.

Source:
    ROS bag format 2.0: a bag header with the place of the index, where connection records and one
    record for each chunk, with the chunk's first and last time, stand.
"""

from __future__ import annotations

import struct
from functools import lru_cache
from pathlib import Path

MAGIC = b"#ROSBAG V2.0\n"
BAG_HEADER, CHUNK_INFO = 3, 6
MOST_RECORD = 64 * 1024 * 1024  # a length beyond it is no length


class BagLengthError(ValueError):
    """The file is no bag of version 2.0, or is damaged."""


def bag_times(bag: Path) -> tuple[float, float] | None:
    """Return the first and the last time of a bag [s]; None if it was not finished.

    Raises:
        BagLengthError: It is no bag, or is damaged.
        OSError: It cannot be read.
    """
    state = bag.stat()
    return _times(bag, state.st_size, state.st_mtime_ns)


# Size and time of change are a part of the key, so that a bag that has grown is read anew.
@lru_cache(maxsize=256)
def _times(bag: Path, size: int, _: int) -> tuple[float, float] | None:
    with bag.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise BagLengthError(f"{bag.name} is no bag")
        head, _body = _record(file.read(8192), 0)[:2]
        if head.get("op") != bytes([BAG_HEADER]) or len(head.get("index_pos", b"")) != 8:
            raise BagLengthError(f"{bag.name} has no bag header")
        place = struct.unpack("<Q", head["index_pos"])[0]
        # A recorder writes the place of the index when it closes the bag: until then it is 0.
        if not 0 < place < size:
            return None
        file.seek(place)
        index = file.read()
    return _span(bag, index)


def _span(bag: Path, index: bytes) -> tuple[float, float] | None:
    """Return the first and the last time of all chunks."""
    first, last, at = float("inf"), float("-inf"), 0
    while at < len(index):
        head, _, at = _record(index, at)
        if head.get("op") == bytes([CHUNK_INFO]):
            first = min(first, _time(bag, head.get("start_time", b"")))
            last = max(last, _time(bag, head.get("end_time", b"")))
    return (first, last) if last >= first else None


def _record(data: bytes, at: int) -> tuple[dict[str, bytes], bytes, int]:
    """Return the fields and the content of the record at a place, and where the next begins."""
    head, at = _block(data, at)
    body, at = _block(data, at)
    fields: dict[str, bytes] = {}
    place = 0
    while place < len(head):
        field, place = _block(head, place)
        name, _, value = field.partition(b"=")
        fields[name.decode("ascii", "replace")] = value
    return fields, body, at


def _block(data: bytes, at: int) -> tuple[bytes, int]:
    """Return the bytes that follow their own length."""
    if at + 4 > len(data):
        raise BagLengthError("a record is cut off")
    (length,) = struct.unpack_from("<I", data, at)
    if length > MOST_RECORD or at + 4 + length > len(data):
        raise BagLengthError("a record is cut off")
    return data[at + 4 : at + 4 + length], at + 4 + length


def _time(bag: Path, value: bytes) -> float:
    if len(value) != 8:
        raise BagLengthError(f"{bag.name}: a chunk has no time")
    seconds, nanoseconds = struct.unpack("<II", value)
    return float(seconds + 1e-9 * nanoseconds)
