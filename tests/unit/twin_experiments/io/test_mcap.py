"""Bags become MCAP files that read back whole."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from rosbags.rosbag2.storage_mcap import McapReader
from twin_experiments.io.bag_reader import BagError, open_bag
from twin_experiments.io.mcap import convert_to_mcap

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
