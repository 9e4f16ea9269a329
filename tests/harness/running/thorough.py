"""Parameters that only ``./cell test --thorough`` plays, beside those that are played each time.

The rule is held each time by the parameters left: the code does not branch by what differs.
"""

from __future__ import annotations

import os
from typing import Any

import pytest

SEARCH = "HYPOTHESIS_SEARCH" in os.environ
"""Whether this run searches: ``./cell test --thorough``."""


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
