"""The link of one cell on the bus: it shows, tells and answers; it knows no ROS.

Two threads of its own: ``state`` sends the newest state and joints, ``journal`` sends events and
health. Each question has a thread of its own, so that a STOP waits for no other.
"""

from __future__ import annotations

import contextlib
import os
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any

import msgspec
import zenoh

from farm import keys
from farm.config import LinkConfig
from farm.link.changes_io import CellChanges
from farm.link.commands import CommandRules, judge
from farm.link.journal_io import Journal, JournalReadError
from farm.link.newest_io import Newest
from farm.link.recordings_io import RecordingError, RecordingFiles
from farm.link.rights import CONFIGURING
from farm.wire import (
    Answer,
    CellState,
    Command,
    Configuration,
    Health,
    Joints,
    PieceAsked,
    WireError,
    decode,
    encode,
)

EVENTS_PERIOD_S = 0.2
"""Our choice: so often the journal is looked at."""
IDLE_S = 1.0
"""Our choice: so often a thread that has nothing to send looks whether it ends."""
PACE = 8e6
"""Our choice: recordings leave the cell at this rate [bytes/s], so that a fetch is no load."""
LONGEST_COMMAND = 65_536
"""Our choice: a change of 200 values takes less [bytes]."""
Forward = Callable[[Command], Answer]
"""Hands a command on to the cell and returns its answer within the link's time; never raises."""


class CellLink:
    """Shows one cell to the farm; a context manager."""

    def __init__(
        self,
        session: zenoh.Session,
        cell: keys.CellName,
        settings: LinkConfig,
        journal: Journal,
        forward: Forward,
        watched: Callable[[bool], None] = lambda _: None,
        recordings: RecordingFiles | None = None,
        changes: CellChanges | None = None,
        clock: Callable[[], float] = time.time,
    ) -> None:
        """Declare everything and begin.

        Args:
            session: An open session; the link leaves it open.
            cell: Its name.
            settings: Section link of farm.yaml: rights, rate of health, events of an answer.
            journal: Where events come from.
            forward: Hands a command on.
            watched: Is told when somebody begins or ceases to look at the joints.
            recordings: What the farm may fetch; None: nothing.
            changes: Of the cell's configuration; None: it takes none.
            clock: This machine's time [s since 1970].
        """
        self._clock = clock
        self._recordings, self._changes = recordings, changes
        self._cell, self._settings, self._journal, self._forward = cell, settings, journal, forward
        # The bus may be slow, or gone: a state that was overtaken is of no use to anybody.
        self._newest: Newest[bytes] = Newest()
        self._lock = threading.Lock()
        # Ids of commands with their expiry: a command counts once, however often it comes.
        self._seen: Mapping[str, float] = {}
        # As last shown: a command is judged by what its sender could see.
        self._remote, self._revision = False, 0
        self._ended = threading.Event()
        self._began = time.monotonic()
        drop = zenoh.CongestionControl.DROP
        # Declared, because a router seeks the way of each other message anew among all keys. While
        # a session is connected anew a message may come under another of the cell's keys: the desk
        # refuses what does not fit its key.
        self._publishers = {
            what: session.declare_publisher(cell.key(what), congestion_control=drop)
            for what in (keys.STATE, keys.JOINTS, keys.HEALTH, keys.EVENT)
        }
        self._matching = self._publishers[keys.JOINTS].declare_matching_listener(
            lambda status: watched(status.matching)
        )
        self._queryables = [
            session.declare_queryable(cell.key(what), _in_thread(answer))
            for what, answer in (
                (keys.COMMAND, self._answer),
                (keys.EVENTS, self._events),
                (keys.RECORDINGS, self._list_recordings),
                (keys.PIECE, self._piece),
            )
        ]
        # Last: whoever sees the token may ask at once, and shall be answered.
        self._token = session.liveliness().declare_token(cell.key(keys.ALIVE))
        self._threads = [
            threading.Thread(target=self._send, name="state", daemon=True),
            threading.Thread(target=self._tell, name="journal", daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    def __enter__(self) -> CellLink:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def show(self, state: CellState) -> None:
        """Send a state as soon as the bus takes it, unless a newer one comes first; never waits."""
        # Before it is sent: a command that is based on it may come at once.
        self._remote, self._revision = state.remote, state.revision
        self._newest.put(keys.STATE, encode(state))

    def show_joints(self, joints: Joints) -> None:
        """Send joint positions, as :meth:`show`."""
        self._newest.put(keys.JOINTS, encode(joints))

    def switch(self, remote: bool) -> None:
        """Take over what the local switch says, at once."""
        self._remote = remote

    def close(self) -> None:
        """Leave the bus."""
        self._ended.set()
        self._newest.close()
        for thread in self._threads:
            thread.join(IDLE_S)
        # Without a connection these raise, and are gone anyway.
        everything: list[Any] = [self._token, *self._queryables, self._matching]
        for declared in [*everything, *self._publishers.values()]:
            with contextlib.suppress(zenoh.ZError):
                declared.undeclare()

    def _send(self) -> None:
        while not self._ended.is_set():
            for what, data in self._newest.take(IDLE_S).items():
                self._put(what, data)

    def _put(self, what: str, data: bytes) -> None:
        """Send a message if the bus takes it: a view may be lost, an event has its number."""
        with contextlib.suppress(zenoh.ZError):
            self._publishers[what].put(data)

    def _tell(self) -> None:
        """Send events as they come, and health at its rate.

        What is lost here the desk asks for by number.
        """
        told, fault, due = -1, "", 0.0
        cpu, at = time.process_time(), time.monotonic()
        while not self._ended.is_set():
            try:
                now, used = time.monotonic(), time.process_time()
                # First: a journal that cannot be read keeps no health back, which says so.
                if now >= due:
                    percent = 100.0 * (used - cpu) / max(now - at, 1e-3)
                    cpu, at, due = used, now, now + 1.0 / self._settings.health_rate_hz
                    self._tell_health(percent, fault)
                    fault = ""
                told = self._tell_events(told)
            # Of any kind: a thread that dies would be missed by nobody.
            except Exception as error:
                fault = str(error)
            self._ended.wait(EVENTS_PERIOD_S)

    def _tell_events(self, told: int) -> int:
        """Send the events after ``told``, those since the link's start; return the last number."""
        if told < 0:
            return self._journal.bounds().last
        news = self._journal.read(told, self._settings.events_limit)
        if news.last < told:  # somebody has begun the journal anew
            return news.last
        for event in news.events:
            self._put(keys.EVENT, encode(event))
        return news.events[-1].number if news.events else told

    def _tell_health(self, cpu_percent: float, fault: str) -> None:
        bounds = (0, 0)
        try:
            bounds = self._journal.bounds()
        except JournalReadError as error:
            fault = str(error)
        with open("/proc/self/statm", encoding="ascii") as stream:
            pages = int(stream.read().split()[1])  # of this process, in use
        health = Health(
            stamp=self._clock(),
            uptime_s=round(time.monotonic() - self._began, 1),
            cpu_percent=round(cpu_percent, 2),
            memory_mb=round(pages * os.sysconf("SC_PAGE_SIZE") / 1e6, 1),
            first_event=bounds[0],
            last_event=bounds[1],
            dropped=self._newest.replaced,
            journal=fault,
            configuration=self._changes.shown() if self._changes else Configuration(),
        )
        self._put(keys.HEALTH, encode(health))

    def _answer(self, query: zenoh.Query) -> None:
        """Judge a command, hand it on, and say what came of it."""
        with query:
            self._reply(query, keys.COMMAND, self._judged(_payload(query)))

    def _judged(self, data: bytes) -> Answer:
        try:
            if len(data) > LONGEST_COMMAND:
                raise WireError(f"{len(data)} bytes: allowed are {LONGEST_COMMAND}")
            command = decode(data, Command)
        except WireError as error:
            return Answer(False, f"this is no command: {error}")
        changes = self._changes if command.command in CONFIGURING else None
        # Read before: a STOP takes the lock too, and must not wait for a disk that hangs.
        revision = changes.number if changes is not None else self._revision
        # Judging reads the ids and adds to them: of two equal questions one has to be the second.
        with self._lock:
            guard = CommandRules(self._settings.rights, self._remote, revision, self._seen)
            why, self._seen = judge(command, guard, self._clock())
        if why:
            return Answer(False, why)
        if changes is not None:
            return changes.obey(command)
        if command.command in CONFIGURING:
            return Answer(False, f"{command.command}: this cell takes no changes")
        return self._forward(command)

    def _events(self, query: zenoh.Query) -> None:
        """Answer ``events?since=N&limit=M``."""
        with query:
            try:
                since, limit = _asked(query.parameters, self._settings.events_limit)
                self._reply(query, keys.EVENTS, self._journal.read(since, limit))
            except (ValueError, JournalReadError) as error:
                with contextlib.suppress(zenoh.ZError):
                    query.reply_err(str(error).encode())

    def _list_recordings(self, query: zenoh.Query) -> None:
        with query, contextlib.suppress(zenoh.ZError):
            listed = self._recordings.listed() if self._recordings is not None else []
            query.reply(self._cell.key(keys.RECORDINGS), msgspec.json.encode(listed))

    def _piece(self, query: zenoh.Query) -> None:
        """Answer with a piece of a recording, at a pace that leaves the cell its processor."""
        with query, contextlib.suppress(zenoh.ZError):
            try:
                if self._recordings is None:
                    raise RecordingError("this cell gives no recordings")
                piece = self._recordings.piece(decode(_payload(query), PieceAsked))
            except (RecordingError, WireError) as error:
                query.reply_err(str(error).encode())
                return
            self._ended.wait(len(piece) / PACE)
            query.reply(self._cell.key(keys.PIECE), piece)

    def _reply(self, query: zenoh.Query, what: str, message: msgspec.Struct) -> None:
        with contextlib.suppress(zenoh.ZError):  # who asked has gone
            query.reply(self._cell.key(what), encode(message))


def _in_thread(answer: Callable[[zenoh.Query], None]) -> zenoh.handlers.Callback[zenoh.Query]:
    """Return a handler that answers each query in a thread of its own.

    zenoh would keep a thread for each handler, asked or not: four more for each of 1,000 cells.
    """

    def begin(query: zenoh.Query) -> None:
        threading.Thread(target=answer, args=(query,), name="answer", daemon=True).start()

    return zenoh.handlers.Callback(begin, indirect=False)


def _payload(query: zenoh.Query) -> bytes:
    return bytes(query.payload) if query.payload is not None else b""


def _asked(parameters: zenoh.Parameters, most: int) -> tuple[int, int]:
    """Return since and limit of a question.

    Raises:
        ValueError: One is no number, or out of range.
    """
    found = []
    for name, default, low in (("since", 0, 0), ("limit", most, 1)):
        text = parameters.get(name)
        if text is None:
            found.append(default)
        elif not text.isdigit() or int(text) < low:
            raise ValueError(f"{name} = {text[:40]}: allowed is a whole number from {low} on")
        else:
            found.append(int(text))
    return found[0], min(found[1], most)
