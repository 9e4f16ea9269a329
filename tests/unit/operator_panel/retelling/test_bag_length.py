"""How long a bag is, held against bags that a library writes."""

from __future__ import annotations

from pathlib import Path

import pytest
from operator_panel.retelling.bag_length_io import BagLengthError, bag_times
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore

START_NS = 1_900_000_000_250_000_000


def written(path: Path, *times_s: float) -> Path:
    """Write a bag with a text at each time, in chunks of a few messages."""
    store = get_typestore(Stores.ROS1_NOETIC)
    kind = "std_msgs/msg/String"
    with Writer(path) as writer:
        connection = writer.add_connection("/said", kind, typestore=store)
        for time_s in times_s:
            message = store.types[kind]("x" * 400_000)
            data = store.serialize_ros1(message, kind)
            writer.write(connection, START_NS + round(time_s * 1e9), data)
    return path


def test_length_is_that_of_all_chunks(tmp_path: Path) -> None:
    """The messages lie in several chunks; the last one ends the recording."""
    bag = written(tmp_path / "run.bag", 0.0, 1.0, 2.5, 61.25)
    assert bag_times(bag) == pytest.approx((1_900_000_000.25, 1_900_000_061.5))


def test_unfinished_bag_has_no_length_yet(tmp_path: Path) -> None:
    """Its header says that there is no index."""
    bag = written(tmp_path / "run.bag", 0.0, 1.0)
    data = bag.read_bytes()
    place = data.index(b"index_pos=") + len(b"index_pos=")
    bag.write_bytes(data[:place] + bytes(8) + data[place + 8 :])
    assert bag_times(bag) is None


@pytest.mark.parametrize("data", [b"", b"x" * 5000, b"#ROSBAG V2.0\n", b"#ROSBAG V2.0\n\xff\xff"])
def test_what_is_no_bag_is_named(tmp_path: Path, data: bytes) -> None:
    """A file may be called anything."""
    bag = tmp_path / "run.bag"
    bag.write_bytes(data)
    with pytest.raises(BagLengthError):
        bag_times(bag)


def test_bag_whose_end_is_missing_is_damaged_or_has_no_length(tmp_path: Path) -> None:
    """A copy that broke off is no endless loop."""
    bag = written(tmp_path / "run.bag", 0.0, 1.0, 2.0)
    whole = bag.read_bytes()
    bag.write_bytes(whole[:-10])
    with pytest.raises(BagLengthError, match="cut off"):
        bag_times(bag)
    bag.write_bytes(whole[: len(whole) // 2])
    assert bag_times(bag) is None
