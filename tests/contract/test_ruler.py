"""The house stays small: what the budget counts may fall, and never rises by itself."""

from __future__ import annotations

import ast

import pytest
from harness.ruler import BUDGET, fragments, helpers_of, load_budget, measure, statements_of
from harness.sources import modules

SLACK = 0.01
"""How far below its budget a count may be before the budget has to follow it."""


REASONS = {
    "cell_recorder/config.py": "each package has its numbers under this name",
    "farm/__main__.py": "python -m farm: the one place that knows all tools of the farm",
    "rosbridge_gateway/wire/ros_encoders_node.py": "all that wire/ knows of ROS's classes",
    "scara_bringup/processes/master_node.py": "an executable has a module of its name",
    "scara_bringup/processes/own_line_io.py": "runs before anything else is loaded",
    "scara_config/text_enum.py": "goes with Python 3.10",
    "scara_control/errors.py": "what the other modules raise; none of them may be imported by it",
    "scara_description/write_inertia_node.py": "an executable has a module of its name",
    "scara_ros/diagnosis.py": "pure, for those that may not import the node's half",
    "scara_ros/pacing.py": "eight packages publish by it; no other module is about time",
    "twin_controller/core/state.py": "the five parts of the state on one page",
}
"""Why a module of fewer than 40 lines is no part of its neighbour."""


def flat(statements: dict[str, int], house: dict[str, int]) -> dict[str, int]:
    """Return all counts under one name each."""
    return {**{f"statements of {name}": n for name, n in statements.items()}, **house}


ALLOWED = flat(load_budget().statements, load_budget().house)


@pytest.fixture(scope="module")
def found() -> dict[str, int]:
    """Count once, where it is asked for: whoever only lists the tests waits for nothing."""
    return flat(measure().statements, measure().house)


def test_every_count_has_a_budget(found: dict[str, int]) -> None:
    """A new package begins with one."""
    assert found.keys() == ALLOWED.keys()


@pytest.mark.parametrize("name", ALLOWED)
def test_no_count_is_above_its_budget(found: dict[str, int], name: str) -> None:
    """Who has to raise one names the feature that needs it, in the same commit."""
    assert found[name] <= ALLOWED[name], f"{BUDGET.name}: {name}"


@pytest.mark.parametrize("name", ALLOWED)
def test_a_budget_follows_what_has_become_smaller(found: dict[str, int], name: str) -> None:
    """What was gained is not spent again unseen."""
    assert ALLOWED[name] - found[name] <= max(1, SLACK * ALLOWED[name]), f"{BUDGET.name}: {name}"


def test_a_fragment_has_a_reason() -> None:
    """What is short and has none belongs into the module that it is used by; none outlives it."""
    found = fragments([each.path for each in modules() if each.path.name != "__init__.py"])
    assert set(found) == set(REASONS)


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
