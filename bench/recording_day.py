"""A day of recording in minutes: a cell's own messages through the recorder's own writer."""

from __future__ import annotations

import math
import os
import time
from pathlib import Path

import msgspec
from cell_recorder.recording.bag_writer_io import BagWriter
from cell_recorder.recording.runs_folder_io import parts_of
from harness.faults.rows import Row
from harness.processes import wait_until
from rich.console import Console
from rosbags.rosbag1 import Reader

from bench.cells.long_bag import recording
from bench.room import Room
from bench.rows.recording import settings_of_the_recorder

CASE = "a recording of a day"
LIMIT_MB = 20.0
"""So much may the memory grow after the first hour."""
BATCH = 2000
"""So many messages are put at once; the next ones when these are written."""
KEPT = 3
"""Parts that stay on the disk."""
DEADLINE_S = 60.0
HOUR_NS = 3600e9


def run(hours: float, folder: Path, console: Console) -> list[Row]:
    """Write the messages of a cell again and again, each time later, until ``hours`` are full.

    Topics, sizes, rates and stamps are those of a whole cell that moves; only the clock is faster.
    The writer, its thread and its settings are the recorder's. Of the parts the last ones are kept.

    Args:
        hours: So much time of a cell.
        folder: Where the parts go.
        console: For progress.
    """
    with Room(folder, console) as room:
        messages, period_ns = _messages(recording(room))
    settings = msgspec.structs.replace(settings_of_the_recorder(), write_period_ms=5.0)
    writer = BagWriter(folder / "day" / "run.bag", settings)
    sent, told, before = 0, 0, 0.0
    begun = time.monotonic()
    for repetition in range(math.ceil(hours * HOUR_NS / period_ns)):
        for first in range(0, len(messages), BATCH):
            for topic, header, data, stamp in messages[first : first + BATCH]:
                writer.put(topic, header, data, stamp + repetition * period_ns)
                sent += 1
            wait_until(lambda: not writer.status.waiting, DEADLINE_S, "the writer")
        hour = int((repetition + 1) * period_ns / HOUR_NS)
        if hour > told:
            told = hour
            before = before or _resident_mb()
            console.print(
                f"hour {hour}: {sent} messages, {writer.status.parts} parts,"
                f" {_resident_mb():.1f} MB of memory"
            )
        for old in parts_of(writer.path)[1:-KEPT]:
            old.unlink()
    grown = _resident_mb() - before
    status = writer.close()
    seconds = time.monotonic() - begun
    console.print(
        f"{status.messages} messages, {status.size / 1e9:.1f} GB, {status.parts} parts,"
        f" {seconds:.0f} s; {status.failure or 'no failure'}"
    )
    for part in parts_of(writer.path):
        part.unlink()
    return [
        Row(CASE, "the recorder's memory grows after the first hour [MB]", LIMIT_MB, grown),
        Row(CASE, "messages lost", 0.0, float(sent - status.messages)),
    ]


def _messages(bag: Path) -> tuple[list[tuple[str, dict[str, str], bytes, int]], int]:
    """Return topic, header, bytes and stamp [ns] of a recording, and how long it lasts [ns]."""
    with Reader(bag) as reader:
        headers = {
            connection.id: {
                "type": connection.msgtype.replace("/msg/", "/"),
                "md5sum": connection.digest,
                "message_definition": connection.msgdef.data,
                "latching": "1" if connection.ext.latching else "0",
                "callerid": connection.ext.callerid or "",
            }
            for connection in reader.connections
        }
        found = [
            (connection.topic, headers[connection.id], bytes(data), stamp)
            for connection, stamp, data in reader.messages()
        ]
        return found, reader.end_time - reader.start_time + 1_000_000


def _resident_mb() -> float:
    """Return the memory of this process that is in use [MB]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6
