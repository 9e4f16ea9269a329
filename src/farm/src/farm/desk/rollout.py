"""A roll-out of a change, step by step: one cell, wait, the rest. Pure: what to do next.

Nothing of it is stored: each step follows from what the cells show. So a roll-out that was ended
goes on where it was with the same words, and never by itself.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType

from farm.desk.roster import LOST, SILENT, Row, differs
from farm.wire import Configuration, Level


class Do(Enum):
    """What to do next."""

    OFFER = "offer"
    WAIT = "wait"
    DONE = "done"
    END = "end"


@dataclass(frozen=True)
class RolloutStep:
    """The next step.

    Attributes:
        do: What to do.
        cells: Whom to offer the change to.
        text: One line for people.
    """

    do: Do
    cells: tuple[str, ...] = ()
    text: str = ""


def next_step(
    wanted: str,
    cells: Sequence[str],
    rows: Mapping[str, Row],
    since: float | None,
    wait_s: float,
    now: float,
    asked: Mapping[str, Configuration] = MappingProxyType({}),
) -> tuple[RolloutStep, float | None]:
    """Return what to do next.

    Args:
        wanted: The change, NAME (DIGEST).
        cells: Who gets it, MACHINE/CELL, the first one first.
        rows: What the desk knows of them.
        since: When the first cell was first seen running with the change [s]; None: not yet.
        wait_s: The first cell has to be well for so long before the rest get the change [s].
        now: Time [s].
        asked: Of each cell that was asked to take the change, or had it, the configuration that
            it showed then.

    Returns:
        The step, and ``since`` for the next one.
    """
    # Before any step: a cell that is not well ends the whole.
    for cell in cells:
        if why := _trouble(wanted, cell, rows.get(cell), asked.get(cell)):
            return RolloutStep(Do.END, (), why), since
    first, rest = cells[0], tuple(cells[1:])
    shown = {cell: _shown(rows[cell]) for cell in cells}
    if shown[first].wanted != wanted:
        return RolloutStep(Do.OFFER, (first,), f"{first} first"), since
    if not _runs(shown[first], wanted):
        return RolloutStep(Do.WAIT, (), f"{first}: waits for its next start"), since
    since = now if since is None else since
    if rows[first].level is Level.BAD:
        why = f"{first} is not well with it: {rows[first].status}, {rows[first].text}"
        return RolloutStep(Do.END, (), why), since
    left = tuple(cell for cell in rest if shown[cell].wanted != wanted)
    if (left or not rest) and now - since < wait_s:
        return RolloutStep(
            Do.WAIT, (), f"{first}: runs with it, looked at for {wait_s:.0f} s"
        ), since
    # A fault of one that runs with it may come of it. Whoever starts anew is not judged.
    judged = (rows[cell] for cell in rest if cell in left[:1] or _runs(shown[cell], wanted))
    ill = next((row for row in judged if row.level is Level.BAD), None)
    if left and ill is not None:
        why = f"waits for {ill.name}, which is not well: {ill.status}, {ill.text}"
        return RolloutStep(Do.WAIT, (), why), since
    if left:
        # One at a time: where it refuses, the others are not asked.
        return RolloutStep(Do.OFFER, left[:1], f"{first} is well with it: {left[0]}"), since
    if waiting := [cell for cell in rest if not _runs(shown[cell], wanted)]:
        return RolloutStep(Do.WAIT, (), f"wait for their next start: {', '.join(waiting)}"), since
    return RolloutStep(Do.DONE, (), f"{len(cells)} cells run with it"), since


def _shown(row: Row) -> Configuration:
    return row.configuration or Configuration()


def _runs(shown: Configuration, wanted: str) -> bool:
    """Tell whether a cell runs with a change, and has got ready with it."""
    return shown.running == shown.wanted == wanted and shown.proven


def _trouble(wanted: str, cell: str, row: Row | None, before: Configuration | None) -> str:
    """Return why a roll-out has to end because of a cell; empty: it need not."""
    if row is None:
        return f"{cell} is not there"
    shown = _shown(row)
    is_starting = shown.wanted == wanted and not _runs(shown, wanted)
    # A cell that starts anew is lost for a while.
    if row.status in (LOST, SILENT) and not is_starting:
        return f"{cell} is {row.status}: {row.text}" if row.text else f"{cell} is {row.status}"
    if row.configuration is None:
        return f"{cell} says nothing of its configuration"
    if before is None or shown.wanted == wanted:
        return ""
    # Until its next health message it shows what it had when it was asked: the same number, and
    # the note of an earlier try. With another robot it has another note and no other number.
    if (shown.number, shown.note) != (before.number, before.note):
        return f"{cell} went back: {differs(shown) or 'own files'}"
    return ""
