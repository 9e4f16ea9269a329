"""Convert a bag to one MCAP file, for Foxglove and PlotJuggler.

Check that it reads back whole.
"""

from __future__ import annotations

import hashlib
import shutil
import tempfile
from collections import Counter, defaultdict
from collections.abc import Sequence
from enum import Enum
from pathlib import Path
from typing import Any

from cell_recorder.io.reading.bag_reader import BagError, open_bag
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.convert.converter import ConverterError, convert
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.rosbag1 import Reader
from rosbags.rosbag2 import ReaderError
from scara_config.text_enum import StrEnum

VERSION = 9  # of the ROS 2 bag format that the file is written in


class Profile(StrEnum):
    """In which form the messages stand in the file."""

    ROS1 = "ros1"
    """As they were recorded, byte by byte, with their own definitions and senders."""
    ROS2 = "ros2"
    """In their ROS 2 form (no ``header.seq``), for tools that know no other."""


class Compression(Enum):
    """Of the chunks of the file."""

    NONE = "none"
    LZ4 = "lz4"
    ZSTD = "zstd"


def convert_to_mcap(
    bag: Path,
    target: Path,
    profile: Profile = Profile.ROS2,
    compression: Compression = Compression.NONE,
) -> dict[str, int]:
    """Write the messages of a bag to the new file ``target``.

    Args:
        bag: Recording; an unfinished one is repaired on a copy.
        target: Not there yet.
        profile: Form of the messages.
        compression: Of the chunks; LZ4 goes with the profile ROS1 only.

    Returns:
        Topic to number of messages, as read back from the file.

    Raises:
        BagError: The bag cannot be read, the target exists or cannot be written, it does not read
            back whole, or profile and compression do not go together.
    """
    if target.exists():
        raise BagError(f"{target}: exists already")
    if (profile, compression) == (Profile.ROS2, Compression.LZ4):
        raise BagError("compression lz4: goes with profile ros1; with ros2: none or zstd")
    with open_bag(bag) as opened, tempfile.TemporaryDirectory(prefix="mcap_") as folder:
        try:
            if profile is Profile.ROS1:
                made, counts = _as_recorded(
                    opened.readable, Path(folder, "whole.mcap"), compression
                )
            else:
                made, counts = _as_ros2(opened.readable, Path(folder, "converted"), compression)
        except (ConverterError, ReaderError, AnyReaderError, McapError, OSError) as error:
            raise BagError(f"{bag}: cannot be converted: {error}") from error
        if counts != opened.topics:
            raise BagError(
                f"{bag}: {sum(counts.values())} of {sum(opened.topics.values())} messages read back"
            )
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.move(made, target)
        except OSError as error:
            raise BagError(f"{target}: cannot be written: {error.strerror}") from error
        return counts


def _as_ros2(
    parts: Sequence[Path], made: Path, compression: Compression
) -> tuple[Path, dict[str, int]]:
    """Convert the messages; return the file, and what could be decoded of it."""
    packed = None if compression is Compression.NONE else compression.value
    convert(parts, made, "mcap", VERSION, packed, "storage", None, None, (), (), (), ())
    counts: Counter[str] = Counter()
    with AnyReader([made]) as reader:
        for connection, _, raw in reader.messages():
            reader.deserialize(raw, connection.msgtype)
            counts[connection.topic] += 1
    return next(made.glob("*.mcap")), dict(sorted(counts.items()))


def _as_recorded(
    parts: Sequence[Path], made: Path, compression: Compression
) -> tuple[Path, dict[str, int]]:
    """Write the messages as they are; return the file, and what of it is as it was."""
    digests: dict[str, Any] = defaultdict(hashlib.sha256)
    with made.open("wb") as file:
        writer = Writer(file, compression=CompressionType[compression.name])
        writer.start(profile=str(Profile.ROS1), library="twin_experiments")
        for part in parts:
            _copy(part, writer, digests)
        writer.finish()  # type: ignore[no-untyped-call]
    counts: Counter[str] = Counter()
    read: dict[str, Any] = defaultdict(hashlib.sha256)
    with made.open("rb") as file:
        for _, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            read[channel.topic].update(message.data)
            counts[channel.topic] += 1
    whole = [topic for topic in counts if read[topic].digest() == digests[topic].digest()]
    return made, {topic: counts[topic] for topic in sorted(whole)}


def _copy(part: Path, writer: Writer, digests: dict[str, Any]) -> None:
    """Copy one part of a recording."""
    with Reader(part) as reader:
        channels = {}
        for connection in reader.connections:
            name = connection.msgtype.replace("/msg/", "/")
            schema = writer.register_schema(name, "ros1msg", connection.msgdef.data.encode())
            told = {"md5sum": connection.digest, "topic": connection.topic}
            for key in ("callerid", "latching"):
                if value := getattr(connection.ext, key, None):
                    told[key] = str(value)
            channels[connection.id] = writer.register_channel(
                connection.topic, "ros1", schema, told
            )
        for connection, stamp, raw in reader.messages():
            digests[connection.topic].update(raw)
            writer.add_message(channels[connection.id], stamp, bytes(raw), stamp)
