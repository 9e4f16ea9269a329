"""What travels on the bus, as JSON: each message is one of these.

Times are in [s] since 1970, by the clock of the machine that sends.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Annotated, Any, TypeVar

import msgspec
from scara_config.rollout.change import Change

T = TypeVar("T")
CLOCKS_AGREE_S = 0.5
"""Our choice: clocks that NTP keeps differ by less, also over a bad line. From here on the desk
warns, and a cell may refuse all commands but STOP and PAUSE."""


class WireError(ValueError):
    """Bytes that are no such message; the text says what is wrong with them."""


class Level(IntEnum):
    """How a cell is; the cell judges it, the desk only sorts by it."""

    GOOD = 0
    NOTE = 1
    WARN = 2
    BAD = 3


class CellState(msgspec.Struct, frozen=True):
    """The pair as it is shown; a view that may be dropped on the way.

    Attributes:
        sequence: Counts the states that the link has sent.
        stamp: When it was true.
        revision: Changes with what a command could be based on: mode, leader, reason, holder.
        level: How the cell is.
        mode: The twin controller's mode; empty: it is silent.
        leader: real, twin, operator or empty.
        why: The reason of the mode, or what is wrong.
        alarm: Active alarm, with what to do; or empty.
        holder: Who holds control, or empty.
        speed_percent: Applied program speed of the pair, after all limits; None: not known.
        deviation_mm: Between both tools at the same instant; None: not known.
        remote: Whether the local switch lets the farm move this cell.
    """

    sequence: int
    stamp: float
    revision: int
    level: Level
    mode: str
    leader: str = ""
    why: str = ""
    alarm: str = ""
    holder: str = ""
    speed_percent: float | None = 0.0
    deviation_mm: float | None = None
    remote: bool = False


class Joints(msgspec.Struct, frozen=True):
    """Both robots' joint positions [rad] or [m]; sent only while somebody subscribes.

    Those of a side that is silent are empty.
    """

    stamp: float
    real: dict[str, float]
    twin: dict[str, float]


class Configuration(msgspec.Struct, frozen=True):
    """How a cell's configuration differs from its own files, by changes that were rolled out.

    Attributes:
        number: Counts what was decided; a command that is based on another is refused.
        running: The change that the cell runs with, NAME (DIGEST); empty: none.
        wanted: That of its next start.
        before: What taking back leads to.
        proven: Whether the cell has got ready with the wanted one.
        note: Why the cell has left a change by itself, or what cannot be read; or empty.
    """

    number: int = 0
    running: str = ""
    wanted: str = ""
    before: str = ""
    proven: bool = True
    note: str = ""


class Health(msgspec.Struct, frozen=True):
    """The link itself, and how far its journal has come.

    Attributes:
        stamp: When it was true.
        uptime_s: Of the link.
        cpu_percent: Of one core, since the last message.
        memory_mb: Resident memory of the link's process.
        first_event: Oldest number that the journal still has; 0: it is empty.
        last_event: Newest number; 0: it is empty.
        dropped: States that a newer one replaced before they could be sent.
        journal: Why the journal cannot be read, or empty.
        configuration: How the cell differs from its own files.
    """

    stamp: float
    uptime_s: float
    cpu_percent: float
    memory_mb: float
    first_event: int
    last_event: int
    dropped: int
    journal: str = ""
    configuration: Configuration = Configuration()


class Event(msgspec.Struct, frozen=True):
    """One line of a cell's journal.

    Attributes:
        number: Grows by 1 from line to line, over restarts too.
        time: When it happened.
        kind: decision, audit, alarm, cycle, start, gap or torn.
        stop: Whether it stopped the pair.
        text: The event in one line, for people.
        body: The whole line.
    """

    number: Annotated[int, msgspec.Meta(ge=0, le=2**63 - 1)]
    # Until the year 9999: no calendar, and no column of the history, goes on from there.
    time: Annotated[float, msgspec.Meta(ge=0.0, lt=253402300800.0)]
    kind: str
    stop: bool = False
    text: str = ""
    body: dict[str, Any] = {}


class Events(msgspec.Struct, frozen=True):
    """Answer to ``events?since=N&limit=M``: the events after N, at most M of them.

    Attributes:
        first: Oldest number that the journal still has; 0: it is empty.
        last: Newest number; 0: it is empty.
        events: In the order of their numbers.
    """

    first: int
    last: int
    events: tuple[Event, ...] = ()


class Recording(msgspec.Struct, frozen=True):
    """A recording of a cell.

    Attributes:
        name: Below the cell's runs folder.
        size: In bytes.
        modified: When it was changed last [ns since 1970]; with the size, which state of it.
    """

    name: str
    size: int
    modified: int


class PieceAsked(msgspec.Struct, frozen=True):
    """A question for the piece of a recording from an offset on; size and time as listed."""

    name: str
    size: int
    modified: int
    offset: Annotated[int, msgspec.Meta(ge=0)]


class Command(msgspec.Struct, frozen=True):
    """A question to a cell: will you? It is answered now or not at all.

    Attributes:
        id: Unlike all others; a cell takes each only once.
        command: STOP, PAUSE or another of twin_controller/command.
        person: Who asks.
        desk: From which machine.
        expires: Not taken after this time; STOP and PAUSE are taken at any time.
        revision: Of the state that it was based on; None: of none.
        speed_percent: SPEED: the cap; HOME: program speed, 0: default.
        change: EXAMINE, CONFIGURE, TAKE_BACK: which.
        asked: When it was asked; None: not told, as older desks do.
    """

    id: str
    command: str
    person: str
    desk: str
    expires: float
    revision: int | None = None
    speed_percent: float = 0.0
    change: Change | None = None
    asked: float | None = None


class Answer(msgspec.Struct, frozen=True):
    """What a cell says to a command."""

    accepted: bool
    text: str


def clock_words(ahead_s: float) -> str:
    """Return how one clock differs from another that is named behind it.

    Example:
        >>> clock_words(62.04), clock_words(-0.7)
        ('62.0 s ahead of', '0.7 s behind')
    """
    return f"{abs(ahead_s):.1f} s {'ahead of' if ahead_s > 0.0 else 'behind'}"


def encode(message: msgspec.Struct) -> bytes:
    """Return a message as JSON."""
    return msgspec.json.encode(message)


def decode(data: bytes, kind: type[T]) -> T:
    """Read a message.

    Raises:
        WireError: The bytes are no such message.
    """
    try:
        return msgspec.json.decode(data, type=kind)
    # Bytes in a text that are no UTF-8, or brackets without end, are none of msgspec's errors.
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise WireError(f"{kind.__name__}: {error}") from error
