"""The table of the second world, on literal results."""

from __future__ import annotations

import pytest

from bench import page
from bench.second_world.figure import Figure
from bench.second_world.table import what_if_table

FIGURES = (
    Figure("planted: zone", "", 0.0, 1, note="missed of 46", always=True),
    Figure("physics, ARTICLE", "x", 25.0, 42.1, at_least=True, note="median of 5"),
)
PART = {
    "part": "programs",
    "seconds": 60.4,
    "date": "2026-11-23",
    "commit": "abc1234",
    "machine": "a machine",
    "load_before": 0.12,
    "figures": [figure.record() for figure in FIGURES],
}


def test_what_does_not_hold_stands_out_and_each_part_says_where_it_was_measured() -> None:
    """A figure without its machine and commit says little."""
    lines = what_if_table([PART])
    assert "| planted: zone | **1** | ≤ 0 | **no** | missed of 46 |" in lines
    assert "| physics, ARTICLE | 42.1 x | ≥ 25 x | yes | median of 5 |" in lines
    assert any("abc1234" in line and "a machine, load before 0.1, 60 s" in line for line in lines)


def test_a_page_that_was_written_makes_no_other_commit(monkeypatch: pytest.MonkeyPatch) -> None:
    """A part that was measured before writes the page; other files that differ are told."""
    monkeypatch.setattr(page, "commit_of", lambda _: "abc1234+")
    monkeypatch.setattr(page, "changed_files", lambda root: {page.RESULTS, page.PAGE})
    assert page.commit() == "abc1234"
    monkeypatch.setattr(page, "changed_files", lambda root: {page.RESULTS, page.ROOT / "env.sh"})
    assert page.commit() == "abc1234+"
    monkeypatch.setattr(page, "commit_of", lambda _: "unknown")
    assert page.commit() == ""
