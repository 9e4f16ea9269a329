"""How a journal is, and how that is judged."""

from __future__ import annotations

from dataclasses import dataclass

from scara_ros.diagnosis import Diagnosis, Level


@dataclass(frozen=True)
class JournalStatus:
    """How the journal is.

    Args:
        number: Of the newest entry that was written.
        waiting: Entries that the disk has not taken yet.
        lost: Entries that were counted and not kept, since the start.
        problem: Why nothing is written, and what to do; empty: all is well.
        file: That is written to; empty: none is open.
        held_mb: Size of all files [MB].
        slowest_sync_ms: The disk took so long at most to say that entries are safe.
    """

    number: int = 0
    waiting: int = 0
    lost: int = 0
    problem: str = ""
    file: str = ""
    held_mb: float = 0.0
    slowest_sync_ms: float = 0.0


def diagnose(status: JournalStatus, alarms: int, name: str) -> Diagnosis:
    """Judge the journal of the node ``name``, which knows of so many active alarms.

    Nothing is written: ERROR. What was lost before is told by the journal itself, in a gap.
    """
    if status.problem:
        level = Level.ERROR
        lost = f", {status.lost} {_ending(status.lost, 'is', 'are')} lost" if status.lost else ""
        wait = f"{counted(status.waiting)} {_ending(status.waiting, 'waits', 'wait')}"
        message = f"not written: {status.problem}; {wait}{lost}"
    else:
        level, message = Level.OK, counted(status.number)
    values = {
        "number": status.number,
        "waiting": status.waiting,
        "lost": status.lost,
        "file": status.file,
        "held_mb": f"{status.held_mb:.1f}",
        "slowest_sync_ms": f"{status.slowest_sync_ms:.1f}",
        "active_alarms": alarms,
    }
    return Diagnosis(level, name, message, values)


def lost_at_close(status: JournalStatus) -> str:
    """Return what was lost when a journal was closed, and why; empty: nothing.

    Example:
        >>> lost_at_close(JournalStatus(waiting=1, problem="the disk is full"))
        '1 entry is lost: the disk is full'
    """
    if not status.waiting:
        return ""
    verb = _ending(status.waiting, "is", "are")
    return f"{counted(status.waiting)} {verb} lost: {status.problem}"


def counted(number: int) -> str:
    """Return a number of entries in words.

    Example:
        >>> counted(1), counted(2)
        ('1 entry', '2 entries')
    """
    return f"{number} {_ending(number, 'entry', 'entries')}"


def _ending(number: int, one: str, more: str) -> str:
    return one if number == 1 else more
