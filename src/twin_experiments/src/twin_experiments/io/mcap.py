"""Convert a bag to one MCAP file, for Foxglove and PlotJuggler.

Check that it reads back whole.
"""

from __future__ import annotations

import shutil
import tempfile
from collections import Counter
from pathlib import Path

from rosbags.convert.converter import ConverterError, convert
from rosbags.highlevel import AnyReader, AnyReaderError
from rosbags.rosbag2 import ReaderError

from twin_experiments.io.bag_reader import BagError, open_bag

VERSION = 9  # of the ROS 2 bag format that the file is written in


def convert_to_mcap(bag: Path, target: Path) -> dict[str, int]:
    """Write the messages of a bag to the new file ``target``.

    Message types get their ROS 2 form (no ``header.seq``).

    Args:
        bag: Recording; an unfinished one is repaired on a copy.
        target: Not there yet.

    Returns:
        Topic to number of messages, as read back from the file.

    Raises:
        BagError: The bag cannot be read, the target exists or cannot be written, or it does not
            read back whole.
    """
    if target.exists():
        raise BagError(f"{target}: exists already")
    with open_bag(bag) as opened, tempfile.TemporaryDirectory(prefix="mcap_") as folder:
        made = Path(folder) / "converted"
        try:
            convert(
                opened.readable, made, "mcap", VERSION, None, "file", None, None, (), (), (), ()
            )
            counts = _read_back(made)
        except (ConverterError, ReaderError, AnyReaderError, OSError) as error:
            raise BagError(f"{bag}: cannot be converted: {error}") from error
        if counts != opened.topics:
            raise BagError(
                f"{bag}: {sum(counts.values())} of {sum(opened.topics.values())} messages read back"
            )
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.move(next(made.glob("*.mcap")), target)
        except OSError as error:
            raise BagError(f"{target}: cannot be written: {error.strerror}") from error
        return counts


def _read_back(folder: Path) -> dict[str, int]:
    """Decode every message of a converted recording and count them by topic."""
    counts: Counter[str] = Counter()
    with AnyReader([folder]) as reader:
        for connection, _, raw in reader.messages():
            reader.deserialize(raw, connection.msgtype)
            counts[connection.topic] += 1
    return dict(sorted(counts.items()))
