"""Bags as they are found: whole, unfinished, cut, foreign, incomplete."""

from __future__ import annotations

import shutil
import struct
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import rosbag
from cell_recorder.reading.bag_reader_io import BagError, open_bag
from cell_recorder.recording.bag_writer_io import BagWriter
from cell_recorder.recording.recording import RecorderSettings
from twin_experiments.report.run_reader_io import read_leader, read_pauses

FLOAT64 = {
    "type": "std_msgs/Float64",
    "md5sum": "fdb28210bfa9d7c91146260178d9a584",
    "message_definition": "float64 data\n",
}
SETTINGS = RecorderSettings(
    topics=["a"],
    write_period_ms=5.0,
    queue_messages=100_000,
    min_free_mb=0.0,
    part_mb=1000.0,
    part_minutes=15.0,
    runs_limit_mb=1000.0,
)


def values(path: Path) -> list[float]:
    """Return what the topic ``a`` of a bag says."""
    with open_bag(path) as bag:
        return [message.data for _, message in bag.messages("a")]


def unfinished(folder: Path, chunks: int = 4, compression: str = "none") -> Path:
    """Write a bag of ten messages a chunk and take its file away before it is closed.

    It is written with the standard library.
    """
    bag = rosbag.Bag(str(folder / "open.bag"), "w", compression=compression)
    import genpy
    from std_msgs.msg import Float64

    for i in range(chunks * 10):
        bag.write("/a", Float64(float(i)), genpy.Time(1000 + i))
        if i % 10 == 9:
            bag.flush()
    bag._file.flush()
    shutil.copy(folder / "open.bag", folder / "unfinished.bag")
    bag.close()
    return folder / "unfinished.bag"


@pytest.mark.parametrize("compression", ["none", "bz2", "lz4"])
def test_an_unfinished_bag_gives_all_its_messages(tmp_path: Path, compression: str) -> None:
    """A recorder that was killed leaves no index.

    A copy is indexed anew, the original stays as it is.
    """
    path = unfinished(tmp_path, compression=compression)
    before = path.read_bytes()
    with pytest.raises(rosbag.ROSBagUnindexedException):
        rosbag.Bag(str(path))
    assert values(path) == [float(i) for i in range(40)]
    assert path.read_bytes() == before


@pytest.mark.parametrize("missing", [1, 7, 100, 700])
def test_a_bag_that_was_cut_gives_the_whole_messages_before_the_cut(
    tmp_path: Path, missing: int
) -> None:
    """A file that lost its end keeps its beginning."""
    path = unfinished(tmp_path)
    path.write_bytes(path.read_bytes()[:-missing])
    found = values(path)
    assert found == [float(i) for i in range(len(found))]
    assert 20 <= len(found) <= 40


def test_a_bag_that_is_garbled_gives_all_but_the_broken_message(tmp_path: Path) -> None:
    """The name of a header's field that is no text: what comes whole behind it counts again."""
    path = unfinished(tmp_path)
    *before, after = path.read_bytes().split(b"op=\x02", 36)
    path.write_bytes(b"op=\x02".join(before) + b"\xff\xfe=\x02" + after)
    assert values(path) == [float(i) for i in range(40) if i != 35]


@pytest.mark.parametrize("strange", [1, 3, 700])
def test_strange_bytes_between_two_records_cost_no_message(tmp_path: Path, strange: int) -> None:
    """The next one is found wherever they end; so many are told."""
    path = unfinished(tmp_path)
    data = path.read_bytes()
    place = data.index(struct.pack("<d", 25.0)) + 8
    path.write_bytes(data[:place] + b"\xff" * strange + data[place:])
    assert values(path) == [float(i) for i in range(40)]
    with open_bag(path) as bag:
        assert f": {strange} bytes from byte {place} on are no record" in bag.missing[0]


def test_a_finished_bag_that_lost_its_index_is_repaired(tmp_path: Path) -> None:
    """The header promises an index that is not there any more."""
    path = unfinished(tmp_path).with_name("open.bag")
    path.write_bytes(path.read_bytes()[:-80])
    with open_bag(path) as bag:
        assert bag.repaired
        assert len(list(bag.messages("a"))) == 40


def test_messages_of_an_unfinished_last_chunk_are_kept(tmp_path: Path) -> None:
    """What reached the file counts, even if its chunk was never closed."""
    import genpy
    from std_msgs.msg import Float64

    with rosbag.Bag(str(tmp_path / "open.bag"), "w") as bag:
        for i in range(5):
            bag.write("/a", Float64(float(i)), genpy.Time(1000 + i))
        bag._file.flush()
        shutil.copy(tmp_path / "open.bag", tmp_path / "unfinished.bag")
    assert values(tmp_path / "unfinished.bag") == [0.0, 1.0, 2.0, 3.0, 4.0]


def test_a_bag_of_our_writer_that_ran_into_a_full_disk_can_be_read(tmp_path: Path) -> None:
    """What was written before the error is not lost."""
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, hard))
    try:
        writer = BagWriter(tmp_path / "run.bag", SETTINGS)
        for i in range(3000):
            writer.put("/a", FLOAT64, struct.pack("<d", i), 10**18 + i)
        status = writer.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert status.failure
    found = values(tmp_path / "run.bag")
    assert found == [float(i) for i in range(len(found))]
    assert len(found) > 200


def test_types_come_from_the_bag(make_bag: Callable[..., Path]) -> None:
    """A message of the cell is read without the workspace that defined it."""
    with open_bag(make_bag()) as bag:
        ((_, decision),) = list(bag.messages("twin_controller/decisions"))
    assert (decision.mode_after, decision.leader, decision.why) == (
        "REAL_LEADS",
        "real",
        "the real robot moved first",
    )


def test_the_type_of_a_topic_is_known_before_it_is_read(make_bag: Callable[..., Path]) -> None:
    """A topic that is not there has none."""
    with open_bag(make_bag()) as bag:
        assert bag.kind("twin/joint_states") == "sensor_msgs/msg/JointState"
        assert bag.kind("no/topic") == ""


def test_relative_names_are_found_in_any_namespace(make_bag: Callable[..., Path]) -> None:
    """The bag of a second cell is read like that of the first."""
    with open_bag(make_bag()) as one, open_bag(make_bag(namespace="/cell_2")) as other:
        assert one.count("twin/joint_states") == other.count("twin/joint_states") > 1000
        assert "/cell_2/twin/joint_states" in other.topics
        assert one.count("joint_states") > 0


def test_two_cells_in_one_bag_are_not_mixed(make_bag: Callable[..., Path]) -> None:
    """A name that fits several topics is refused with all of them."""
    with (
        open_bag(make_bag()) as bag,
        pytest.raises(
            BagError, match=r"more than one cell: /real/ground_truth, /x/real/ground_truth"
        ),
    ):
        bag._reader.connections.append(
            bag._connections("real/ground_truth")[0]._replace(topic="/x/real/ground_truth")
        )
        list(bag.messages("real/ground_truth"))


def test_every_missing_topic_is_named(make_bag: Callable[..., Path]) -> None:
    """The text also says what the bag does hold."""
    path = make_bag(without=("real/ground_truth",))
    with (
        open_bag(path) as bag,
        pytest.raises(
            BagError,
            match=r"no message of real/ground_truth, x/y; the bag holds .*/twin/joint_states "
            r"\(\d+\)",
        ),
    ):
        bag.require(["real/ground_truth", "twin/joint_states", "x/y"])


@pytest.mark.parametrize(
    ("content", "text"),
    [
        (None, "there is no such bag"),
        (b"", "is no readable bag: File magic is invalid"),
        (b"PK something else", "is no readable bag: File magic is invalid"),
        (b"#ROSBAG V2.0\n", "is no readable bag: Header could not be read"),
    ],
)
def test_what_is_no_bag_is_refused(tmp_path: Path, content: bytes | None, text: str) -> None:
    """The file is named."""
    path = tmp_path / "run.bag"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(BagError, match=rf"run.bag: {text}"), open_bag(path):
        pass


def test_several_topics_are_read_at_their_times(tmp_path: Path) -> None:
    """In seconds, as one alone is; the bag begins with the first message and ends with the last."""
    stamps = pytest.approx([1000.0 + k for k in range(40)], abs=1e-6)
    with open_bag(unfinished(tmp_path)) as bag:
        alone = [(stamp, message.data) for stamp, message in bag.messages("a")]
        both = [(stamp, read().data) for stamp, topic, read in bag.merged(("a",)) if topic == "a"]
        assert alone == both and [value for _, value in both] == [float(k) for k in range(40)]
        assert [stamp for stamp, _ in both] == stamps
        assert (bag.start, bag.end) == pytest.approx((1000.0, 1039.0), abs=1e-6)
        assert [list(times) for times in bag.arrivals()] == [stamps]


def test_an_unfinished_bag_without_a_message_is_refused(tmp_path: Path) -> None:
    """There is nothing to repair."""
    path = unfinished(tmp_path, chunks=0)
    with (
        pytest.raises(
            BagError, match="the recording was not finished and no whole message is in it"
        ),
        open_bag(path),
    ):
        pass


def test_arrivals_are_those_of_all_topics_in_all_parts(
    tmp_path: Path, bag_maker: type[Any]
) -> None:
    """Sorted within a part; a pause may lie between two parts."""
    for name, parts in (("run.bag", (0.02, 0.0)), ("run.part0002.bag", (0.1, 0.11))):
        maker = bag_maker()
        for topic, at in zip(("one", "other"), parts):
            maker.text(at, topic, "text")
        maker.write(tmp_path / name)
    with open_bag(tmp_path / "run.bag") as bag:
        arrivals = [list(part - bag.start) for part in bag.arrivals()]
        pauses = read_pauses(bag)
    assert arrivals == [pytest.approx([0.0, 0.02], abs=1e-6), pytest.approx([0.1, 0.11], abs=1e-6)]
    (pause,) = pauses
    assert (pause.start, pause.duration) == pytest.approx((0.02, 0.08), abs=1e-6)


@pytest.mark.parametrize(
    ("said", "leader"),
    [
        (["", "operator", "twin", "real"], "twin"),
        (["real", "twin"], "real"),
        (["", "operator"], ""),
        ([], ""),
    ],
)
def test_who_led_is_the_side_that_is_named_first(said: list[str], leader: str) -> None:
    """An operator who leads both is no side."""
    messages = [SimpleNamespace(leader=name) for name in said]
    bag: Any = SimpleNamespace(
        merged=lambda topics: ((0.0, topics[0], lambda m=message: m) for message in messages)
    )
    assert read_leader(bag) == leader


def test_nothing_temporary_is_left(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The repaired copy goes when the bag is closed."""
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    path = unfinished(tmp_path)
    with open_bag(path) as bag:
        (copy,) = bag.readable
        assert copy != path and copy.exists()
    assert not list(tmp_path.glob("bag_*"))
