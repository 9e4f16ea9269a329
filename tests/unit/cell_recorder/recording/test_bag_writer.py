"""The bag writer: complete, in order, honest about what it lost."""

from __future__ import annotations

import os
import resource
import struct
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import msgspec
import pytest
import rosbag
import rospy
from cell_recorder.recording.bag_writer_io import BagWriter, BagWriterError
from cell_recorder.recording.recording import RecorderSettings
from harness.processes import wait_until
from rosbags.highlevel import AnyReader

FLOAT64 = {
    "type": "std_msgs/Float64",
    "md5sum": "fdb28210bfa9d7c91146260178d9a584",
    "message_definition": "float64 data\n",
}
INT32 = {
    "type": "std_msgs/Int32",
    "md5sum": "da5909fbe378aeaf85e547e830cc1bb7",
    "message_definition": "int32 data\n",
}
SETTINGS = RecorderSettings(
    topics=["a"],
    write_period_ms=5.0,
    queue_messages=100,
    min_free_mb=0.0,
    part_mb=1000.0,
    part_minutes=15.0,
    runs_limit_mb=1000.0,
)


def fill(writer: BagWriter, count: int, topic: str = "/a", start: int = 0) -> None:
    """Put messages one millisecond apart."""
    for i in range(start, start + count):
        writer.put(topic, FLOAT64, struct.pack("<d", i), 10**18 + i * 10**6)


def read(path: Path) -> list[tuple[str, int, float]]:
    """Return topic, stamp and value of each message, as an independent library reads them."""
    with AnyReader([path]) as reader:
        return [
            (c.topic, stamp, reader.deserialize(raw, c.msgtype).data)  # type: ignore[attr-defined]
            for c, stamp, raw in reader.messages()
        ]


def test_everything_put_before_close_is_in_the_bag(tmp_path: Path) -> None:
    """Close writes what waits and says how many there are; the index is complete."""
    writer = BagWriter(tmp_path / "new" / "run.bag", SETTINGS)
    fill(writer, 60)
    status = writer.close()
    assert (status.messages, status.waiting, status.dropped, status.failure, status.active) == (
        60,
        0,
        0,
        "",
        False,
    )
    assert [value for _, _, value in read(writer.path)] == [float(i) for i in range(60)]


def test_stamps_never_run_backwards(tmp_path: Path) -> None:
    """A message that was overtaken by another thread's gets the stamp of that one."""
    writer = BagWriter(tmp_path / "run.bag", SETTINGS)
    # A simulated clock begins at 0.
    for second, topic in ((0, "/a"), (5, "/a"), (4, "/b"), (6, "/a")):
        writer.put(topic, FLOAT64, struct.pack("<d", second), second * 10**9)
    writer.close()
    assert [stamp for _, stamp, _ in read(writer.path)] == [k * 10**9 for k in (0, 5, 5, 6)]


def test_stamps_go_on_at_their_pace_after_the_clock_was_set_back(tmp_path: Path) -> None:
    """Else all messages of the hour that comes again would have one stamp; it is counted."""
    writer = BagWriter(tmp_path / "run.bag", SETTINGS)
    for second in (5000, 5001, 1400, 1401, 1400, 1402):
        writer.put("/a", FLOAT64, struct.pack("<d", second), second * 10**9)
    assert writer.close().set_back == 1
    seconds = [stamp / 1e9 for _, stamp, _ in read(writer.path)]
    assert seconds == [5000, 5001, 5001, 5002, 5002, 5003]


def three_chunks(folder: Path) -> Path:
    """Write a bag of three chunks of ten messages; return its path."""
    slow = msgspec.structs.replace(SETTINGS, write_period_ms=60_000.0)
    writer = BagWriter(folder / "run.bag", slow)
    for begin in (0, 10, 20):
        fill(writer, 10, start=begin)
        writer._write_waiting()
    writer.close()
    return writer.path


def test_each_chunk_says_when_its_first_and_its_last_message_came(tmp_path: Path) -> None:
    """A reader looks only into the chunks of the time that is asked for."""
    with rosbag.Bag(str(three_chunks(tmp_path))) as bag:
        spans = [(chunk.start_time.to_nsec(), chunk.end_time.to_nsec()) for chunk in bag._chunks]
        late = rospy.Time(10**9, 18 * 10**6)
        found = [message.data for _, message, _ in bag.read_messages(start_time=late)]
        assert bag.get_end_time() == pytest.approx(1e9 + 0.029, abs=1e-6)
    assert spans == [(10**18 + k * 10**6, 10**18 + (k + 9) * 10**6) for k in (0, 10, 20)]
    assert found == [float(i) for i in range(18, 30)]


def test_a_full_queue_drops_and_counts(tmp_path: Path) -> None:
    """A disk that stalls costs messages, not memory; the count says how many."""
    slow = msgspec.structs.replace(SETTINGS, write_period_ms=60_000.0)
    writer = BagWriter(tmp_path / "run.bag", slow)
    fill(writer, 130)
    status = writer.close()
    assert (status.messages, status.dropped) == (100, 30)
    assert len(read(writer.path)) == 100


@pytest.mark.parametrize("missing", ["type", "md5sum", "message_definition"])
def test_a_message_without_its_definition_is_refused_and_counted(
    tmp_path: Path, missing: str
) -> None:
    """A bag that nobody could read later is not written."""
    writer = BagWriter(tmp_path / "run.bag", SETTINGS)
    writer.put("/a", {k: v for k, v in FLOAT64.items() if k != missing}, b"12345678", 10**18)
    fill(writer, 1)
    status = writer.close()
    assert (status.messages, status.refused) == (1, 1)


def test_another_type_on_a_known_topic_is_refused(tmp_path: Path) -> None:
    """A topic has one type in a bag; a second one would be read as garbage."""
    writer = BagWriter(tmp_path / "run.bag", SETTINGS)
    fill(writer, 1)
    writer.put("/a", INT32, b"1234", 10**18 + 1)
    assert writer.close().refused == 1
    assert len(read(writer.path)) == 1


def test_an_existing_file_is_never_overwritten(tmp_path: Path) -> None:
    """A run that was recorded stays."""
    (tmp_path / "run.bag").write_bytes(b"precious")
    with pytest.raises(BagWriterError, match=r"cannot be created: File exists: run\.bag"):
        BagWriter(tmp_path / "run.bag", SETTINGS)
    assert (tmp_path / "run.bag").read_bytes() == b"precious"


def test_too_little_free_space_ends_the_recording_with_a_readable_bag(tmp_path: Path) -> None:
    """Recording stops while there is room for the index."""
    greedy = msgspec.structs.replace(SETTINGS, min_free_mb=1e6)
    writer = BagWriter(tmp_path / "run.bag", greedy)
    writer._thread.join(5.0)
    fill(writer, 3)
    status = writer.close()
    assert "MB free on the disk, min_free_mb is 1e+06" in status.failure
    assert (status.dropped, status.active) == (3, False)
    assert read(writer.path) == []


@pytest.mark.parametrize(("free", "goes_on"), [(100_000_000, True), (99_999_000, False)])
def test_the_least_free_space_is_enough(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, free: int, goes_on: bool
) -> None:
    """A megabyte is a million bytes; a kilobyte less than the limit ends the recording."""
    found = SimpleNamespace(f_bavail=free // 1000, f_frsize=1000)
    monkeypatch.setattr(os, "statvfs", lambda _: found)
    writer = BagWriter(tmp_path / "run.bag", msgspec.structs.replace(SETTINGS, min_free_mb=100.0))
    fill(writer, 3)
    wait_until(lambda: writer.status.messages or writer.status.failure, 5.0, "a look at the disk")
    assert (writer.close().failure == "") is goes_on


@pytest.fixture
def small_files() -> Iterator[None]:
    """Let no file grow beyond 60 kB, as a full disk would."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, hard))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_write_error_ends_the_recording_and_keeps_what_was_written(
    tmp_path: Path, small_files: None
) -> None:
    """A disk that is full all the same is a failure with its reason, not a crash."""
    writer = BagWriter(
        tmp_path / "run.bag", msgspec.structs.replace(SETTINGS, queue_messages=100_000)
    )
    fill(writer, 2000)
    status = writer.close()
    assert "File too large" in status.failure
    assert 0 < status.messages < 2000
    assert 20_000 < writer.path.stat().st_size <= 60_000


def test_a_bag_is_records_from_its_first_byte_to_its_last(tmp_path: Path) -> None:
    """Whoever reads it without its index, to mend it, goes from record to record."""
    data = three_chunks(tmp_path).read_bytes()
    at = len(b"#ROSBAG V2.0\n")
    while at < len(data):
        for _ in ("header", "data"):
            (length,) = struct.unpack_from("<I", data, at)
            at += 4 + length
    assert at == len(data)
