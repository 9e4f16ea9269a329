"""Bags become MCAP files that read back whole."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from cell_recorder.io.reading.bag_reader import BagError, open_bag
from mcap.reader import make_reader
from rosbags.rosbag1 import Reader
from rosbags.rosbag2.storage_mcap import McapReader
from twin_experiments.io.mcap import Compression, Profile, convert_to_mcap

MakeBag = Callable[..., Path]


def test_every_message_is_in_the_one_file(make_bag: MakeBag, tmp_path: Path) -> None:
    """Counts by topic are those of the bag; the file alone is readable."""
    bag, target = make_bag(), tmp_path / "new" / "out.mcap"
    counts = convert_to_mcap(bag, target)
    with open_bag(bag) as opened:
        assert counts == opened.topics
    reader = McapReader(target)
    reader.open()
    assert reader.statistics is not None and reader.statistics.message_count == sum(counts.values())
    reader.close()
    assert [file.name for file in target.parent.iterdir()] == ["out.mcap"]


@pytest.mark.parametrize("compression", list(Compression))
def test_the_profile_ros1_holds_each_message_as_it_was_recorded(
    make_bag: MakeBag, tmp_path: Path, compression: Compression
) -> None:
    """Bytes, stamps, types and definitions; mcap's own reader reads it."""
    bag, target = make_bag(), tmp_path / "out.mcap"
    convert_to_mcap(bag, target, Profile.ROS1, compression)
    with Reader(bag) as reader:
        recorded = [(c.topic, stamp, bytes(raw)) for c, stamp, raw in reader.messages()]
        kinds = {c.topic: c.msgtype.replace("/msg/", "/") for c in reader.connections}
        texts = {c.topic: c.msgdef.data for c in reader.connections}
    with target.open("rb") as file:
        read = make_reader(file, validate_crcs=True)
        assert read.get_header().profile == "ros1"
        rows = list(read.iter_messages())
        summary = read.get_summary()
    assert sorted((c.topic, m.log_time, m.data) for _, c, m in rows) == sorted(recorded)
    for schema, channel, _ in rows:
        assert schema is not None
        assert (schema.encoding, channel.message_encoding) == ("ros1msg", "ros1")
        assert (schema.name, schema.data.decode()) == (kinds[channel.topic], texts[channel.topic])
    assert summary is not None
    used = {index.compression for index in summary.chunk_indexes}
    assert used == {"" if compression is Compression.NONE else compression.value}


def test_ros2_types_are_compressed_too_but_not_by_lz4(make_bag: MakeBag, tmp_path: Path) -> None:
    """The compressed file is smaller, and holds as much."""
    bag = make_bag()
    plain = convert_to_mcap(bag, tmp_path / "plain.mcap")
    packed = convert_to_mcap(bag, tmp_path / "packed.mcap", compression=Compression.ZSTD)
    assert packed == plain
    sizes = [(tmp_path / name).stat().st_size for name in ("packed.mcap", "plain.mcap")]
    assert sizes[0] < sizes[1]
    with pytest.raises(BagError, match="lz4: goes with profile ros1"):
        convert_to_mcap(bag, tmp_path / "no.mcap", compression=Compression.LZ4)


def test_an_unfinished_bag_is_converted_as_far_as_it_goes(
    make_bag: MakeBag, tmp_path: Path
) -> None:
    """The repaired copy is what is converted."""
    whole = make_bag().read_bytes()
    cut = tmp_path / "cut.bag"
    cut.write_bytes(whole[: len(whole) // 2])
    assert sum(convert_to_mcap(cut, tmp_path / "out.mcap").values()) > 0


def test_an_existing_file_is_not_overwritten_and_what_is_no_bag_is_refused(
    make_bag: MakeBag, tmp_path: Path
) -> None:
    """Nothing is lost, nothing is left."""
    target = tmp_path / "out.mcap"
    target.write_text("mine")
    with pytest.raises(BagError, match=r"out\.mcap: exists already"):
        convert_to_mcap(make_bag(), target)
    assert target.read_text() == "mine"
    with pytest.raises(BagError, match="is no readable bag"):
        convert_to_mcap(target, tmp_path / "other.mcap")
    assert not (tmp_path / "other.mcap").exists()
