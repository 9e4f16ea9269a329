"""The entries of a journal: one JSON object a line, numbered without gaps.

The keys are those of docs/interfaces.md. ``number``, ``time`` and ``cell`` are given by the
writer; whoever makes an entry leaves them out.
"""

from __future__ import annotations

from typing import Any, Protocol, TypeAlias

import msgspec
from scara_config.quantities import is_this_machine

LONGEST_TEXT = 2000  # our choice: signs; what a client sends may be of any length
MOST_ITEMS = 50  # our choice: as above
ERROR, WARNING = "error", "warning"
DONE, STOPPED, ESTOP, FAULT = "done", "stopped", "emergency stop", "fault"
LINK_LOST, TAKEN_OVER, UNFINISHED = "link lost", "taken over", "unfinished"
"""Outcomes of a cycle. Unfinished: the journal ended before it."""


class Entry(msgspec.Struct, frozen=True, kw_only=True, tag_field="kind"):
    """What all entries have.

    Attributes:
        number: 1 for the first of a cell, one more for each entry; never given twice.
        time: When it came to the journal [s], Unix time.
        cell: Its namespace without the first slash; ``cell`` for the one without a namespace.
    """

    number: int = 0
    time: float = 0.0
    cell: str = ""

    @property
    def kind(self) -> str:
        """Which kind of entry it is."""
        return str(self.__struct_config__.tag)


class Decision(Entry, frozen=True, kw_only=True, tag="decision"):
    """A transition or refusal of the twin controller: the fields of scara_msgs/Decision."""

    seq: int
    mode_before: str
    event: str
    mode_after: str
    leader: str
    actions: list[str]
    why: str
    who: str


class Audit(Entry, frozen=True, kw_only=True, tag="audit"):
    """Who commanded what, and what came of it: the fields of scara_msgs/Audit."""

    who: str
    what: str
    success: bool
    outcome: str


class Alarm(Entry, frozen=True, kw_only=True, tag="alarm"):
    """An alarm was raised, changed, or cleared.

    Attributes:
        source: Name of the status on /diagnostics, or the node that fell silent.
        level: ``warning`` or ``error``.
        active: False: it has been cleared.
        text: In words; of a cleared alarm what it said last.
        seconds: Of a cleared alarm: how long it lasted.
        raised: Of a changed or cleared alarm: when it was raised [s], Unix time.
    """

    source: str
    level: str
    active: bool
    text: str
    seconds: float = 0.0
    raised: float = 0.0


class Cycle(Entry, frozen=True, kw_only=True, tag="cycle"):
    """Something was done from a first motion to rest, or to what ended it.

    Attributes:
        start: First motion [s], Unix time.
        end: Last motion, or what ended it [s].
        program: Of the real robot; empty: none ran.
        leader: real, twin or operator.
        who: Who asked for it; empty: nobody.
        parts_placed: By the real robot where it tells of parts, else by the twin.
        parts_dropped: Same.
        worst_error_mm: Largest distance of the two tools at one instant; None: never measured.
        follower_lag_s: How late the real robot does its set points, at the cycle's end [s]; None:
            never measured, or written before it was kept.
        paused_s: How long of it the pair was paused.
        outcome: How it ended.
        why: What ended it, in words; empty if it came to its end.
    """

    start: float
    end: float
    program: str
    leader: str
    who: str
    parts_placed: int
    parts_dropped: int
    worst_error_mm: float | None
    paused_s: float
    outcome: str
    why: str
    follower_lag_s: float | None = None


class Start(Entry, frozen=True, kw_only=True, tag="start"):
    """The journal was started: what was active before is told anew if it still is.

    Attributes:
        robot: Its name.
        plant: How its stand-in behaves; empty: it is a robot elsewhere.
        pid: Of the node.
    """

    robot: str
    plant: str
    pid: int


class Gap(Entry, frozen=True, kw_only=True, tag="gap"):
    """Something is missing here; no number is.

    Attributes:
        lost: So many entries were counted and not kept.
        since: First of them [s], Unix time; 0: none was lost.
        until: Last of them [s].
        why: In words.
        removed: Files that were removed whole, because the journal was beyond its limits.
    """

    lost: int = 0
    since: float = 0.0
    until: float = 0.0
    why: str
    removed: list[str] = []


class Torn(Entry, frozen=True, kw_only=True, tag="torn"):
    """A last line that was not whole was found at the start, and kept aside.

    Attributes:
        file: In which it was.
        kept: The file, in the same folder, that holds it now.
        size: In bytes.
        text: How it begins.
    """

    file: str
    kept: str
    size: int
    text: str


class ExerciseMarked(Entry, frozen=True, kw_only=True, tag="exercise"):
    """A learner's exercise was marked.

    Attributes:
        marked: When [s], Unix time.
        learner: Whose it is.
        exercise: Name of its folder.
        title: Its number and title.
        passed: Whether it counts.
        reason: Why.
        digest: SHA-256 of what was marked.
        signature: Of the course's key; the same result again has the same.
    """

    marked: float
    learner: str
    exercise: str
    title: str
    passed: bool
    reason: str
    digest: str
    signature: str


class CourseResult(msgspec.Struct, frozen=True, kw_only=True):
    """One verdict.

    Attributes:
        number: 1 for the first of a file, one more for each.
        time: When it was marked [s], Unix time.
        learner: Whose it is.
        exercise: Name of the exercise's folder.
        title: Number and title of the exercise.
        passed: Whether it counts.
        reason: Why.
        evidence: Name of the file that was marked.
        digest: SHA-256 of that file, of a recording in parts over all of them.
        signature: HMAC-SHA256 over the rest, in hexadecimal.
    """

    number: int
    time: float
    learner: str
    exercise: str
    title: str
    passed: bool
    reason: str
    evidence: str
    digest: str
    signature: str = ""


class CourseStarted(msgspec.Struct, frozen=True):
    """The exercise that a learner has started last.

    Attributes:
        exercise: Name of its folder.
        title: Its number and title.
        exercises: How many there are.
    """

    exercise: str
    title: str
    exercises: int


AnyEntry: TypeAlias = Decision | Audit | Alarm | Cycle | Start | Gap | Torn | ExerciseMarked
KINDS = tuple(kind.__struct_config__.tag for kind in AnyEntry.__args__)
"""All kinds of entries."""


_ENCODER = msgspec.json.Encoder()
_DECODER: msgspec.json.Decoder[AnyEntry] = msgspec.json.Decoder(AnyEntry)


def encode(entry: Entry) -> bytes:
    """Return an entry as a line of the file."""
    return _ENCODER.encode(entry) + b"\n"


def decode(line: bytes) -> AnyEntry:
    """Return the entry of a line.

    Raises:
        msgspec.DecodeError: The line is not whole, or no entry of a known kind.

    Example:
        >>> line = encode(Start(number=7, time=1.5, cell="c", robot="r", plant="p", pid=1))
        >>> decode(line).number, decode(line).kind
        (7, 'start')
    """
    return _DECODER.decode(line)


def stamped(entry: Entry, number: int, cell: str) -> Entry:
    """Return an entry with its number and cell, and with texts that a line can hold.

    A text beyond ``LONGEST_TEXT`` is cut; what is no UTF-8 becomes a question mark.
    """
    changed: dict[str, Any] = {}
    for name, value in msgspec.structs.asdict(entry).items():
        if isinstance(value, str) and value != (kept := _kept(value)):
            changed[name] = kept
        elif isinstance(value, list) and value != (some := [_kept(v) for v in value[:MOST_ITEMS]]):
            changed[name] = some
    return msgspec.structs.replace(entry, number=number, cell=cell, **changed)


def _kept(text: str) -> str:
    """Return what is kept of a text."""
    if len(text) > LONGEST_TEXT:
        text = f"{text[:LONGEST_TEXT]}..."
    return text if text.isascii() else text.encode("utf-8", "replace").decode("utf-8")


class WrittenOutcome(Protocol):
    """Fields of scara_msgs/MotionOutcome that are written down."""

    what: str
    end: str
    time_predicted: float
    time_measured: float
    way_predicted: float
    way_measured: float
    drift: str


def outcome_entry(said: WrittenOutcome) -> Audit:
    """Return an entry; one without success tells that predictions drift away."""
    text = (
        f"{said.end}: {said.time_measured:.2f} s, predicted {said.time_predicted:.2f} s; "
        f"{said.way_measured:.3f} m of the tool, predicted {said.way_predicted:.3f} m"
    )
    if said.drift:
        text += f"; drift: {said.drift}"
    return Audit(
        who="what_if", what=f"predicted: {said.what}", success=not said.drift, outcome=text
    )


def start_entry(robot: str, plant: str, host: str, pid: int) -> Start:
    """Return the entry of a start; a robot that is not on this machine is no stand-in.

    Args:
        robot: Its name.
        plant: How the stand-in of this cell behaves, if it has one.
        host: Where the twin controller looks for the robot.
        pid: Of the node.
    """
    return Start(robot=robot, plant=plant if is_this_machine(host) else "", pid=pid)
