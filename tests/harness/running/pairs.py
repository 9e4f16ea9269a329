"""Products of factors by pairs: each two values of two factors meet at least once.

For tests that are dear to play, where no line of code asks for three factors at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, product
from typing import Any

import pytest


def pairs(*factors: Sequence[Any]) -> list[tuple[Any, ...]]:
    """Return rows of one value each, so that each two values of two factors meet.

    The rows stand in the order of the full product, of which they are a part. Each next row is the
    one in which most pairs meet for the first time.

    Args:
        factors: The values of each; at least two factors.
    """
    rows = list(product(*(range(len(values)) for values in factors)))
    places = list(combinations(range(len(factors)), 2))
    met: dict[tuple[int, ...], set[tuple[int, ...]]] = {
        row: {(a, b, row[a], row[b]) for a, b in places} for row in rows
    }
    left = set().union(*met.values())
    taken = []
    while left:
        best = max(rows, key=lambda row: len(met[row] & left))
        taken.append(best)
        left -= met[best]
    return [
        tuple(values[k] for values, k in zip(factors, row, strict=True)) for row in sorted(taken)
    ]


def by_pairs(*factors: Sequence[Any]) -> list[Any]:
    """Return the rows of ``parametrize`` for the full product of factors.

    Those of :func:`pairs` are played each time, the others by ``./cell test --thorough`` only.
    """
    each_time = set(pairs(*factors))
    return [
        pytest.param(*row, marks=() if row in each_time else pytest.mark.thorough)
        for row in product(*factors)
    ]
