"""In a product by pairs each two values of two factors meet, in few rows."""

from __future__ import annotations

from itertools import combinations, product

import pytest
from harness.running.pairs import by_pairs, pairs


@pytest.mark.parametrize(
    ("factors", "at_most"),
    [
        (("ab", "cde"), 6),
        (("ab", "cd", "ef"), 5),
        (("ab", "cde", "fgh", "ij"), 11),
        (("abcd", "efgh", "ijkl", "mnop"), 24),
    ],
)
def test_each_two_values_meet(factors: tuple[str, ...], at_most: int) -> None:
    """The rows are a part of the full product, in its order."""
    rows = pairs(*factors)
    for one, other in combinations(range(len(factors)), 2):
        met = {(row[one], row[other]) for row in rows}
        assert met == set(product(factors[one], factors[other]))
    full = list(product(*factors))
    assert [full.index(row) for row in rows] == sorted({full.index(row) for row in rows})
    assert len(rows) <= at_most


def test_two_factors_are_their_product() -> None:
    """Nothing is left out where only two factors meet."""
    assert pairs("ab", "cd") == list(product("ab", "cd"))


def test_what_pairs_leave_out_is_played_by_a_thorough_run() -> None:
    """No row of the full product is lost."""
    rows = by_pairs("ab", "cd", "ef")
    assert [tuple(row.values) for row in rows] == list(product("ab", "cd", "ef"))
    each_time = [tuple(row.values) for row in rows if not row.marks]
    assert each_time == pairs("ab", "cd", "ef")
    assert {mark.name for row in rows for mark in row.marks} == {"thorough"}
