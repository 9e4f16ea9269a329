"""Parameters that only ``./cell test --thorough`` plays, beside those that are played each time.

The rule is held each time by the parameters left: the code does not branch by what differs. A night
plays a half of them, and searches in a half of the files: the other half comes the night after.
"""

from __future__ import annotations

import os
import zlib
from datetime import date
from typing import Any

import pytest

SEARCH = "HYPOTHESIS_SEARCH" in os.environ
"""Whether this run searches: ``./cell test --thorough``; by night in the file's turn alone."""
TURN = "CELL_TEST_TURN"
"""Environment variable: which turn it is. Without it everything's turn is."""
TURNS = 2


def turn_of(day: date) -> int:
    """Return the turn of a night."""
    return day.toordinal() % TURNS


def comes(name: str) -> bool:
    """Return whether the turn of a file or a test, by its name, is now."""
    turn = os.environ.get(TURN)
    return turn is None or zlib.crc32(name.encode()) % TURNS == int(turn)


def searches(file: str) -> bool:
    """Return whether a file searches in this run."""
    return "HYPOTHESIS_SEARCH" in os.environ and comes(file)


def thorough(*rows: object) -> list[Any]:
    """Return rows of ``parametrize`` that are played by ``./cell test --thorough`` only.

    Args:
        rows: One value each, or a tuple of one value for each argument.
    """
    return [
        pytest.param(*(row if isinstance(row, tuple) else (row,)), marks=pytest.mark.thorough)
        for row in rows
    ]


def examples(few: int, many: int) -> int:
    """Return how many examples a property gets: ``few`` each time, ``many`` in a search."""
    return many if SEARCH else few
