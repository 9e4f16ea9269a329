"""docs/failure_modes.md: each row names a test, and each test that is named exists."""

from __future__ import annotations

import ast
import re

import pytest
from harness.workspace import ROOT

TEXT = (ROOT / "docs" / "failure_modes.md").read_text(encoding="utf-8")
ROWS = [line for line in TEXT.splitlines() if line.startswith("| ") and not line.startswith(("| cause", "|---"))]
NAMED = re.compile(r"`(tests/[\w/]+\.py)::(\w+)`")


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.split("|")[1].strip()[:60])
def test_every_row_names_tests_that_exist(row: str) -> None:
    """A promise without a test is a hope."""
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert len(cells) == 4 and all(cells), "cause, what happens, what the operator sees, proved by"
    named = NAMED.findall(cells[3])
    assert named
    for file, name in named:
        tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
        assert name in {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}, f"{file}::{name}"


def test_every_test_of_the_fault_battery_is_in_a_row() -> None:
    """What is broken on purpose is described."""
    listed = {name for _, name in NAMED.findall(TEXT)}
    for file in sorted((ROOT / "tests" / "system" / "faults").glob("test_*.py")):
        tree = ast.parse(file.read_text(encoding="utf-8"))
        names = {node.name for node in tree.body if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")}
        assert names <= listed, f"{file.name}: {sorted(names - listed)}"
