"""Write a journal: one file a day (UTC), appended to, bounded; what a crash has torn is kept aside.

A clock that was ahead leaves files from the future; they are put aside once it is right again. One
thread uses it. Every error leaves the files as they were, so that the same entries can be written
again.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
from collections.abc import Sequence
from datetime import date, timedelta
from itertools import count
from pathlib import Path

from scara_config.files.whole_file import sync_folder
from scara_ros.journal_files_io import files_of, numbered

from cell_recorder.config import JournalSettings
from cell_recorder.journal.entries import Entry, Gap, Torn, encode, stamped
from cell_recorder.journal.reader_io import day_of, utc_day

LOCK = ".lock"
TAIL = 1 << 20  # our choice: so much of a file's end is looked at first [bytes]
ASIDE = ".future"  # ending of a file that was written while the clock was ahead, and put aside
AHEAD = timedelta(days=2)  # our choice: a clock that is corrected by less writes on into that file
CLOCK_SET = date(2023, 6, 10)  # [src] Debian 12 came out then: a clock before it was not set yet
SHOWN = 200  # our choice: so much of a torn line is in its entry [bytes]


class JournalError(OSError):
    """The journal cannot be written now; the text says why and what to do."""


class DayFiles:
    """The files of one cell's journal, open for writing; a context manager."""

    def __init__(self, folder: Path, cell: str, settings: JournalSettings) -> None:
        """Remember where; nothing is opened yet."""
        self.folder = folder
        self._cell = cell
        self._settings = settings
        self.told: list[Entry] = []
        """What has to be told by entries: torn lines, removed files; the writer takes them."""
        # Held as long as the journal is open; the kernel frees it when the process dies.
        self._lock_fd: int | None = None
        self._fd: int | None = None
        # Of the file that is written to. It only grows: numbers grow from file to file, even where
        # the clock is set back.
        self._day = date.min
        self._size = 0
        # Bytes of all other files, counted when a day begins: looking at the folder for each entry
        # would cost more than writing it.
        self._others = 0
        self._last = 0

    @property
    def last_number(self) -> int:
        """Number of the newest entry; 0: there is none."""
        return self._last

    @property
    def path(self) -> Path:
        """The file that is written to."""
        return self.folder / f"{self._day.isoformat()}.jsonl"

    @property
    def held_mb(self) -> float:
        """Size of all files [MB]."""
        return (self._others + self._size) * 1e-6

    @property
    def is_open(self) -> bool:
        """Whether entries can be appended."""
        return self._fd is not None

    def open(self, now: float) -> None:
        """Take the journal, keep aside what is torn, open today's file.

        Args:
            now: Unix time [s].

        Raises:
            JournalError: Another process writes this journal.
            OSError: The folder cannot be made or written to.
        """
        self.close()
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            # Be the only writer; the kernel gives the lock back however this process ends
            self._lock_fd = os.open(
                self.folder / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644
            )
            try:
                fcntl.flock(self._lock_fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                owner = os.pread(self._lock_fd, 20, 0).decode(errors="replace").strip() or "unknown"
                raise JournalError(
                    f"{self.folder} is written by process {owner}, another cell of the same name: "
                    "give this one a name (./cell up --name), or another folder (--runs)"
                ) from None
            os.ftruncate(self._lock_fd, 0)
            os.pwrite(self._lock_fd, str(os.getpid()).encode(), 0)
            # Find the newest whole entry, and keep aside what follows it.
            future = self._from_future(now)
            self._mend_newest(future, now)
            self._mend_newest([path for path in files_of(self.folder) if path not in future], now)
            # Today's file may have no entry yet whose number is beyond those that were put aside.
            self._mend_newest(self._aside(), now)
            if future:
                self._leave_future(now)
            else:
                self._go_on(now, files_of(self.folder))
        except BaseException:
            self.close()
            raise

    def append(self, entries: Sequence[Entry], now: float) -> int:
        """Write the first of ``entries``, those of one day, with their numbers; return how many.

        What finds its own day's file full goes into today's.

        Args:
            entries: At least one.
            now: Unix time [s]. An entry that says a later one is of today all the same.

        Raises:
            JournalError: The day's file has come to its limit.
            OSError: The disk took none of them.
        """
        assert self._fd is not None, "open() comes first"
        today = utc_day(now)
        if self._day > today + AHEAD and today >= CLOCK_SET:
            self._leave_future(now)
        # Never back to an older file: numbers grow from file to file, whatever the clock does.
        days = [max(min(utc_day(entry.time), today), self._day) for entry in entries]
        if days[0] != self._day:
            self._open_day(days[0], now)
        many = next((n for n, day in enumerate(days) if day != days[0]), len(days))
        lines = b"".join(
            encode(stamped(entry, self._last + place, self._cell))
            for place, entry in enumerate(entries[:many], 1)
        )
        limit = self._settings.day_limit_mb * 1e6
        if self._size + len(lines) > limit and self._day < today:
            self._open_day(today, now)  # what waits since the day before came to its limit
        if self._size + len(lines) > limit:
            raise JournalError(
                f"{self.path} has come to day_limit_mb = {self._settings.day_limit_mb:g} of "
                "journal.yaml: what happens is counted and not kept until tomorrow (UTC). Look "
                "what happens so often (./cell why --since 1h), or raise day_limit_mb"
            )
        self._make_room(len(lines), now)
        self._write(lines)
        self._last += many
        self._size += len(lines)
        return many

    def sync(self) -> None:
        """Return when everything is on the disk.

        Raises:
            JournalError: Somebody has removed the file.
            OSError: The disk failed; nobody knows what it holds. In both cases the journal is
                closed, and looks at it when it is opened again.
        """
        if self._fd is None:
            return
        try:
            os.fdatasync(self._fd)
            if os.fstat(self._fd).st_nlink == 0:
                text = f"{self.path} was removed by somebody while it was written; it begins anew"
                self.told.append(Gap(why=text, removed=[self.path.name]))
                raise JournalError(text)
        except OSError:
            # A disk tells its fault once only: whoever asks again would take all for safe.
            self.close()
            raise

    def close(self) -> None:
        """Let go of the files; the next ``open`` goes on behind the newest entry."""
        for fd in (self._fd, self._lock_fd):
            if fd is not None:
                with contextlib.suppress(OSError):
                    os.close(fd)
        self._fd = self._lock_fd = None

    def _mend_newest(self, files: list[Path], now: float) -> None:
        """Take in the newest number of some files, and keep aside what is torn behind it."""
        for path in reversed(files):
            number, torn = _mend(path)
            if torn:
                kept = path.with_suffix(".torn").name
                text = torn[:SHOWN].decode(errors="replace")
                self.told.append(
                    Torn(time=now, file=path.name, kept=kept, size=len(torn), text=text)
                )
            if number is not None:
                # Where files were removed below a running journal, its numbers go on.
                self._last = max(self._last, number)
                break

    def _from_future(self, now: float) -> list[Path]:
        """Return the files of days that cannot have come yet, the oldest first."""
        today = utc_day(now)
        if today < CLOCK_SET:  # it is this clock that is wrong
            return []
        return [path for path in files_of(self.folder) if day_of(path) > today + AHEAD]

    def _aside(self) -> list[Path]:
        """Return the files that were put aside, in the order of their numbers."""
        return sorted(self.folder.glob(f"*{ASIDE}"), key=lambda path: path.stat().st_mtime_ns)

    def _leave_future(self, now: float) -> None:
        """Go on in today's file, which says so first, and put aside what is from the future.

        Whoever reads the journal meanwhile sees no newest number that is less than before: the
        others go when this one is on the disk.
        """
        try:
            moves = {path: _free_name(path) for path in self._from_future(now)}
            self._go_on(now, [path for path in files_of(self.folder) if path not in moves])
            names = ", ".join(f"{old.name} as {new.name}" for old, new in moves.items())
            text = f"this machine's clock was ahead and is right again: put aside {names}"
            gap = Gap(time=now, why=text)
            line = encode(stamped(gap, self._last + 1, self._cell))
            self._write(line)
            self._last += 1
            self._size += len(line)
            self.sync()
            for old, new in moves.items():
                old.rename(new)
            sync_folder(self.folder)
        except BaseException:
            self.close()  # the next open() does it again
            raise

    def _go_on(self, now: float, files: list[Path]) -> None:
        """Go on with today's file, or with the newest of ``files`` if that is a later one."""
        newest = day_of(files[-1]) if files else date.min
        self._open_day(max(utc_day(now), newest), now)

    def _open_day(self, day: date, now: float) -> None:
        """Go on with the file of a day."""
        if self._fd is not None:
            self.sync()
            os.close(self._fd)
            self._fd = None
        self._day = day
        self._fd = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o644)
        sync_folder(self.folder)
        self._size = os.fstat(self._fd).st_size
        # Days with a file count, not days of the calendar: a clock that was wrong removes none.
        old = files_of(self.folder)[: -self._settings.keep_days]
        self._count_others()
        self._remove(old, f"keep_days = {self._settings.keep_days}", now)
        self._make_room(0, now)

    def _count_others(self) -> list[Path]:
        """Count all files but today's, and return them: what was put aside, then the oldest."""
        others = [path for path in (*self._aside(), *files_of(self.folder)) if path != self.path]
        self._others = sum(path.stat().st_size for path in others)
        return others

    def _make_room(self, size: int, now: float) -> None:
        """Remove files until ``size`` more bytes fit: what was put aside, then the oldest.

        Today's stays.
        """
        most = self._settings.limit_mb * 1e6 - self._size - size  # of the others
        if self._others <= most:
            return
        # Somebody may have removed some since the day began.
        others = self._count_others()
        excess = self._others - most
        gone = []
        for path in others:
            if excess <= 0.0:
                break
            gone.append(path)
            excess -= path.stat().st_size
        self._remove(gone, f"limit_mb = {self._settings.limit_mb:g}", now)

    def _remove(self, files: list[Path], limit: str, now: float) -> None:
        """Remove whole files with what was kept aside of them, and tell it."""
        if not files:
            return
        for path in files:
            self._others -= path.stat().st_size
            path.unlink()
            path.with_suffix(".torn").unlink(missing_ok=True)
        names = [path.name for path in files]
        text = f"removed {', '.join(names)}: the journal was beyond {limit} of journal.yaml"
        self.told.append(Gap(time=now, why=text, removed=names))

    def _write(self, lines: bytes) -> None:
        """Append whole lines, or nothing of them."""
        assert self._fd is not None
        left = memoryview(lines)
        try:
            while left:
                left = left[os.write(self._fd, left) :]
        except OSError:
            # A full disk takes the first half of a line. Cutting off needs no room.
            try:
                os.ftruncate(self._fd, self._size)
            except OSError:
                self.close()
            raise


def _mend(path: Path) -> tuple[int | None, bytes]:
    """Cut off what follows the last whole entry of a file; it is in FILE.torn before.

    Returns:
        Number of the last whole entry, None if the file has none; and what was cut off.
    """
    with path.open("r+b") as stream:
        size = stream.seek(0, os.SEEK_END)
        window = TAIL
        while True:
            begin = max(0, size - window)
            stream.seek(begin)
            number, end, whole = _last_whole(stream.read(), begin)
            if number is not None or begin == 0:
                break
            window *= 8
        stream.seek(end)
        torn = stream.read()
        if not whole:
            # All of it is there but the end of the line.
            stream.seek(0, os.SEEK_END)
            stream.write(b"\n")
        elif torn:
            with path.with_suffix(".torn").open("ab") as kept:
                kept.write(torn if torn.endswith(b"\n") else torn + b"\n")
                kept.flush()
                os.fsync(kept.fileno())
            stream.truncate(end)
        stream.flush()
        os.fsync(stream.fileno())
    return number, torn if whole else b""


def _last_whole(data: bytes, begin: int) -> tuple[int | None, int, bool]:
    """Look for the last whole entry in the end of a file.

    Args:
        data: The end of the file.
        begin: Where in the file it begins.

    Returns:
        Its number, or None; where it ends; and whether it has an end of line.
    """
    end = len(data)
    while end > 0:
        stop = end - 1 if data[end - 1 : end] == b"\n" else end
        start = data.rfind(b"\n", 0, stop) + 1
        # The first line of a part of a file may be the rest of a line.
        if (start > 0 or begin == 0) and (found := numbered(data[start:stop])) is not None:
            return found.number, begin + end, stop < end
        end = start
    return None, begin, True


def _free_name(path: Path) -> Path:
    """Return the first name for a file to be put aside that no other one has."""
    names = (path.with_suffix(f".{n}{ASIDE}" if n > 1 else ASIDE) for n in count(1))
    return next(name for name in names if not name.exists())
