"""Play a scene again where the machine stood still, and count that.

A scene is one test that runs in real time, with sockets and processes. What was repeated is printed
at the end of the run, and too much of it fails the run.
"""

from __future__ import annotations

import fcntl
import json
from collections.abc import Callable
from pathlib import Path
from typing import Protocol, TypeVar

from harness.running.standstill import MACHINE

T = TypeVar("T")

ATTEMPTS = 3
BUDGET = 0.02
"""The part of a run's scenes that may be repeats."""
FREE = 1
"""So many repeats are allowed in a run that has only a few scenes."""
WORDS = 160
WAITED = ("TimeoutError", "TimeoutExpired")
"""Names of what is raised by who waits in vain beside an AssertionError: Playwright, a web socket,
a process."""


class Looks(Protocol):
    """Who knows when the machine stood still."""

    def now(self) -> float:
        """Return the time of the beginning of a scene [s]."""

    def stood_still(self, since: float) -> float:
        """Return for how long the machine stood still since then, 0 if it did not [s]."""


class Notes:
    """What this process has to tell at the end of a run and has not been collected yet."""

    def __init__(self) -> None:
        """Begin without a note."""
        self._notes: list[str] = []

    def add(self, reason: str) -> None:
        """Note one thing, such as a repeat."""
        self._notes.append(reason)

    def take(self) -> list[str]:
        """Return the notes since the last call."""
        taken, self._notes = self._notes, []
        return taken


NOTES = Notes()
"""The repeats of this process; plugin.py collects them after each test."""


def excuse(begun: float, looks: Looks = MACHINE) -> str:
    """Say for how long the machine stood still since ``begun``.

    Empty if it did not, then nothing may be repeated.
    """
    gap = looks.stood_still(begun)
    return f"the machine stood still for {gap * 1e3:.0f} ms" if gap > 0.0 else ""


def played(
    scene: Callable[[], T],
    looks: Looks = MACHINE,
    notes: Notes = NOTES,
    may_repeat: Callable[[], bool] = lambda: True,
) -> T:
    """Play a scene, and again where it failed while the machine stood still.

    It is played ``ATTEMPTS`` times at most, with what it has repeated within itself.

    Args:
        scene: Raises an AssertionError, or one of ``WAITED``, if it does not end as described.
        looks: Who knows when the machine stood still.
        notes: Where a repeat is noted.
        may_repeat: Asked after a failure; what must hold besides.

    Raises:
        AssertionError: The scene failed for good.
    """
    for attempt in range(1, ATTEMPTS + 1):
        begun = looks.now()
        try:
            return scene()
        except Exception as error:
            if not isinstance(error, AssertionError) and type(error).__name__ not in WAITED:
                raise
            why = excuse(begun, looks)
            if attempt == ATTEMPTS or is_played_out(error) or not why or not may_repeat():
                played_out(error)
                raise
            notes.add(f"{why}; {first_words(error)}")
    raise AssertionError("no attempt was made")


def played_out(error: BaseException) -> None:
    """Mark an error that nobody may excuse any more: what raised it has had its repeats."""
    error.played_out = True  # type: ignore[attr-defined]


def is_played_out(error: BaseException) -> bool:
    """Return whether an error is marked so."""
    return getattr(error, "played_out", False)


def first_words(error: BaseException) -> str:
    """Return the beginning of an error's text on one line."""
    return " ".join(str(error).split())[:WORDS] or repr(error)


def counted_on(
    repeated: list[str], scenes: int, kept: Path, parts: int = 1
) -> tuple[list[str], int, bool]:
    """Add to what the parts of one run have counted that ended before this one; keep the sum.

    Args:
        repeated: What this part repeated.
        scenes: How many scenes this part had.
        kept: File that the parts of a run share; it need not be there yet.
        parts: So many parts a run has.

    Returns:
        What was repeated, how many scenes there were up to here, and whether this part was the
        last one: the budget is that of the whole run, so only the last one can judge it.
    """
    with kept.open("a+", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)  # two parts may end at once
        file.seek(0)
        before = json.loads(file.read() or "{}")
        repeated = [*before.get("repeated", []), *repeated]
        scenes += before.get("scenes", 0)
        ended = before.get("ended", 0) + 1
        file.truncate(0)
        file.write(json.dumps({"repeated": repeated, "scenes": scenes, "ended": ended}))
    return repeated, scenes, ended >= parts


def allowed(scenes: int) -> int:
    """Return how many repeats a run of so many scenes may have."""
    return max(FREE, int(BUDGET * scenes))


def too_many(repeats: int, scenes: int) -> bool:
    """Return whether a run has used up its budget."""
    return repeats > allowed(scenes)


def summary(repeats: list[str], scenes: int, judges: bool = True) -> list[str]:
    """Return the lines at the end of a run: how many scenes were repeated, each with its reason.

    A part that does not judge says only what was counted up to here.
    """
    limit = f"allowed are {allowed(scenes)}" if judges else "judged at the end of the last part"
    lines = [f"{len(repeats)} repeats in {scenes} scenes, {limit}"]
    lines += [f"  {line}" for line in repeats]
    if judges and too_many(len(repeats), scenes):
        lines.append("FAILED: too many scenes were repeated; this machine is too late to judge by")
    return lines
