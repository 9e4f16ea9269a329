"""Files of jobs travel by their content; what does not fit is refused with the reason."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import msgspec
import pytest
from farm.lab.io.carried.exchange import Counter
from farm.lab.io.carried.parcel import Answer, Packer, Written, as_there, put_down, unpacked
from farm.lab.io.carried.store import Store
from farm.lab.io.carried.version import refusal, version_of
from farm.lab.io.running import LabError
from farm.lab.plan import Job

CONTENT = [bytes([number]) * 100 for number in range(4)]
DIGESTS = [hashlib.sha256(content).hexdigest() for content in CONTENT]


def test_a_store_is_bounded_and_what_was_used_last_stays(tmp_path: Path) -> None:
    """Three of a hundred bytes fit; the fourth one puts out the one that nobody used."""
    store = Store(tmp_path / "files", most_bytes=300)
    for age, (digest, content) in enumerate(zip(DIGESTS[:3], CONTENT)):
        os.utime(store.keep(digest, iter((content[:30], content[30:]))), (age, age))
    assert store.find(DIGESTS[0]) is not None  # used now
    store.keep(DIGESTS[3], [CONTENT[3]])
    assert [store.find(digest) is not None for digest in DIGESTS] == [True, False, True, True]
    assert store.copy(DIGESTS[3], tmp_path / "out") and not store.copy(DIGESTS[1], tmp_path / "no")
    assert (tmp_path / "out").read_bytes() == CONTENT[3]


def test_what_is_not_its_digest_is_not_kept_nor_used(tmp_path: Path) -> None:
    """Neither when it comes nor when it was broken later; and a digest leads nowhere else."""
    store = Store(tmp_path / "files")
    with pytest.raises(LabError, match="a file came as"):
        store.keep(DIGESTS[0], [CONTENT[1]])
    assert list((tmp_path / "files").iterdir()) == []
    store.keep(DIGESTS[0], [CONTENT[0]]).write_bytes(b"broken")
    assert not store.copy(DIGESTS[0], tmp_path / "out") and not (tmp_path / "out").exists()
    assert store.find(DIGESTS[0]) is None
    with pytest.raises(LabError, match="is no sha256"):
        store.find(f"../{DIGESTS[0]}")


def test_the_scheduler_takes_pieces_in_their_order(tmp_path: Path) -> None:
    """A lost piece, another content and a name that leads elsewhere are refused."""
    counter = Counter(Store(tmp_path), version_of(tmp_path), tmp_path)
    digest, content = DIGESTS[0], CONTENT[0]
    assert counter.put(digest, "a1", 0, content[:40], last=False) == ""
    assert "expected at 40" in counter.put(digest, "a1", 50, content[50:], last=True)
    assert counter.put(digest, "a1", 40, content[40:], last=True) == "" and counter.has(digest)
    assert counter.get(digest, 90) == content[90:] and counter.get(digest, 100) == b""
    assert counter.get(DIGESTS[1], 0) is None
    assert "a file came as" in counter.put(DIGESTS[1], "a2", 0, content, last=True)
    assert "is no name" in counter.put(digest, "../a", 0, content, last=True)
    assert [file.name for file in tmp_path.iterdir()] == [digest]


def test_what_a_job_says_names_the_asking_machines_folder(tmp_path: Path) -> None:
    """As a path and as an address; the words lead to the file there."""
    bag = tmp_path / "my runs" / "run.bag"
    bag.parent.mkdir()
    bag.write_bytes(CONTENT[0])
    packer = Packer(version_of(tmp_path))
    parcel = packer.pack(Job("0", "replay", (str(bag), "--json")))
    assert packer.files == {DIGESTS[0]: bag} and parcel.inputs[0].digest == DIGESTS[0]
    there = tmp_path / "there"
    job, files = unpacked(parcel, there)
    assert job.words == (str(there / "0" / "run.bag"), "--json")
    said = f"{job.words[0]}: read\n{(there / '0' / 'report.html').as_uri()}\n{there / '0'}\n"
    wanted = f"{bag}: read\n{(bag.parent / 'report.html').as_uri()}\n{bag.parent}\n"
    assert as_there(said, files) == wanted
    assert packer.pack(Job("1", "judge", ("0.5,0.1,0.1",))).inputs == ()
    with pytest.raises(LabError, match="No such file"):
        packer.pack(Job("2", "fit", (str(tmp_path / "none.bag"),)))


def test_names_of_files_lead_nowhere_else(tmp_path: Path) -> None:
    """Neither on a worker nor back; a worker writes what such a job writes, and nothing else."""
    bag = tmp_path / "run.bag"
    bag.write_bytes(CONTENT[0])
    parcel = Packer(version_of(tmp_path)).pack(Job("0", "report", (str(bag),)))
    (one,) = parcel.inputs
    for name in ("../run.bag", "/etc/x", "..", ""):
        wrong = msgspec.structs.replace(parcel, inputs=(msgspec.structs.replace(one, name=name),))
        with pytest.raises(LabError, match="is no name of a file"):
            unpacked(wrong, tmp_path / "job")
    put_down(Answer(files=(Written("report.json", b"{}"),)), parcel)
    assert (tmp_path / "report.json").read_bytes() == b"{}"
    for name in ("run.bag", "../report.json", "x.py"):
        with pytest.raises(LabError, match="a worker sent a file that no report writes"):
            put_down(Answer(files=(Written(name, b"x"),)), parcel)


def test_a_version_is_what_is_in_the_files(tmp_path: Path) -> None:
    """What Python makes of them does not count, each other change does."""
    for name in ("src", "config", "setup"):
        (tmp_path / name).mkdir()
    (tmp_path / "src" / "one.py").write_text("a = 1\n")
    first = version_of(tmp_path)
    (tmp_path / "src" / "__pycache__").mkdir()
    (tmp_path / "src" / "__pycache__" / "one.pyc").write_bytes(b"x")
    assert version_of(tmp_path) == first and refusal(first, first, "the other") == ""
    (tmp_path / "config" / "robot.yaml").write_text("speed: 1\n")
    changed = version_of(tmp_path)
    assert "the other has" in refusal(first, changed, "the other")
