"""The journal's thread: whoever has an entry leaves it and goes on, whatever the disk does."""

from __future__ import annotations

import dataclasses
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence

from msgspec.structs import replace

from cell_recorder.config import JournalSettings
from cell_recorder.journal.day_files_io import DayFiles
from cell_recorder.journal.entries import Entry, Gap
from cell_recorder.journal.health import JournalStatus

RETRY_S = 1.0  # our choice: so often a disk that takes nothing is tried again
BATCH = 500  # our choice: entries in one write
CLOSE_DEADLINE_S = 3.0


class JournalWriter:
    """Writes entries in a thread of its own; a context manager."""

    def __init__(
        self,
        files: DayFiles,
        settings: JournalSettings,
        on_number: Callable[[int], None] = lambda number: None,
    ) -> None:
        """Begin.

        Args:
            files: Of the journal, not open yet.
            settings: Of journal.yaml.
            on_number: Is told the newest number, in the thread that writes.
        """
        self._files, self._settings = files, settings
        self._on_number = on_number
        self._changed = threading.Condition()
        self._waiting: deque[Entry] = deque()
        self._taken = 0  # entries that are being written and go back if that fails
        # The problem is empty while the disk takes entries; each attempt sets or clears it.
        self._lost, self._problem, self._slowest = 0, "", 0.0
        # Copies of what the files know: those belong to the thread that writes.
        self._number, self._held_mb = 0, 0.0
        self._ending = False
        # When the oldest entry was written that no fsync has made safe; None: all are safe.
        self._unsafe_since: float | None = None
        self._thread = threading.Thread(target=self._run, name="journal", daemon=True)
        self._thread.start()

    def put(self, entry: Entry) -> None:
        """Leave an entry; it is written soon. Never waits for the disk.

        While the disk takes none, ``queue_entries`` wait for it; of those that come then, a gap
        tells how many there were.
        """
        with self._changed:
            entry = entry if entry.time else replace(entry, time=time.time())
            newest = self._waiting[-1] if self._waiting else None
            held = len(self._waiting) + self._taken
            if held < self._settings.queue_entries:
                self._waiting.append(entry)
            elif isinstance(newest, Gap) and newest.lost:
                self._lost += 1
                self._waiting[-1] = replace(newest, lost=newest.lost + 1, until=entry.time)
            else:
                self._lost += 1
                why = f"not kept: {self._problem or 'more came than the disk took'}"
                now = entry.time
                self._waiting.append(Gap(time=now, lost=1, since=now, until=now, why=why))
            self._changed.notify()

    @property
    def status(self) -> JournalStatus:
        """How the journal is now."""
        with self._changed:
            return JournalStatus(
                number=self._number,
                waiting=len(self._waiting) + self._taken,
                lost=self._lost,
                problem=self._problem,
                file=str(self._files.path) if self._files.is_open else "",
                held_mb=self._held_mb,
                slowest_sync_ms=1e3 * self._slowest,
            )

    def close(self) -> JournalStatus:
        """Write what waits, if the disk takes it, and let go of the files.

        Returns:
            How it ended; ``problem`` says why something still waits, and is lost.
        """
        with self._changed:
            self._ending = True
            self._changed.notify()
        self._thread.join(CLOSE_DEADLINE_S)
        status = self.status
        if status.problem or not status.waiting:
            return status
        it = "it" if status.waiting == 1 else "they"
        if self._thread.is_alive():
            why = f"the disk took too long, more than {CLOSE_DEADLINE_S:g} s: is it slow, or hung?"
        else:
            why = f"{it} came when the journal was closed already"
        return dataclasses.replace(status, problem=why)

    def __enter__(self) -> JournalWriter:
        """Return the writer, which runs already."""
        return self

    def __exit__(self, *error: object) -> None:
        """Close."""
        self.close()

    def _run(self) -> None:
        """Write until closed; a disk that takes nothing is tried again each second."""
        self._attempt(self._open)
        while True:
            with self._changed:
                if not self._ending and not self._problem:
                    self._changed.wait_for(self._has_work, self._until_due())
                ending = self._ending
            if self._attempt(self._work, final=ending) and ending and not self._waiting:
                break
            if ending and self._problem:
                break
            if self._problem:
                with self._changed:  # an end ends the wait
                    self._changed.wait_for(lambda: self._ending, RETRY_S)
        self._files.close()

    def _has_work(self) -> bool:
        """Whether the thread has something to do now."""
        return bool(self._waiting) or self._ending

    def _until_due(self) -> float | None:
        """Return how long entries may wait to be safe [s]; None: all are."""
        if self._unsafe_since is None:
            return None
        due = self._unsafe_since + self._settings.fsync_ms * 1e-3
        return max(0.0, due - time.monotonic())

    def _attempt(self, action: Callable[..., None], **arguments: bool) -> bool:
        """Do something with the disk; return whether it went well, and keep in words why not."""
        problem = ""
        try:
            action(**arguments)
        except OSError as error:
            where = f"{error.filename or self._files.folder}: " if error.strerror else ""
            problem = f"{where}{error.strerror or error}"
        except Exception as error:  # a thread that dies would lose everything, and say nothing
            problem = f"{type(error).__name__}: {error}"
        with self._changed:
            self._problem = problem
            self._number, self._held_mb = self._files.last_number, self._files.held_mb
        return not problem

    def _open(self) -> None:
        """Open the journal; what it has found is told before all that waits."""
        self._files.open(time.time())

    def _work(self, final: bool) -> None:
        """Write what waits; make it safe when that is due."""
        if not self._files.is_open:
            self._open()
        while batch := self._take():
            written = 0
            try:
                written = self._files.append(batch, time.time())
            finally:
                # Let what was not written wait again, in front; two gaps that meet become one
                entries = batch[written:]
                with self._changed:
                    joined = _joined(entries[-1:], self._waiting)
                    if joined is not None:
                        self._waiting[0], entries = joined, entries[:-1]
                    self._waiting.extendleft(reversed(entries))
                    self._taken = 0
                    self._number = self._files.last_number
            if self._unsafe_since is None:
                self._unsafe_since = time.monotonic()
            self._on_number(self._files.last_number)
            if self._until_due() == 0.0:
                break  # a flood does not put off what is due
        if final or self._until_due() == 0.0:
            self._sync()

    def _take(self) -> list[Entry]:
        """Take the next entries; what the files have to tell comes before what waits."""
        with self._changed:
            while self._files.told:
                entry = self._files.told.pop()
                self._waiting.appendleft(entry if entry.time else replace(entry, time=time.time()))
            self._taken = min(BATCH, len(self._waiting))
            return [self._waiting.popleft() for _ in range(self._taken)]

    def _sync(self) -> None:
        """Make all entries safe."""
        begun = time.monotonic()
        self._files.sync()
        self._unsafe_since = None
        self._slowest = max(self._slowest, time.monotonic() - begun)


def _joined(ends: Sequence[Entry], begins: Sequence[Entry]) -> Gap | None:
    """Return the one gap that two become which meet; None if they are not two."""
    if not ends or not begins:
        return None
    last, following = ends[-1], begins[0]
    if not (isinstance(last, Gap) and isinstance(following, Gap)):
        return None
    if not (last.lost and following.lost):
        return None
    return replace(last, lost=last.lost + following.lost, until=following.until)
