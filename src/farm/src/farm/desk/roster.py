"""Which cells are there, how each is, and which was lost when; pure: ``now`` is an argument."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass, field

import msgspec
from scara_ros.page.page_words import mode_title, mode_tone

from farm.keys import CellName
from farm.wire import CLOCKS_AGREE_S, CellState, Configuration, Health, Level, clock_words

LOST, SILENT = "lost", "silent"
"""Words for a cell that is not there, and for one that is there and says nothing."""
STATUSES = {LOST: ("Lost", "bad"), SILENT: ("Silent", "bad"), "": ("Starting", "busy")}
"""Title and tone of what is no mode of a twin controller."""
CLOCK_SAMPLES = 5
"""Our choice: of so many health messages the one that came quickest tells how the clocks differ."""


class Row(msgspec.Struct, frozen=True):
    """One cell as people see it.

    Attributes:
        name: MACHINE/CELL.
        level: How bad it is; the rows are sorted by it.
        status: lost, silent, or the cell's mode.
        since: Since when it has this status [s since 1970, the desk's clock].
        text: What is wrong, or what it does.
        state: As the cell sent it last; None: not yet.
        age_s: Of that state.
        last_event: Newest number of its journal; 0: not known, or empty.
        missing: Events that its journal no longer had when they were asked for.
        cpu_percent, memory_mb: Of its link.
        configuration: How it differs from its own files; None: not known yet.
        clock_s: How far the clock of its machine is ahead of the desk's [s], the way of a message
            included; None: not known yet.
    """

    name: str
    level: Level
    status: str
    since: float
    text: str
    state: CellState | None
    age_s: float
    last_event: int
    missing: int
    cpu_percent: float
    memory_mb: float
    configuration: Configuration | None = None
    clock_s: float | None = None

    @property
    def is_away(self) -> bool:
        """Whether nothing is known of it now."""
        return self.status in (LOST, SILENT)


@dataclass
class Entry:
    """What is known of one cell."""

    alive: bool = False
    # By the desk's clock, like all times here: clocks of cells may be wrong.
    since: float = 0.0
    joined: float = 0.0
    state: CellState | None = None
    heard: float = 0.0
    mode_since: float = 0.0
    health: Health | None = None
    # Counted for the benchmark: how many states came, and how many between two numbers did not.
    received: int = 0
    lost: int = 0
    missing: int = 0
    first: bool = True  # the next state is the first since its link is there
    ahead: deque[float] = field(default_factory=lambda: deque(maxlen=CLOCK_SAMPLES))

    @property
    def clock_s(self) -> float | None:
        """How far the cell's clock is ahead [s]; None: not known yet.

        A message that was longer on its way only makes the clock look further behind.
        """
        return max(self.ahead, default=None)

    def at(self, stamp: float) -> float:
        """Return when something was by the desk's clock [s since 1970], as far as is known."""
        return stamp - (self.clock_s or 0.0)


@dataclass
class Roster:
    """All cells that were ever seen by this desk; one thread at a time uses it."""

    silent_s: float
    entries: dict[CellName, Entry] = field(default_factory=dict)

    def alive(self, cell: CellName, now: float) -> None:
        """Take in that a cell's link is there."""
        entry = self._entry(cell)
        # Heard now: a link that has just come is not silent.
        entry.alive, entry.since, entry.heard, entry.joined = True, now, now, now
        # It may have been started anew, with a clock that was set back meanwhile.
        entry.first = True
        entry.ahead.clear()

    def gone(self, cell: CellName, now: float) -> None:
        """Take in that a cell's link has gone."""
        entry = self._entry(cell)
        entry.alive, entry.since = False, now

    def remember(self, cell: CellName, last_seen: float) -> None:
        """Take in a cell of the history that is not there: lost since it was heard last."""
        entry = self._entry(cell)
        if not entry.alive and not entry.since:
            entry.since = last_seen

    def shown(self, cell: CellName, state: CellState, now: float) -> None:
        """Take in a state; one that is older than the last is left out."""
        entry = self._entry(cell)
        last = entry.state
        if last is not None and not entry.first:
            if state.sequence <= last.sequence and state.stamp <= last.stamp:
                return
            # What was shown before the link had joined could not come. A link that was started
            # again counts from 1.
            if entry.at(last.stamp) >= entry.joined:
                entry.lost += max(0, state.sequence - last.sequence - 1)
        if last is None or last.mode != state.mode:
            entry.mode_since = now
        entry.state, entry.heard, entry.first = state, now, False
        entry.received += 1

    def told(self, cell: CellName, health: Health, now: float) -> None:
        """Take in what a link says of itself, and how its clock differs from ours."""
        entry = self._entry(cell)
        entry.health = health
        entry.ahead.append(health.stamp - now)

    def missed(self, cell: CellName, count: int) -> None:
        """Take in that so many events of a cell are gone for good, since the desk's start."""
        self._entry(cell).missing = count

    def lost(self) -> dict[str, float]:
        """Return the cells that are lost, and since when [s since 1970]."""
        return {str(name): e.since for name, e in self.entries.items() if not e.alive}

    def counted(self) -> dict[CellName, tuple[int, int]]:
        """Return how many states came, and how many did not."""
        return {name: (e.received, e.lost) for name, e in self.entries.items()}

    def rows(self, now: float) -> list[Row]:
        """Return all cells, the worst first; among equals those that became so last."""
        rows = [self._row(name, entry, now) for name, entry in self.entries.items()]
        # A lost cell stands above a bad one.
        return sorted(rows, key=lambda row: (-row.level, row.status != LOST, -row.since, row.name))

    def _entry(self, cell: CellName) -> Entry:
        return self.entries.setdefault(cell, Entry())

    def _row(self, name: CellName, entry: Entry, now: float) -> Row:
        level, status, since, text = self._judged(entry, now)
        health = entry.health
        return Row(
            name=str(name),
            level=level,
            status=status,
            since=since,
            text=text,
            state=entry.state,
            age_s=now - entry.heard if entry.state is not None else 0.0,
            last_event=health.last_event if health is not None else 0,
            missing=entry.missing,
            cpu_percent=health.cpu_percent if health is not None else 0.0,
            memory_mb=health.memory_mb if health is not None else 0.0,
            configuration=health.configuration if health is not None else None,
            clock_s=entry.clock_s,
        )

    def _judged(self, entry: Entry, now: float) -> tuple[Level, str, float, str]:
        """Return level, status, since when, and the reason."""
        state = entry.state
        if not entry.alive:
            last = "" if state is None else f"last seen: {mode_title(state.mode or SILENT)}"
            return Level.BAD, LOST, entry.since, last
        # A clock that is set back does not let what is dead look alive.
        if abs(now - entry.heard) > self.silent_s:
            return Level.BAD, SILENT, entry.heard, "its link is there and sends no state"
        if state is None:
            return Level.NOTE, "", entry.since, "no state yet"
        level, text = state.level, state.alarm or state.why
        if entry.health is not None and entry.health.journal:
            level, text = max(level, Level.WARN), f"journal: {entry.health.journal}"
        elif level < Level.WARN and (why := clock_warning(entry.clock_s)):
            level, text = Level.WARN, why
        return level, state.mode or SILENT, entry.mode_since, text


def status_title(status: str) -> str:
    """Return a status as a heading: a mode in the operator page's words.

    Example:
        >>> status_title("ESTOP"), status_title(LOST)
        ('Emergency stop', 'Lost')
    """
    return STATUSES[status][0] if status in STATUSES else mode_title(status)


def status_tone(status: str) -> str:
    """Return the CSS class of a status: that of a mode on the operator's page."""
    return STATUSES[status][1] if status in STATUSES else mode_tone(status)


def clock_warning(ahead_s: float | None) -> str:
    """Return what a cell's clock needs; empty: it agrees with the desk's, or is not known.

    Example:
        >>> clock_warning(-0.06), clock_warning(None)
        ('', '')
        >>> clock_warning(62.0)
        "its clock is 62.0 s ahead of the desk's: it may refuse all but STOP and PAUSE; use NTP"
    """
    if ahead_s is None or abs(ahead_s) < CLOCKS_AGREE_S:
        return ""
    words = clock_words(ahead_s)
    return f"its clock is {words} the desk's: it may refuse all but STOP and PAUSE; use NTP"


def differs(shown: Configuration | None) -> str:
    """Return in words how a cell's configuration differs from its own files.

    Example:
        >>> differs(Configuration(2, "slow (1a2b)", "slow (1a2b)"))
        'slow (1a2b)'
        >>> differs(Configuration(3, "slow (1a2b)", ""))
        'slow (1a2b), next start: own files'
    """
    if shown is None or (not shown.running and not shown.wanted):
        return shown.note if shown is not None else ""
    running = shown.running or "own files"
    if shown.running != shown.wanted:
        running += f", next start: {shown.wanted or 'own files'}"
    return f"{running}; {shown.note}" if shown.note else running


def not_reached(rows: Iterable[Row], asked: Iterable[CellName]) -> list[Row]:
    """Return the cells that a command for all did not reach: the desk knows them, nobody asked.

    Args:
        rows: Of the desk.
        asked: Who was there when all were asked.
    """
    names = set(map(str, asked))
    return [row for row in rows if row.name not in names]


class Alike(msgspec.Struct, frozen=True):
    """Cells whose configuration differs from their own files in the same way.

    Attributes:
        text: How; as :func:`differs` says it.
        cells: MACHINE/CELL.
    """

    text: str
    cells: list[str]


def alike(rows: Iterable[Row]) -> list[Alike]:
    """Return who has which configuration; cells with their own files come last."""
    found: dict[str, list[str]] = {}
    for row in rows:
        found.setdefault(differs(row.configuration), []).append(row.name)
    own = found.pop("", [])
    groups = [Alike(text, sorted(names)) for text, names in sorted(found.items())]
    return [*groups, *([Alike("own files", sorted(own))] if own else [])]
