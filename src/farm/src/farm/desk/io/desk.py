"""The desk on the bus: it watches all cells of a site and keeps their events."""

from __future__ import annotations

import contextlib
import sys
import threading
import time
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import msgspec
import zenoh

from farm import keys
from farm.config import FarmConfig
from farm.desk.intake import Progress, Taken, take_answer, take_health, take_live
from farm.desk.io.history import History, HistoryError, Kept
from farm.desk.roster import Counted, Roster, Row
from farm.keys import CellName
from farm.wire import CellState, Event, Events, Health, WireError, decode

ASKING = 8
"""Our choice: so many journals are read at once."""
ANSWER_S = 5.0
"""Our choice: a cell that is busy reads 500 events in well under a second."""
MOST_UNWRITTEN = 20_000
"""Our choice: events that wait for the disk; 20 MB. Journals are asked no further then."""
AGAIN_S = 5.0
"""Our choice: so long after the disk took nothing it is tried again."""


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
        self._progress: dict[CellName, Progress] = {}
        self._asking: set[CellName] = set()
        self._queue: list[Kept] = []
        self._ages: list[float] | None = None
        self._names: dict[str, CellName] = {}
        self._trouble, self._set_aside = "", False
        self._bad = 0
        self._ended = threading.Event()
        self.recent: deque[tuple[CellName, Event]] = deque(maxlen=config.desk.recent_events)
        self._begin_where_history_ends()
        self._written = dict(self._progress)
        self._pool = ThreadPoolExecutor(ASKING, "asking")
        self._writer = threading.Thread(target=self._write, name="writer", daemon=True)
        self._writer.start()
        site = config.site
        self._declared: list[Any] = [
            session.declare_subscriber(keys.every(site, keys.STATE), self._on_state),
            session.declare_subscriber(keys.every(site, keys.EVENT), self._on_event),
            session.declare_subscriber(keys.every(site, keys.HEALTH), self._on_health),
            session.liveliness().declare_subscriber(
                keys.every(site, keys.ALIVE), self._on_alive, history=True
            ),
            session.declare_queryable(f"{site}/{keys.ROSTER}", self._on_roster),
        ]

    def __enter__(self) -> Desk:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

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

    def counted(self) -> dict[CellName, Counted]:
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
        self._ended.set()
        self._pool.shutdown(wait=True, cancel_futures=True)
        self._writer.join()

    def _begin_where_history_ends(self) -> None:
        for cell, last in self._history.last().items():
            if cell.site == self._config.site:
                self._progress[cell] = Progress(last.era, last.number)
                self._roster.remember(cell, last.time)

    def _name(self, sample: zenoh.Sample) -> CellName:
        key = str(sample.key_expr)
        name = self._names.get(key)
        if name is None:
            name = self._names[key] = keys.owner(key)
        return name

    def _on_state(self, sample: zenoh.Sample) -> None:
        now = time.time()
        try:
            state = decode(bytes(sample.payload), CellState)
        except WireError as error:
            self._unreadable(sample, error)
            return
        if self._ages is not None:
            self._ages.append(now - state.stamp)
        with self._lock:
            self._roster.shown(self._name(sample), state, now)

    def _on_health(self, sample: zenoh.Sample) -> None:
        try:
            health = decode(bytes(sample.payload), Health)
        except WireError as error:
            self._unreadable(sample, error)
            return
        cell = self._name(sample)
        with self._lock:
            self._roster.told(cell, health)
            behind = take_health(self._of(cell), health.last_event)
        if behind:
            self._ask(cell)

    def _on_alive(self, sample: zenoh.Sample) -> None:
        cell, now = self._name(sample), time.time()
        there = sample.kind == zenoh.SampleKind.PUT
        with self._lock:
            (self._roster.alive if there else self._roster.gone)(cell, now)
        if there:
            self._ask(cell)

    def _on_event(self, sample: zenoh.Sample) -> None:
        try:
            event = decode(bytes(sample.payload), Event)
        except WireError as error:
            self._unreadable(sample, error)
            return
        cell = self._name(sample)
        with self._lock:
            more = self._take(cell, take_live(self._of(cell), event))
        if more:
            self._ask(cell)

    def _on_roster(self, query: zenoh.Query) -> None:
        with query, contextlib.suppress(zenoh.ZError):
            query.reply(f"{self._config.site}/{keys.ROSTER}", msgspec.json.encode(self.rows()))

    def _of(self, cell: CellName) -> Progress:
        return self._progress.get(cell, Progress())

    def _take(self, cell: CellName, taken: Taken) -> bool:
        """Keep what came; return whether to ask for more. The caller holds the lock."""
        before = self._of(cell)
        self._progress[cell] = taken.progress
        self._roster.missed(cell, taken.progress.missing - before.missing)
        for event in taken.events:
            self._queue.append(Kept(cell, taken.progress.era, event))
            self.recent.append((cell, event))
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
                    asked = self._of(cell).last
                answer = self._answer(cell, asked)
                if answer is None:
                    return
                with self._lock:
                    more = self._take(cell, take_answer(self._of(cell), asked, answer))
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
                self._unreadable(reply.ok, error)
        return None

    def _write(self) -> None:
        """Write what has come, in files of a flush each, until the desk ends and all is written."""
        period = self._config.desk.flush_ms * 1e-3
        last = False
        while not last:
            last = self._ended.wait(period)
            try:
                self._flush()
            except HistoryError as error:
                self._set_back(str(error))
                self._ended.wait(AGAIN_S)
                self._set_aside = False

    def _flush(self) -> None:
        with self._lock:
            batch, self._queue = self._queue, []
            reached = dict(self._progress)
        self._history.write(batch)
        self._written = reached
        if not batch:
            return
        self._history.join()
        if self._trouble:
            print("farm: the history is written again", flush=True)
            self._trouble = ""

    def _set_back(self, why: str) -> None:
        """Forget what could not be written: the cells' journals have it, and are asked later."""
        print(f"farm: the history cannot be written: {why}", file=sys.stderr, flush=True)
        with self._lock:
            self._trouble, self._set_aside = why, True
            self._queue = []
            self._progress = dict(self._written)

    def _unreadable(self, sample: zenoh.Sample, error: WireError) -> None:
        """Count a message that is none of ours, and say so the first time."""
        self._bad += 1
        if self._bad == 1:
            print(f"farm: {sample.key_expr}: {error}", file=sys.stderr, flush=True)
