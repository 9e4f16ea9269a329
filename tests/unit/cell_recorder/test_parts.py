"""A recording of weeks: parts that are whole bags, and memory that does not grow."""

from __future__ import annotations

import os
import struct
from pathlib import Path

import msgspec
import pytest
import rosbag
from cell_recorder.reading.bag_reader_io import BagError, open_bag
from cell_recorder.recording.bag_writer_io import BagWriter, BagWriterError
from cell_recorder.recording.recording import RecorderSettings
from cell_recorder.recording.runs_folder_io import mark_of, parts_of
from rosbags.highlevel import AnyReader

FLOAT64 = {
    "type": "std_msgs/Float64",
    "md5sum": "fdb28210bfa9d7c91146260178d9a584",
    "message_definition": "float64 data\n",
}
LATCHED = {**FLOAT64, "latching": "1", "callerid": "/twin_controller"}
SETTINGS = RecorderSettings(
    topics=["a"],
    write_period_ms=1e9,  # the tests write themselves
    queue_messages=100_000,
    min_free_mb=0.0,
    part_mb=1000.0,
    part_minutes=1.0,
    runs_limit_mb=1000.0,
)
BEGIN = 10**18
RATE = 1045  # messages a second of a whole cell
CHUNK = RATE // 20  # in a write period of 50 ms
TOPICS = [f"/topic_{number}" for number in range(20)]


def put(writer: BagWriter, topic: str, value: float, at: float, header: dict[str, str]) -> None:
    """Put one message, ``at`` [s] after the beginning."""
    writer.put(topic, header, struct.pack("<d", value), BEGIN + int(at * 1e9))


def recorded(folder: Path, settings: RecorderSettings = SETTINGS, minutes: int = 3) -> Path:
    """Record a configuration that is said once, and a number each second."""
    writer = BagWriter(folder / "run.bag", settings)
    put(writer, "/cell/configuration", -1.0, 0.0, LATCHED)
    for second in range(60 * minutes):
        put(writer, "/cell/number", second, second, FLOAT64)
        writer._write_waiting()
    status = writer.close()
    assert (status.failure, status.messages) == ("", 60 * minutes + 1)
    assert status.parts == len(parts_of(writer.path))
    return writer.path


def test_each_part_is_a_whole_bag_for_standard_tools(tmp_path: Path) -> None:
    """What was said only once is in each; the parts follow each other without a gap."""
    files = parts_of(recorded(tmp_path))
    assert [file.name for file in files] == ["run.bag", "run.part0002.bag", "run.part0003.bag"]
    numbers = []
    for file in files:
        with rosbag.Bag(str(file)) as bag:
            assert bag.get_message_count("/cell/configuration") == 1
            numbers += [message.data for _, message, _ in bag.read_messages("/cell/number")]
        with AnyReader([file]) as reader:
            assert reader.message_count == 61
    assert numbers == [float(second) for second in range(180)]


def test_our_reader_takes_all_parts_for_one_bag(tmp_path: Path) -> None:
    """Each message once and in order, also what the recorder repeats in each part."""
    with open_bag(recorded(tmp_path)) as bag:
        assert [message.data for _, message in bag.messages("number")] == list(range(180))
        assert [message.data for _, message in bag.messages("configuration")] == [-1.0]
        assert (bag.start, bag.end) == pytest.approx((1e9, 1e9 + 179.0), abs=1e-3)
        assert bag.count("number") == bag.topics["/cell/number"] == 180
        assert len(bag.readable) == 3


def test_what_is_said_again_later_is_no_repetition(tmp_path: Path) -> None:
    """Equal words count as often as they were said, but for the recorder's own repetition."""
    writer = BagWriter(tmp_path / "run.bag", SETTINGS)
    other = {**LATCHED, "callerid": "/another_node"}
    for header in (LATCHED, other):
        put(writer, "/cell/configuration", -1.0, 0.0, header)
    put(writer, "/cell/number", 10.0, 10.0, FLOAT64)
    writer._write_waiting()
    put(writer, "/cell/configuration", -2.0, 61.0, LATCHED)
    put(writer, "/cell/configuration", -1.0, 70.0, LATCHED)
    writer._write_waiting()
    assert writer.close().parts == 2
    with open_bag(writer.path) as bag:
        said = [(round(at - 1e9), message.data) for at, message in bag.messages("configuration")]
    assert said == [(0, -1.0), (0, -1.0), (61, -2.0), (70, -1.0)]


def test_a_part_can_be_read_alone(tmp_path: Path) -> None:
    """Whoever has only one part of a week reads that."""
    with open_bag(parts_of(recorded(tmp_path))[1]) as bag:
        assert [message.data for _, message in bag.messages("number")] == list(range(60, 120))
        assert [message.data for _, message in bag.messages("configuration")] == [-1.0]


def test_the_last_part_of_a_killed_recorder_is_repaired(tmp_path: Path) -> None:
    """The parts before it need no repair; one without a whole message is left out."""
    path = recorded(tmp_path)
    last = parts_of(path)[-1]
    whole = last.read_bytes()
    last.write_bytes(whole[: len(whole) // 2])
    with open_bag(path) as bag:
        numbers = [message.data for _, message in bag.messages("number")]
        assert bag.repaired and 120 < len(numbers) < 180
        assert numbers == list(range(len(numbers)))
        assert [message.data for _, message in bag.messages("configuration")] == [-1.0]
    last.write_bytes(whole[:4200])
    with open_bag(path) as bag:
        assert bag.count("number") == 120
    for left in (0, 13):
        last.write_bytes(whole[:left])
        with open_bag(path) as bag:
            assert bag.count("number") == 120
            assert "run.part0003.bag: is no readable bag" in str(bag.missing)


def test_a_part_that_is_gone_from_the_middle_is_named(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """Who copies a long recording may forget one; what is there needs no repair."""
    path = recorded(tmp_path, minutes=6)
    files = parts_of(path)
    files[1].unlink()
    with open_bag(path) as bag:
        assert bag.count("number") == 300 and not bag.repaired
        assert bag.missing == ["run.part0002.bag: there is no such part"]
    assert "run.part0002.bag: there is no such part" in caplog.text
    for file in files[3:5]:
        file.unlink()
    with open_bag(path) as bag:
        assert bag.missing[1:] == ["run.part0004.bag to run.part0005.bag: there is no such part"]


def test_a_recording_whose_first_part_is_gone_is_no_bag(tmp_path: Path) -> None:
    """What is missing is named."""
    path = recorded(tmp_path)
    path.unlink()
    with pytest.raises(BagError, match=r"run\.bag: there is no such bag"):
        open_bag(path).__enter__()


def test_a_part_ends_by_size_too(tmp_path: Path) -> None:
    """No part is much larger than the limit, nor smaller before the next begins."""
    settings = msgspec.structs.replace(SETTINGS, part_mb=0.01, part_minutes=1000.0)
    files = parts_of(recorded(tmp_path, settings))
    assert len(files) > 2
    assert all(file.stat().st_size < 20_000 for file in files)
    assert all(file.stat().st_size > 10_000 for file in files[:-1]), "and each but the last is full"


def test_a_part_of_an_older_recording_is_not_taken_over(tmp_path: Path) -> None:
    """The first part was moved away: the new recording would seem to go on with the old one."""
    path = recorded(tmp_path)
    path.rename(tmp_path / "moved.bag")
    with pytest.raises(BagWriterError, match=r"File exists: run\.part0002\.bag"):
        BagWriter(path, SETTINGS)
    assert not path.exists()


def test_an_experiment_takes_the_mark_away_and_nothing_else_does(tmp_path: Path) -> None:
    """What has no mark is never removed."""
    writer = BagWriter(tmp_path / "run.bag", SETTINGS)
    put(writer, "/cell/number", 1.0, 0.0, FLOAT64)
    writer._write_waiting()
    assert mark_of(writer.path).is_file()
    put(writer, "/cell/experiment/marker", 1.0, 0.1, FLOAT64)
    writer.close()
    assert not mark_of(writer.path).exists()


def test_a_refused_recording_marks_nothing(tmp_path: Path) -> None:
    """An older recording that was to be kept is not given up by a second start."""
    path = tmp_path / "run.bag"
    path.write_bytes(b"precious")
    with pytest.raises(BagWriterError):
        BagWriter(path, SETTINGS)
    assert not mark_of(path).exists()


def test_a_recording_that_cannot_be_marked_leaves_nothing(tmp_path: Path) -> None:
    """The same name can be asked for again."""
    path = tmp_path / "run.bag"
    mark_of(path).mkdir()
    with pytest.raises(BagWriterError, match="cannot be created: Is a directory"):
        BagWriter(path, SETTINGS)
    assert not path.exists()


def feed(writer: BagWriter, begin: int, count: int) -> None:
    """Put messages as a whole cell does, in chunks of a write period; keep two parts at most."""
    for first in range(begin, begin + count, CHUNK):
        for number in range(first, first + CHUNK):
            put(writer, TOPICS[number % len(TOPICS)], number, number / RATE, FLOAT64)
        writer._write_waiting()
        if writer.status.parts > 2:
            for old in parts_of(writer.path)[1:-1]:
                old.unlink()


def resident() -> int:
    """Return the memory of this process that is in use [bytes]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.thorough
def test_memory_does_not_grow_with_the_messages(tmp_path: Path) -> None:
    """Three parts of a minute after two; an index for each message took 39 MB for them."""
    writer = BagWriter(tmp_path / "run.bag", SETTINGS)
    feed(writer, 0, 120 * RATE)
    before = resident()
    feed(writer, 120 * RATE, 180 * RATE)
    grown = resident() - before
    status = writer.close()
    assert (status.failure, status.dropped, status.refused) == ("", 0, 0)
    assert status.parts >= 5
    assert grown < 4e6, f"{grown / 1e6:.1f} MB"
