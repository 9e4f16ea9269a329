"""A recording comes to the desk whole, or not at all, and nothing else of the cell's disk does."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from farm.desk.commands_io import cells_there
from farm.desk.fetching_io import HALF, NOTE, FetchError, fetch, recordings_of
from farm.link.recordings_io import LONGEST_PIECE, RecordingError, RecordingFiles
from farm.wire import PieceAsked, Recording, encode
from harness.processes import wait_until
from unit.farm.conftest import CELL, Farm, Journal


@pytest.fixture
def runs(tmp_path: Path) -> Path:
    """Return a runs folder with two recordings and other things."""
    folder = tmp_path / "runs"
    (folder / "a").mkdir(parents=True)
    (folder / "a" / "run.bag").write_bytes(os.urandom(3 * LONGEST_PIECE + 17))
    (folder / "small.bag").write_bytes(b"x")
    (folder / "a" / "report.json").write_text("{}")
    (tmp_path / "secret.bag").write_bytes(b"secret")
    (folder / "latest").symlink_to("a")
    (folder / "link.bag").symlink_to(tmp_path / "secret.bag")
    (folder / "again.bag").symlink_to("small.bag")
    os.utime(folder / "small.bag", ns=(1, 1))
    return folder


def asked(recording: Recording, offset: int = 0) -> PieceAsked:
    """Return the question for a piece."""
    return PieceAsked(recording.name, recording.size, recording.modified, offset)


def test_recordings_are_listed_once_the_newest_first(runs: Path) -> None:
    """Neither other files nor what a link leads to."""
    assert [each.name for each in RecordingFiles(runs).listed()] == ["a/run.bag", "small.bag"]
    assert RecordingFiles(runs / "nowhere").listed() == []


@pytest.mark.parametrize(
    "name",
    ["../secret.bag", "link.bag", "again.bag", "a/report.json", "a", "", "/etc/passwd"],
)
def test_nothing_but_recordings_is_given(runs: Path, name: str) -> None:
    """Whatever name is asked for, by whoever knows its size and time."""
    there = (runs / name).stat()
    with pytest.raises(RecordingError, match="is no recording of this cell"):
        RecordingFiles(runs).piece(asked(Recording(name, there.st_size, there.st_mtime_ns)))


@pytest.mark.parametrize("name", ["none.bag", "a\0.bag"])
def test_what_is_not_there_is_said(runs: Path, name: str) -> None:
    """Also a name that no file can have."""
    with pytest.raises(RecordingError, match="cannot be read"):
        RecordingFiles(runs).piece(PieceAsked(name, 6, 0, 0))


def test_a_recording_that_grows_is_not_mixed(runs: Path) -> None:
    """Pieces of two states of a file are no recording."""
    files = RecordingFiles(runs)
    listed = files.listed()[0]
    with (runs / listed.name).open("ab") as stream:
        stream.write(b"more")
    with pytest.raises(RecordingError, match="has changed since it was listed"):
        files.piece(asked(listed))


def test_a_list_that_cannot_be_read_is_named() -> None:
    """Of a cell of another version, or a damaged one."""
    reply = SimpleNamespace(
        ok=SimpleNamespace(payload=b'[{"name":"\xff","size":1,"modified":1}]'), err=None
    )
    session: Any = SimpleNamespace(get=lambda *_, **__: [reply])
    with pytest.raises(FetchError, match="list of recordings cannot be read: 'utf-8'"):
        recordings_of(session, CELL)


def test_a_recording_is_fetched_and_goes_on_where_it_was_interrupted(
    farm: Farm, runs: Path
) -> None:
    """Over the bus; a part of another state of it is thrown away."""
    session = farm.router()
    farm.link(farm.client(), Journal(), runs=runs)
    wait_until(lambda: bool(cells_there(session, "site", 1.0)), 10.0, "the cell")
    recording = recordings_of(session, CELL)[0]
    target = farm.folder / "run.bag"

    class InterruptionError(Exception):
        pass

    def after_one(there: int) -> None:
        if there:
            raise InterruptionError

    with pytest.raises(InterruptionError):
        fetch(session, CELL, recording, target, after_one)
    assert not target.exists()
    came: list[int] = []
    fetch(session, CELL, recording, target, came.append)
    assert came[0] == LONGEST_PIECE and came[-1] == recording.size
    assert target.read_bytes() == (runs / "a" / "run.bag").read_bytes()
    other = farm.folder / "other.bag"
    Path(f"{other}{HALF}").write_bytes(b"of another state")
    Path(f"{other}{NOTE}").write_bytes(b"{}")
    fetch(session, CELL, recording, other)
    assert other.read_bytes() == target.read_bytes()
    assert {path.name for path in farm.folder.iterdir()} == {"run.bag", "other.bag"}
    (runs / "a" / "run.bag").unlink()
    with pytest.raises(FetchError, match=r"run\.bag: cannot be read"):
        fetch(session, CELL, recording, farm.folder / "third.bag")


CONTENT, MADE = bytes(range(20)), Recording("run.bag", 20, 1)


def line_to(content: bytes) -> Any:
    """Return a session with a cell that gives this, 7 bytes at a time."""

    def get(_: str, *, payload: bytes, timeout: float) -> list[SimpleNamespace]:
        begin = msgspec.json.decode(payload, type=PieceAsked).offset
        return [SimpleNamespace(ok=SimpleNamespace(payload=content[begin : begin + 7]), err=None)]

    return SimpleNamespace(get=get)


def test_a_second_fetch_beside_the_first_one_is_refused(tmp_path: Path) -> None:
    """Both would write into one part, and what comes of that has the right size at best."""
    target = tmp_path / "run.bag"
    refused: list[int] = []

    def call_again(there: int) -> None:
        with pytest.raises(FetchError, match=r"run\.bag: is being fetched already"):
            fetch(line_to(CONTENT), CELL, MADE, target)
        refused.append(there)

    fetch(line_to(CONTENT), CELL, MADE, target, call_again)
    assert refused == [0, 7, 14, 20] and target.read_bytes() == CONTENT
    assert [path.name for path in tmp_path.iterdir()] == ["run.bag"]


def test_a_fetch_that_comes_as_another_one_ends_leaves_its_file_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it has opened as a part has its full name by now."""
    target = tmp_path / "run.bag"
    lock = fcntl.flock

    def after_another(*asked: Any) -> None:
        monkeypatch.setattr(fcntl, "flock", lock)
        fetch(line_to(CONTENT), CELL, MADE, target)
        lock(*asked)

    monkeypatch.setattr(fcntl, "flock", after_another)
    with pytest.raises(FetchError, match="is being fetched already"):
        fetch(line_to(CONTENT), CELL, MADE, target)
    assert target.read_bytes() == CONTENT


@pytest.mark.parametrize("part", [b"", bytes(21)])
def test_what_has_another_size_than_was_listed_gets_no_name(tmp_path: Path, part: bytes) -> None:
    """Of a cell that gives too much, and of a part that holds too much; it is not gone on with."""
    target = tmp_path / "run.bag"
    Path(f"{target}{HALF}").write_bytes(part)
    Path(f"{target}{NOTE}").write_bytes(encode(MADE))
    with pytest.raises(FetchError, match=r"run\.bag: 21 bytes of 20: list again"):
        fetch(line_to(CONTENT + b"more"), CELL, MADE, target)
    assert not target.exists() and not Path(f"{target}{HALF}").exists()
    fetch(line_to(CONTENT), CELL, MADE, target)
    assert target.read_bytes() == CONTENT


def test_a_recording_is_on_the_disk_before_it_has_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A power cut leaves all of it under that name, or nothing; the name is kept then, too."""
    target = tmp_path / "run.bag"
    named: list[bool] = []
    monkeypatch.setattr(os, "fsync", lambda _: named.append(target.exists()))
    fetch(line_to(CONTENT), CELL, MADE, target)
    assert named == [False, True]
