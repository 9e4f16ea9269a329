"""The journal's thread: whoever leaves an entry goes on, whatever the disk does."""

from __future__ import annotations

import errno
import os
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from cell_recorder.config import JournalSettings, load_journal
from cell_recorder.journal import writer_io as writer_module
from cell_recorder.journal.day_files_io import DayFiles
from cell_recorder.journal.entries import AnyEntry, Audit, Gap
from cell_recorder.journal.health import JournalStatus, diagnose, lost_at_close
from cell_recorder.journal.reader_io import read
from cell_recorder.journal.writer_io import JournalWriter
from harness.processes import wait_until
from msgspec.structs import replace
from scara_ros.diagnosis import Level

SETTINGS = replace(load_journal(Path(__file__).parents[4] / "config"), fsync_ms=20.0)


class Disk:
    """The calls that write, which fail while ``problem`` is set and wait while ``slow`` is."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.problem: OSError | None = None
        self.free = threading.Event()
        self.free.set()
        self.syncs = self.attempts = self.asked = 0
        self._write, self._sync = os.write, os.fdatasync
        monkeypatch.setattr(os, "write", self._may(self._write))
        monkeypatch.setattr(os, "fdatasync", self._may(self._counted))
        monkeypatch.setattr(writer_module, "RETRY_S", 0.01)

    def tried_since(self, before: int) -> bool:
        """Return whether the disk was asked for something since a count."""
        return self.attempts > before

    def _counted(self, fd: int) -> None:
        self.syncs += 1
        self._sync(fd)

    def _may(self, call: Callable[..., Any]) -> Callable[..., Any]:
        def guarded(*arguments: Any) -> Any:
            if threading.current_thread().name != "journal":
                return call(*arguments)
            self.asked += 1
            assert self.free.wait(10.0)
            self.attempts += 1
            if self.problem is not None:
                raise self.problem
            return call(*arguments)

        return guarded


@pytest.fixture
def disk(monkeypatch: pytest.MonkeyPatch) -> Disk:
    """Give a disk that can be broken."""
    return Disk(monkeypatch)


def start(folder: Path, **changes: Any) -> JournalWriter:
    """Start a writer."""
    settings: JournalSettings = replace(SETTINGS, **changes)
    return JournalWriter(DayFiles(folder, "cell", settings), settings)


def said(what: str) -> Audit:
    """Return an entry without a time."""
    return Audit(who="a program", what=what, success=True, outcome="")


def whats(folder: Path) -> list[Any]:
    """Return what was said, or how many entries a gap stands for."""
    entries: list[AnyEntry] = list(read(folder, 0, pytest.fail))
    assert [entry.number for entry in entries] == list(range(1, len(entries) + 1))
    return [
        entry.lost if isinstance(entry, Gap) else getattr(entry, "what", "") for entry in entries
    ]


def test_entries_are_written_at_once_and_safe_soon(tmp_path: Path, disk: Disk) -> None:
    """A reader sees them; the disk is asked once for what came together."""
    with start(tmp_path, fsync_ms=100.0) as writer:
        for n in range(20):
            writer.put(said(str(n)))
        wait_until(lambda: len(whats(tmp_path)) == 20, 5.0, "all entries")
        assert disk.syncs <= 2  # one of the new file
        wait_until(lambda: disk.syncs >= 1, 5.0, "a safe entry")
        assert all(entry.time > 1e9 for entry in read(tmp_path))


def test_disk_is_not_asked_before_entries_are_due(tmp_path: Path, disk: Disk) -> None:
    """However many come one after the other meanwhile."""
    with start(tmp_path, fsync_ms=60_000.0) as writer:
        for n in range(5):
            writer.put(said(str(n)))
            wait_until(lambda n=n: len(whats(tmp_path)) == n + 1, 5.0, "the entry")
        assert disk.syncs <= 1  # of the new file


def test_a_flood_does_not_put_off_what_is_due(
    tmp_path: Path, disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each entry is followed by another before it is written; they are made safe all the same."""
    flooded, write = threading.Event(), os.write
    with start(tmp_path) as writer:

        def and_again(*arguments: Any) -> int:
            if threading.current_thread().name == "journal" and not flooded.is_set():
                writer.put(said("again"))
            return write(*arguments)

        monkeypatch.setattr(os, "write", and_again)
        writer.put(said("first"))
        try:
            wait_until(lambda: disk.syncs >= 3, 5.0, "safe entries while the flood lasts")
        finally:
            flooded.set()


def test_the_slowest_answer_of_the_disk_is_told_in_milliseconds(tmp_path: Path) -> None:
    """None yet: 0."""
    with start(tmp_path) as writer:
        assert writer.status.slowest_sync_ms == 0.0
        writer._slowest = 70.0
        assert writer.status.slowest_sync_ms == 70_000.0
    assert JournalStatus() == JournalStatus(0, 0, 0, "", "", 0.0, 0.0), "nothing is known"


def test_a_disk_that_takes_nothing_is_left_alone_for_a_while(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is tried again, and not as fast as this machine can."""
    waits: list[float] = []
    with start(tmp_path) as writer:
        wait_for = writer._changed.wait_for

        def noted(condition: Callable[[], bool], seconds: float | None = None) -> bool:
            if writer.status.problem:
                waits.append(seconds or 0.0)
            return wait_for(condition, seconds)

        def full(*_: Any) -> int:
            raise OSError(errno.ENOSPC, "no room")

        monkeypatch.setattr(writer._changed, "wait_for", noted)
        monkeypatch.setattr(os, "write", full)
        writer.put(said("first"))
        wait_until(lambda: bool(waits), 10.0, "a wait for the disk")
    assert min(waits) >= 0.5


def test_nobody_waits_for_a_slow_disk(tmp_path: Path, disk: Disk) -> None:
    """An entry is left within a moment while the disk hangs, and written later."""
    with start(tmp_path) as writer:
        writer.put(said("first"))
        wait_until(lambda: whats(tmp_path) == ["first"], 5.0, "the first entry")
        disk.free.clear()
        for n in range(50):
            writer.put(said(str(n)))  # would hang here
        assert whats(tmp_path) == ["first"]
        disk.free.set()
        wait_until(lambda: len(whats(tmp_path)) == 51, 5.0, "all entries")


def test_what_a_full_disk_did_not_take_is_counted_in_a_gap(tmp_path: Path, disk: Disk) -> None:
    """What fits into the queue is written later, in order; the numbers have no gap."""
    with start(tmp_path, queue_entries=10) as writer:
        disk.problem = OSError(28, "No space left on device")
        for n in range(25):
            writer.put(said(str(n)))
        wait_until(lambda: writer.status.problem, 5.0, "a problem")
        status = writer.status
        assert "No space left on device" in status.problem and status.lost == 15
        found = diagnose(status, 0, "/journal")
        assert found.level == Level.ERROR
        assert "No space left on device; 11 entries wait, 15 are lost" in found.message
        disk.problem = None
        wait_until(lambda: len(whats(tmp_path)) == 11, 5.0, "what was kept")
        writer.put(said("later"))
        wait_until(lambda: not writer.status.waiting, 5.0, "an empty queue")
        assert whats(tmp_path) == [*map(str, range(10)), 15, "later"]
        assert writer.status.problem == ""
        assert diagnose(writer.status, 0, "/journal").level == Level.OK


def test_memory_stays_bounded_while_the_disk_takes_nothing(tmp_path: Path, disk: Disk) -> None:
    """Each attempt takes entries out of the queue and puts them back: that is no room for more."""
    with start(tmp_path, queue_entries=10) as writer:
        disk.problem = OSError(28, "No space left on device")
        for _ in range(30):
            before = disk.attempts
            for _ in range(10):
                writer.put(said("x"))
            wait_until(partial(disk.tried_since, before), 5.0, "another attempt")
        assert writer.status.waiting <= 11
        disk.problem = None
        wait_until(lambda: not writer.status.waiting, 5.0, "an empty queue")
        assert sum(each if isinstance(each, int) else 1 for each in whats(tmp_path)) == 300


def test_memory_stays_bounded_where_entries_come_while_the_disk_is_asked(
    tmp_path: Path, disk: Disk
) -> None:
    """All that waits is out of the queue then, which is empty: that is no room for more either."""
    with start(tmp_path, queue_entries=10) as writer:
        disk.problem = OSError(28, "No space left on device")
        for _ in range(10):
            asked = disk.asked
            disk.free.clear()
            writer.put(said("x"))
            wait_until(lambda asked=asked: disk.asked > asked, 5.0, "the disk being asked")
            for _ in range(9):
                writer.put(said("x"))
            before = disk.attempts
            disk.free.set()
            wait_until(partial(disk.tried_since, before), 5.0, "the end of that attempt")
        wait_until(lambda: writer.status.waiting <= 11, 1.0, "no more than the queue and a gap")
        disk.problem = None
        wait_until(lambda: not writer.status.waiting, 5.0, "an empty queue")
        assert sum(each if isinstance(each, int) else 1 for each in whats(tmp_path)) == 100


def test_folder_that_cannot_be_made_is_tried_again(tmp_path: Path, disk: Disk) -> None:
    """The node goes on; as soon as there is a folder, everything is written."""
    (tmp_path / "journal").write_text("a file in the way")
    folder = tmp_path / "journal" / "cell"
    with start(folder) as writer:
        writer.put(said("first"))
        wait_until(lambda: writer.status.problem, 5.0, "a problem")
        assert "journal" in writer.status.problem
        (tmp_path / "journal").unlink()
        wait_until(lambda: whats(folder) == ["first"], 5.0, "the first entry")


def test_failed_sync_looks_at_the_file_again(tmp_path: Path, disk: Disk) -> None:
    """After such an error nobody knows what the disk holds."""
    with start(tmp_path, fsync_ms=0.0) as writer:
        writer.put(said("first"))
        wait_until(lambda: disk.syncs, 5.0, "a sync")
        real, disk._sync = disk._sync, lambda fd: (_ for _ in ()).throw(OSError(5, "I/O error"))
        writer.put(said("second"))
        wait_until(lambda: "I/O error" in writer.status.problem, 5.0, "a problem")
        disk._sync = real
        writer.put(said("third"))
        wait_until(lambda: whats(tmp_path) == ["first", "second", "third"], 5.0, "all entries")


def test_close_writes_what_waits(tmp_path: Path, disk: Disk) -> None:
    """An end is no loss, and another process may write at once."""
    for name in ("first", "second"):
        writer = start(tmp_path)
        writer.put(said(name))
        assert writer.close().waiting == 0
    assert whats(tmp_path) == ["first", "second"]


def test_close_ends_although_the_disk_is_full(tmp_path: Path, disk: Disk) -> None:
    """What is lost is in the answer."""
    writer = start(tmp_path)
    disk.problem = OSError(28, "No space left on device")
    writer.put(said("lost"))
    status = writer.close()
    assert status.waiting == 1 and not writer._thread.is_alive()
    assert lost_at_close(status) == f"1 entry is lost: {tmp_path}: No space left on device"


def test_close_says_why_an_entry_is_lost_that_came_too_late(tmp_path: Path) -> None:
    """The disk is well: a callback was still running when the node ended."""
    writer = start(tmp_path)
    writer.put(said("in time"))
    assert lost_at_close(writer.close()) == ""
    writer.put(said("late"))
    writer.put(said("later"))
    told = lost_at_close(writer.close())
    assert told == "2 entries are lost: they came when the journal was closed already"
    assert whats(tmp_path) == ["in time"]


def test_close_says_why_an_entry_is_lost_that_the_disk_has_not_taken(
    tmp_path: Path, disk: Disk, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It hangs; the node ends all the same."""
    monkeypatch.setattr(writer_module, "CLOSE_DEADLINE_S", 0.05)
    writer = start(tmp_path)
    wait_until(lambda: writer.status.file != "", 10.0, "an open journal")
    disk.free.clear()
    writer.put(said("never"))
    told = lost_at_close(writer.close())
    disk.free.set()
    assert told == "1 entry is lost: the disk took too long, more than 0.05 s: is it slow, or hung?"


@pytest.mark.parametrize(
    ("waiting", "lost", "said_so"),
    [
        (1, 0, "not written: full; 1 entry waits"),
        (1, 1, "not written: full; 1 entry waits, 1 is lost"),
        (2, 5, "not written: full; 2 entries wait, 5 are lost"),
    ],
)
def test_numbers_of_entries_are_told_as_people_say_them(
    waiting: int, lost: int, said_so: str
) -> None:
    """One entry is no entries."""
    status = JournalStatus(waiting=waiting, lost=lost, problem="full")
    assert diagnose(status, 0, "/journal").message == said_so


def test_status_of_a_good_journal_is_ok() -> None:
    """With its numbers as values."""
    found = diagnose(JournalStatus(number=7, held_mb=1.25), 2, "/journal")
    assert (found.level, found.message) == (Level.OK, "7 entries")
    assert found.values["active_alarms"] == 2
