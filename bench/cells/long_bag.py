"""A recording of ten minutes: that of a cell, again and again, each time later."""

from __future__ import annotations

import struct
from pathlib import Path

from rosbags.rosbag1 import Reader, Writer

from bench.cells.cell_run import experiment
from bench.room import Room

DURATION_S = 600.0
_STAMPED = (
    "sensor_msgs/msg/JointState",
    "trajectory_msgs/msg/JointTrajectory",
    "diagnostic_msgs/msg/DiagnosticArray",
)


def recording(room: Room) -> Path:
    """Return the recording of a cell whose robot led; that of the row sync_error if it was made."""
    made = sorted(
        file.with_name("run.bag")
        for file in (room.folder / "sync_error").rglob("run_*/report.json")
    )
    if made:
        return made[0]
    room.say("a cell records the robot's program")
    return room.once("recording", lambda: experiment(room.place("recording"), (0.0, 0.0), {}).bag)


def long_bag(room: Room, target: Path) -> Path:
    """Write the recording of a cell until it is ten minutes long and return the file.

    Each repetition is moved by a whole number of seconds, in the time of receipt and in the stamp
    of each message's header.
    """
    source = recording(room)
    with Reader(source) as reader:
        messages = [
            (connection, stamp, bytes(data)) for connection, stamp, data in reader.messages()
        ]
        period = int((reader.end_time - reader.start_time) * 1e-9) + 2
        with Writer(target) as writer:
            known = {
                connection.id: writer.add_connection(
                    connection.topic,
                    connection.msgtype,
                    msgdef=connection.msgdef.data,
                    md5sum=connection.digest,
                )
                for connection in reader.connections
            }
            stamped = {
                c.id: c.msgtype in _STAMPED or _has_header(c.msgdef.data)
                for c in reader.connections
            }
            for repetition in range(int(DURATION_S / period) + 1):
                later = repetition * period
                for connection, stamp, data in messages:
                    moved = _moved(data, later) if stamped[connection.id] else data
                    writer.write(known[connection.id], stamp + later * 1_000_000_000, moved)
    return target


def _has_header(definition: str) -> bool:
    """Tell whether a message begins with a header."""
    lines = [line.split("#")[0].split() for line in definition.split("====")[0].splitlines()]
    fields = [words for words in lines if words and "=" not in "".join(words)]
    return bool(fields) and fields[0][0] in ("Header", "std_msgs/Header")


def _moved(data: bytes, seconds: int) -> bytes:
    """Return a message whose header's stamp is later.

    Sequence number, then seconds, four bytes each.
    """
    (at,) = struct.unpack_from("<I", data, 4)
    return data[:4] + struct.pack("<I", at + seconds) + data[8:]
