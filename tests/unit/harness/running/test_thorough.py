"""Parameters that only a thorough run plays."""

from __future__ import annotations

import pytest
from harness.running.thorough import examples, thorough


def test_rows_are_marked_and_keep_their_values() -> None:
    """One value or several: as parametrize takes them."""
    one, several = thorough("a", ("b", 2))
    assert (one.values, several.values) == (("a",), ("b", 2))
    assert [tuple(row.marks) for row in (one, several)] == [(pytest.mark.thorough,)] * 2


@pytest.mark.parametrize(("search", "count"), [(False, 3), (True, 9)])
def test_a_search_draws_more_examples(
    monkeypatch: pytest.MonkeyPatch, search: bool, count: int
) -> None:
    """What a run each time draws fewer of is drawn in full by --thorough."""
    monkeypatch.setattr("harness.running.thorough.SEARCH", search)
    assert examples(3, 9) == count
