"""The keys of the bus: ``SITE/MACHINE/CELL/WHAT``."""

from __future__ import annotations

import re
from typing import NamedTuple

NAME = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,62}\Z"
"""What a part of a key may be: no sign that means something in a key expression."""

ALIVE, STATE, JOINTS, HEALTH, EVENT = "alive", "state", "joints", "health", "event"
"""What a cell sends: a token, and four kinds of messages."""
EVENTS, COMMAND, RECORDINGS, PIECE = "events", "command", "recordings", "piece"
"""What a cell answers: its journal by number, commands, its recordings, and pieces of one."""
ROSTER = "desk/roster"
ALARMS, MARK = "desk/alarms", "desk/mark"
"""What the desk answers: who is there, worst first; all alarms; what a person does to one."""


class CellNameError(ValueError):
    """A name that no key can hold; the text says which and what is allowed."""


class CellName(NamedTuple):
    """Which cell: site, machine and the cell's own name."""

    site: str
    machine: str
    cell: str

    def key(self, what: str) -> str:
        """Return the key of something that belongs to this cell.

        Example:
            >>> CellName("hall", "pc_2", "milk").key(STATE)
            'hall/pc_2/milk/state'
        """
        return f"{self.site}/{self.machine}/{self.cell}/{what}"

    def __str__(self) -> str:
        """Return the name as people write it; the site is the same for all of a desk."""
        return f"{self.machine}/{self.cell}"


def checked(site: str, machine: str, cell: str) -> CellName:
    """Return the name of a cell whose parts can stand in a key.

    Raises:
        CellNameError: One cannot.
    """
    for part, text in (("site", site), ("machine", machine), ("cell", cell)):
        if not re.fullmatch(NAME, text):
            raise CellNameError(
                f"{part} = {text!r}: allowed are at most 63 letters, digits, dots, dashes and "
                "underlines, a letter or digit first"
            )
    return CellName(site, machine, cell)


def as_name(text: str) -> str:
    """Return a text with everything replaced that a key cannot hold.

    Example:
        >>> as_name("/hall/cell_2"), as_name("Ann B.")
        ('hall_cell_2', 'Ann_B')
    """
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", text).strip("_.-")[:63]


def every(site: str, what: str) -> str:
    """Return the key expression of one thing of all cells.

    Example:
        >>> every("hall", STATE)
        'hall/*/*/state'
    """
    return f"{site}/*/*/{what}"


def owner(key: str) -> CellName:
    """Return the cell that a key belongs to.

    Raises:
        CellNameError: It is no key of a cell, or a key expression that means several.

    Example:
        >>> str(owner("hall/pc_2/milk/state"))
        'pc_2/milk'
    """
    parts = key.split("/")
    if len(parts) != 4:
        raise CellNameError(f"{key}: is no key of a cell, SITE/MACHINE/CELL/WHAT")
    return checked(*parts[:3])


class ChoiceError(ValueError):
    """A word that means no cell, or several; the text lists what there is."""


def choose(word: str, there: list[CellName]) -> list[CellName]:
    """Return the cells that a person means.

    Args:
        word: ``all``, a cell's name, or ``MACHINE/CELL`` where several machines have one.
        there: All cells.

    Raises:
        ChoiceError: None is there, or the word fits none or several.
    """
    if not there:
        raise ChoiceError("no cell is there")
    if word == "all":
        return sorted(there)
    found = [name for name in there if word in (name.cell, str(name))]
    if len(found) == 1:
        return found
    listed = ", ".join(sorted(map(str, found or there)))
    why = "means several" if found else "is not there"
    raise ChoiceError(f"{word}: {why}: {listed}")
