"""What the program that reads a recording tells the page's server, line by line; pure.

A line is msgpack, since a snapshot may hold infinite numbers, with its length before it.
"""

from __future__ import annotations

import zlib
from typing import TypeAlias

import msgspec

from operator_panel.view.events import Event
from operator_panel.view.snapshot import Part, Snapshot

LENGTH = 4
"""Bytes before each line: how long it is, big-endian."""
QUICK = 1  # our choice: a third of the size for 20 us


class Head(msgspec.Struct, frozen=True, tag=True):
    """The first line.

    Attributes:
        first: Time of receipt of the first message [s], ROS time.
        last: Of the last one.
        robot: Name of the robot; empty if the recording does not say it.
    """

    first: float
    last: float
    robot: str


class Parts(msgspec.Struct, frozen=True, tag=True):
    """Where the parts of each side are from now on."""

    parts: dict[str, tuple[Part, ...]]


class Told(msgspec.Struct, frozen=True, tag=True):
    """A moment; ``snapshot`` is one encoded and packed, opened when somebody looks at it."""

    at: float
    snapshot: bytes


class Happened(msgspec.Struct, frozen=True, tag=True):
    """Something happened at a time."""

    at: float
    event: Event


Line: TypeAlias = Head | Parts | Told | Happened

_ENCODE = msgspec.msgpack.Encoder().encode
_LINE: msgspec.msgpack.Decoder[Line] = msgspec.msgpack.Decoder(Line)
_SNAPSHOT = msgspec.msgpack.Decoder(Snapshot)


def told(at: float, snapshot: Snapshot) -> Told:
    """Return a moment with its snapshot packed."""
    return Told(at, zlib.compress(_ENCODE(snapshot), QUICK))


def snapshot_of(moment: Told) -> Snapshot:
    """Return what the page knew at a moment."""
    return _SNAPSHOT.decode(zlib.decompress(moment.snapshot))


def packed(line: Line) -> bytes:
    """Return a line with its length before it."""
    body = _ENCODE(line)
    return len(body).to_bytes(LENGTH, "big") + body


def unpacked(body: bytes) -> Line:
    """Return the line that ``body``, without its length, is.

    Raises:
        msgspec.DecodeError: It is none.
    """
    return _LINE.decode(body)
