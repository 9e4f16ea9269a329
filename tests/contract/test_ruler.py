"""The house stays small: what the budget counts may fall, and never rises by itself."""

from __future__ import annotations

import ast

import pytest
from harness.ruler import BUDGET, helpers_of, load_budget, measure, statements_of

SLACK = 0.01
"""How far below its budget a count may be before the budget has to follow it."""


def flat(statements: dict[str, int], house: dict[str, int]) -> dict[str, int]:
    """Return all counts under one name each."""
    return {**{f"statements of {name}": n for name, n in statements.items()}, **house}


FOUND = flat(measure().statements, measure().house)
ALLOWED = flat(load_budget().statements, load_budget().house)


def test_every_count_has_a_budget() -> None:
    """A new package begins with one."""
    assert FOUND.keys() == ALLOWED.keys()


@pytest.mark.parametrize("name", FOUND)
def test_no_count_is_above_its_budget(name: str) -> None:
    """Who has to raise one names the feature that needs it, in the same commit."""
    assert FOUND[name] <= ALLOWED[name], f"{BUDGET.name}: {name}"


@pytest.mark.parametrize("name", FOUND)
def test_a_budget_follows_what_has_become_smaller(name: str) -> None:
    """What was gained is not spent again unseen."""
    assert ALLOWED[name] - FOUND[name] <= max(1, SLACK * ALLOWED[name]), f"{BUDGET.name}: {name}"


def test_the_ruler_counts_statements_and_small_helpers() -> None:
    """Neither imports nor docstrings; a helper that two places call, or that is long, is none."""
    text = '''
"""Module."""
import os
x = 1
"""Attribute."""
def _small(): return 2
def _twice(): return 3
def _long():
    """Docstring."""
    a = b = c = d = 1
    a += 1
    a += 2
    a += 3
    a += 4
    a += 5
    return a
def public(): return _small() + _twice() + _twice() + _long()
'''
    tree = ast.parse(text)
    assert helpers_of(tree) == ["_small"]
    assert len(list(statements_of(tree))) == 1 + 4 + 3 + 7
