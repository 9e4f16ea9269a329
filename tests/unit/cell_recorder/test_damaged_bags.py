"""Bags that a disk, a memory or a hand has damaged: what is whole is read, the rest is said."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path
from random import Random

import genpy
import pytest
import rosbag
from cell_recorder.reading.bag_reader_io import BagError, open_bag
from cell_recorder.reading.bag_repair_io import is_indexed
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64, String

KINDS = ("none", "bz2", "lz4", "none unfinished", "lz4 unfinished")
CHUNKS, IN_CHUNK = 8, 10
CHUNK_RECORD = b"op=\x05"


def write(folder: Path, kind: str) -> Path:
    """Write a bag of several topics and chunks; an unfinished one has no index."""
    compression, _, unfinished = kind.partition(" ")
    path = folder / f"{kind.replace(' ', '_')}.bag"
    bag = rosbag.Bag(str(path), "w", compression=compression, chunk_threshold=1 << 20)
    for number in range(CHUNKS * IN_CHUNK):
        stamp = genpy.Time(1000 + number)
        bag.write("/a", Float64(float(number)), stamp)
        joints = JointState(name=["joint_1", "joint_2"], position=[number, -number])
        bag.write("/cell/joints", joints, stamp)
        bag.write("/words", String("word " * (number % 7)), stamp)
        if number % IN_CHUNK == IN_CHUNK - 1:
            bag.flush()
    if unfinished:
        bag._file.flush()
        shutil.copy(path, folder / "copy.bag")
        bag.close()
        shutil.move(folder / "copy.bag", path)
    else:
        bag.close()
    return path


def flipped(data: bytearray, rng: Random) -> None:
    """Change single bits."""
    for _ in range(rng.choice((1, 3, 20))):
        data[rng.randrange(13, len(data))] ^= 1 << rng.randrange(8)


def overwritten(data: bytearray, rng: Random) -> None:
    """Put other bytes, or zeros, in the place of some."""
    size = rng.choice((4, 64, 4096))
    start = rng.randrange(13, len(data))
    size = min(size, len(data) - start)
    data[start : start + size] = rng.choice((rng.randbytes(size), bytes(size)))


def cut(data: bytearray, rng: Random) -> None:
    """Let the end be missing."""
    del data[rng.randrange(13, len(data)) :]


def holed(data: bytearray, rng: Random) -> None:
    """Let something in the middle be missing."""
    start = rng.randrange(13, len(data))
    del data[start : start + rng.choice((1, 100, 5000))]


def doubled(data: bytearray, rng: Random) -> None:
    """Say something twice."""
    start = rng.randrange(13, len(data))
    data[start:start] = data[start : start + rng.choice((1, 100, 5000))]


def lengths(data: bytearray, rng: Random) -> None:
    """Give lengths and counts other values: these are what a reader believes."""
    for _ in range(3):
        places = [at for at in range(13, len(data) - 4) if data[at : at + 3] == b"op="]
        at = rng.choice(places) - rng.choice((4, 8, -5, -9))
        data[at : at + 4] = rng.choice((0, 1, 255, 1 << 16, (1 << 32) - 1)).to_bytes(4, "little")


DAMAGES: tuple[Callable[[bytearray, Random], None], ...] = (
    *(flipped, overwritten, cut, holed, doubled, lengths),
)


def read(path: Path) -> tuple[int, list[str]]:
    """Read all that can be read; return how many messages, and what was said of the rest."""
    count, said = 0, []
    try:
        with open_bag(path) as bag:
            for topic in ("a", "joints", "words"):
                try:
                    count += sum(1 for _ in bag.messages(topic))
                except BagError as error:
                    said.append(str(error))
            try:
                for _, _, message in bag.merged(("a", "joints", "words")):
                    message()
            except BagError as error:
                said.append(str(error))
            for times in bag.arrivals():
                assert times.ndim == 1
            assert bag.topics is not None and bag.end is not None and bag.start is not None
            said += bag.missing
    except BagError as error:
        said.append(str(error))
    return count, said


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Return a bag of each kind."""
    folder = tmp_path_factory.mktemp("whole")
    return {kind: write(folder, kind).read_bytes() for kind in KINDS}


@pytest.mark.parametrize("count", [50, pytest.param(1200, marks=pytest.mark.thorough)])
def test_damaged_bag_is_read_or_refused_with_a_bag_error(
    whole: dict[str, bytes], tmp_path: Path, count: int
) -> None:
    """Whatever is wrong with it, no other error comes out; much of most bags is still there."""
    path, undeclared, kept = tmp_path / "damaged.bag", [], 0
    for seed in range(count):
        rng = Random(seed)
        kind, damage = rng.choice(KINDS), rng.choice(DAMAGES)
        data = bytearray(whole[kind])
        damage(data, rng)
        path.write_bytes(data)
        try:
            found, _ = read(path)
        except Exception as error:
            undeclared.append(f"seed {seed}, {kind}, {damage.__name__}: {error!r}")
            continue
        kept += found > CHUNKS * IN_CHUNK
    print(f"{count} damaged bags: {len(undeclared)} undeclared errors, much left in {kept}")
    assert not undeclared, "\n".join(undeclared)
    assert kept > 0.6 * count


@pytest.mark.parametrize("kind", ["lz4", "bz2", "lz4 unfinished"])
def test_one_chunk_that_cannot_be_unpacked_costs_only_its_own_messages(
    whole: dict[str, bytes], tmp_path: Path, kind: str
) -> None:
    """The others are read, and it is said what is missing."""
    data = bytearray(whole[kind])
    places = [at for at in range(len(data)) if data[at : at + 4] == CHUNK_RECORD]
    assert len(places) == CHUNKS
    broken = places[3] + 120  # within the packed data of the fourth
    data[broken : broken + 40] = bytes(40)
    path = tmp_path / "run.bag"
    path.write_bytes(data)
    with open_bag(path) as bag:
        values = [message.data for _, message in bag.messages("a")]
        gone = set(range(3 * IN_CHUNK, 4 * IN_CHUNK))
        assert values == [float(n) for n in range(CHUNKS * IN_CHUNK) if n not in gone]
        (said,) = bag.missing
    assert "chunk at byte" in said and ("unpacked" in said or said.startswith("10 messages of"))


def test_a_message_that_is_missing_counts_once_however_often_it_is_read(
    whole: dict[str, bytes], tmp_path: Path
) -> None:
    """A report asks for some topics twice."""
    data = bytearray(whole["none"])
    places = [at for at in range(len(data)) if data[at : at + 4] == b"op=\x02"]
    data[places[40] : places[40] + 2] = bytes(2)
    path = tmp_path / "run.bag"
    path.write_bytes(data)
    with open_bag(path) as bag:
        for topic in 2 * ("a", "joints", "words"):
            list(bag.messages(topic))
        (said,) = bag.missing
    assert said.startswith("1 message of the chunk at byte")


def test_one_broken_record_of_a_plain_chunk_costs_only_itself(
    whole: dict[str, bytes], tmp_path: Path
) -> None:
    """The next record is found by what each record's header has."""
    data = bytearray(whole["none unfinished"])
    places = [at for at in range(len(data)) if data[at : at + 4] == b"op=\x02"]
    data[places[40] - 8 : places[40] + 2] = bytes(10)
    path = tmp_path / "run.bag"
    path.write_bytes(data)
    count, said = read(path)
    assert count == 3 * CHUNKS * IN_CHUNK - 1
    assert any("are no record" in text for text in said)


def test_definition_that_cannot_be_read_is_a_bag_error(
    whole: dict[str, bytes], tmp_path: Path
) -> None:
    """It names topic and type."""
    path = tmp_path / "run.bag"
    path.write_bytes(whole["none"].replace(b"float64 data", b"float64 [[ta"))
    with open_bag(path) as bag, pytest.raises(BagError, match=r"/a: the definition of .*Float64"):
        next(iter(bag.messages("a")))


@pytest.mark.parametrize("kind", KINDS)
def test_only_a_finished_recording_is_expected_to_have_an_index(tmp_path: Path, kind: str) -> None:
    """A killed recorder's bag is repaired, and not first called damaged."""
    assert is_indexed(write(tmp_path, kind)) is ("unfinished" not in kind)
