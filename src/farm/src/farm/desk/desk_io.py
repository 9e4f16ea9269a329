"""The desk on the bus: it watches all cells of a site and keeps their events."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections import deque
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import msgspec
import zenoh
from msgspec.structs import replace
from scara_ros.shell.program_io import say

from farm import keys
from farm.config import FarmConfig
from farm.desk.alarm_desk_io import KINDS as OF_ALARMS
from farm.desk.alarm_desk_io import MARKS, AlarmDesk, MarksAsked
from farm.desk.alarms import AlarmRow
from farm.desk.history_io import History, HistoryError, Kept
from farm.desk.intake import (
    Progress,
    Taken,
    common_number,
    is_other,
    question,
    take_answer,
    take_health,
    take_live,
)
from farm.desk.mailbox_io import Mailbox
from farm.desk.reading_io import newest_of, of_kinds, times_of
from farm.desk.roster import Roster, Row
from farm.keys import CellName
from farm.wire import Answer, CellState, Event, Events, Health, WireError, decode, encode

ASKING = 8
"""Our choice: so many journals are read at once."""
ANSWER_S = 5.0
"""Our choice: a cell that is busy reads 500 events in well under a second."""
MOST_UNWRITTEN = 20_000
"""Our choice: events that wait for the disk; 20 MB. Journals are asked no further then."""
AGAIN_S = 5.0
"""Our choice: so long after the disk took nothing it is tried again."""

COMING_S = 10.0
"""Our choice: so long after the desk's start a cell that does not come is an alarm."""
AWAY_S = 2.5
"""Our choice: a cell that is lost for longer is an alarm. When the door for other machines is
opened anew, because another one may come in or one no longer, theirs are away for a second."""

KINDS: dict[str, type[CellState | Event | Health]] = {
    keys.STATE: CellState,
    keys.EVENT: Event,
    keys.HEALTH: Health,
}
"""What each key of a cell brings."""


class Desk:
    """Holds what is known of all cells; safe to use from several threads; a context manager."""

    def __init__(self, session: zenoh.Session, config: FarmConfig, history: History) -> None:
        """Go on where the history ends, and begin to listen.

        Args:
            session: An open session; the desk leaves it open.
            config: farm.yaml.
            history: Where events are kept.

        Raises:
            HistoryError: The history cannot be read.
        """
        self.session, self._config, self._history = session, config, history
        self._lock = threading.Lock()
        self._roster = Roster(config.desk.silent_ms * 1e-3)
        # What has come of each journal. It runs ahead of the disk; `_written` is what a desk that
        # is killed now would begin from.
        self._progress: dict[CellName, Progress] = {}
        # Era and number of the newest event that people were told of.
        self._told: dict[CellName, tuple[int, int]] = {}
        # Whose journal is being read: one question at a time for each, however many gaps show.
        self._asking: set[CellName] = set()
        # Waits for the next flush. Beyond MOST_UNWRITTEN no journal is read on.
        self._queue: list[Kept] = []
        # None: only the benchmark asks how old states are when they come.
        self._ages: list[float] | None = None
        # Keys that were taken apart already: a cell says the same few all day.
        self._names: dict[str, tuple[CellName, str]] = {}
        # Set while the disk takes nothing. What came meanwhile is forgotten and asked anew, so
        # that a full disk costs no memory.
        self._trouble, self._set_aside = "", False
        self._bad = 0
        self._ended = threading.Event()
        self.recent: deque[tuple[CellName, Event]] = deque(maxlen=config.desk.recent_events)
        for cell, (era, number, time_s) in newest_of(history.folder).items():
            if cell.site == config.site:
                self._progress[cell] = Progress(era, number, time_s, checked=False)
                self._roster.remember(cell, time_s)
        marks = history.folder.parent / MARKS
        try:
            self.alarms = AlarmDesk(marks, of_kinds(history.folder, OF_ALARMS))
        except OSError as error:
            raise HistoryError(f"{marks}: {error.strerror}") from error
        self._began = time.monotonic()
        self._written = dict(self._progress)
        self._pool = ThreadPoolExecutor(ASKING, "asking")
        self._writer = threading.Thread(target=self._write, name="writer", daemon=True)
        self._writer.start()
        site = config.site
        self._mailboxes = [
            Mailbox(session, keys.every(site, what), self._on_messages)
            for what in (keys.STATE, keys.EVENT, keys.HEALTH)
        ]
        self._declared: list[Any] = [
            session.liveliness().declare_subscriber(
                keys.every(site, keys.ALIVE), self._on_alive, history=True
            ),
            session.declare_queryable(f"{site}/{keys.ROSTER}", self._on_roster),
            session.declare_queryable(f"{site}/{keys.ALARMS}", self._on_alarms),
            session.declare_queryable(f"{site}/{keys.MARK}", self._on_mark),
        ]

    def __enter__(self) -> Desk:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def alarm_rows(self) -> list[AlarmRow]:
        """Return the alarms of all cells, the most urgent first."""
        return self.alarms.rows()

    @property
    def events_folder(self) -> Path:
        """Where the history is."""
        return self._history.folder

    @property
    def planned_run_time_s(self) -> dict[str, float]:
        """Planned run time of programs [s], of farm.yaml."""
        return self._config.desk.planned_run_time_s

    @property
    def trouble(self) -> str:
        """Why the history is not written, or empty."""
        return self._trouble

    @property
    def unreadable(self) -> int:
        """How many messages could not be read."""
        return self._bad

    def rows(self) -> list[Row]:
        """Return all cells, the worst first."""
        with self._lock:
            return self._roster.rows(time.time())

    def counted(self) -> dict[CellName, tuple[int, int]]:
        """Return how many states came of each cell, and how many did not."""
        with self._lock:
            return self._roster.counted()

    def measure_ages(self) -> list[float]:
        """Return a list to which the age of each state that comes is added [s]."""
        self._ages = []
        return self._ages

    def progress(self) -> dict[CellName, Progress]:
        """Return how far each cell's events have come."""
        with self._lock:
            return dict(self._progress)

    def close(self) -> None:
        """Cease to listen, and write what has come."""
        for declared in self._declared:
            with contextlib.suppress(zenoh.ZError):
                declared.undeclare()
        for mailbox in self._mailboxes:
            mailbox.close()
        # Behind the mailboxes: the writer still writes what they have handed on.
        self._ended.set()
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._writer.join()

    def _on_messages(self, samples: Sequence[zenoh.Sample]) -> None:
        """Take what came. Its key says what a message is, whichever subscription brought it."""
        now = time.time()
        behind: set[CellName] = set()
        with self._lock:
            for sample in samples:
                key = str(sample.key_expr)
                try:
                    cell, what = self._names.get(key) or self._named(key)
                    if self._put(cell, decode(bytes(sample.payload), KINDS[what]), now):
                        behind.add(cell)
                except (WireError, keys.CellNameError) as error:
                    self._unreadable(key, error)
        # Without the lock, which asking takes itself.
        for cell in behind:
            self._ask(cell)

    def _named(self, key: str) -> tuple[CellName, str]:
        """Return whose key it is, and of what; remembered from now on.

        Raises:
            CellNameError: No message of a cell has such a key.
        """
        cell, what = keys.owner(key), key.rpartition("/")[2]
        if what not in KINDS:
            raise keys.CellNameError(f"{key}: allowed at its end are {', '.join(KINDS)}")
        self._names[key] = cell, what
        return cell, what

    def _put(self, cell: CellName, message: CellState | Event | Health, now: float) -> bool:
        """Take in a message; return whether to ask the cell's journal. The caller has the lock."""
        if isinstance(message, CellState):
            if self._ages is not None:
                self._ages.append(now - message.stamp)
            self._roster.shown(cell, message, now)
            return False
        if isinstance(message, Health):
            self._roster.told(cell, message, now)
            return take_health(self._of(cell), message.last_event)
        return self._take(cell, take_live(self._of(cell), message))

    def _on_alive(self, sample: zenoh.Sample) -> None:
        key, now = str(sample.key_expr), time.time()
        try:
            cell = keys.owner(key)
        except keys.CellNameError as error:
            self._unreadable(key, error)
            return
        there = sample.kind == zenoh.SampleKind.PUT
        with self._lock:
            (self._roster.alive if there else self._roster.gone)(cell, now)
            if there and (known := self._progress.get(cell)) is not None:
                # After a power cut a journal has lost its end, and gives those numbers again. What
                # waits may be of that end.
                self._progress[cell] = replace(known, checked=False, waiting={})
        if there:
            self._ask(cell)

    def _on_roster(self, query: zenoh.Query) -> None:
        with query, contextlib.suppress(zenoh.ZError):
            query.reply(f"{self._config.site}/{keys.ROSTER}", msgspec.json.encode(self.rows()))

    def _on_alarms(self, query: zenoh.Query) -> None:
        with query, contextlib.suppress(zenoh.ZError):
            rows = msgspec.json.encode(self.alarms.rows())
            query.reply(f"{self._config.site}/{keys.ALARMS}", rows)

    def _on_mark(self, query: zenoh.Query) -> None:
        """Acknowledge or shelve an alarm, for ``?person=PERSON@DESK``."""
        with query, contextlib.suppress(zenoh.ZError):
            data = bytes(query.payload) if query.payload is not None else b""
            try:
                asked, person = decode(data, MarksAsked), query.parameters.get("person")
                answer = self.alarms.mark(asked, str(person or "somebody"))
            except WireError as error:
                answer = Answer(False, str(error))
            query.reply(f"{self._config.site}/{keys.MARK}", encode(answer))

    def _of(self, cell: CellName) -> Progress:
        return self._progress.get(cell, Progress())

    def _take(self, cell: CellName, taken: Taken) -> bool:
        """Keep what came; return whether to ask for more. The caller holds the lock."""
        self._progress[cell] = taken.progress
        self._roster.missed(cell, taken.progress.missing)
        for event in taken.events:
            self._queue.append(Kept(cell, taken.progress.era, event))
            place = (taken.progress.era, event.number)
            # Behind a disk that was full a journal is read once more: that is nothing new.
            if place > self._told.get(cell, (-1, 0)):
                self._told[cell] = place
                self.recent.append((cell, event))
                self.alarms.told(cell, event)
        return taken.ask

    def _ask(self, cell: CellName) -> None:
        """Have a cell's journal read, unless that is under way."""
        with self._lock:
            if cell in self._asking or self._set_aside or self._ended.is_set():
                return
            self._asking.add(cell)
        # While the desk ends the pool takes nothing more.
        with contextlib.suppress(RuntimeError):
            self._pool.submit(self._read_journal, cell)

    def _read_journal(self, cell: CellName) -> None:
        """Ask by number until the journal has no more, or does not answer.

        The next health message begins it again.
        """
        try:
            more = True
            while more and not self._ended.is_set() and not self._set_aside:
                with self._lock:
                    progress = self._of(cell)
                asked, common = progress.last, 0
                answer = self._answer(cell, question(progress))
                if answer is None:
                    return
                if is_other(progress, asked, answer):
                    known = times_of(self._history.folder, cell, asked)
                    compared = self._answer(cell, max(0, min(known, default=1) - 1))
                    if compared is None:
                        return
                    common = common_number(known, compared)
                with self._lock:
                    # Where its link has come meanwhile it is asked anew.
                    if self._of(cell).checked == progress.checked:
                        taken = take_answer(self._of(cell), asked, answer, common)
                        more = self._take(cell, taken)
                while len(self._queue) > MOST_UNWRITTEN and not self._ended.wait(0.05):
                    pass
        finally:
            with self._lock:
                self._asking.discard(cell)

    def _answer(self, cell: CellName, since: int) -> Events | None:
        """Return what a journal has after a number; None: no answer."""
        selector = f"{cell.key(keys.EVENTS)}?since={since}"
        for reply in self.session.get(selector, timeout=ANSWER_S):
            if reply.ok is None:
                return None
            try:
                return decode(bytes(reply.ok.payload), Events)
            except WireError as error:
                self._unreadable(str(reply.ok.key_expr), error)
        return None

    def _write(self) -> None:
        """Write what has come, in files of a flush each, until the desk ends and all is written."""
        period = self._config.desk.flush_ms * 1e-3
        last = False
        while not last:
            last = self._ended.wait(period)
            # Each cell that is lost is an alarm.
            if time.monotonic() - self._began > COMING_S:
                with self._lock:
                    lost = self._roster.lost()
                now = time.time()
                # The clock may have been set back, or that of a cell of the history be ahead.
                away = {cell: at for cell, at in lost.items() if abs(now - at) > AWAY_S}
                self.alarms.there(away, now)
            try:
                self._flush()
            # Of any kind: a writer that dies would be missed by nobody, nor a cell that is lost.
            except Exception as error:
                # What could not be written is forgotten: the cells' journals have it, and are
                # asked later.
                with self._lock:
                    self._trouble, self._set_aside = str(error), True
                    self._queue = []
                    # A link that came meanwhile may be behind a power cut: check all journals.
                    self._progress = {
                        cell: replace(known, checked=False, waiting={})
                        for cell, known in self._written.items()
                    }
                say(f"farm: the history cannot be written: {error}", sys.stderr)
                self._ended.wait(AGAIN_S)
                self._set_aside = False

    def _flush(self) -> None:
        with self._lock:
            batch, self._queue = self._queue, []
            reached = dict(self._progress)
        self._history.write(batch)
        # Only now: what is not on the disk is asked of the journals again.
        self._written = reached
        if not batch:
            return
        self._history.join()
        if self._trouble:
            self._trouble = ""
            say("farm: the history is written again")

    def _unreadable(self, key: str, error: Exception) -> None:
        """Count a message that is none of ours, and say so the first time."""
        self._bad += 1
        if self._bad == 1:
            say(f"farm: {key}: {error}", sys.stderr)
