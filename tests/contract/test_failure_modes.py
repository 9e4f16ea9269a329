"""docs/failure_modes.md: each row names a test, and each test that is named exists."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from harness.sources import parsed
from harness.workspace import ROOT

TEXT = (ROOT / "docs" / "failure_modes.md").read_text(encoding="utf-8")
ROWS = [
    line
    for line in TEXT.splitlines()
    if line.startswith("| ") and not line.startswith(("| cause", "|---"))
]
NAMED = re.compile(r"`(tests/[\w/]+\.py)::(\w+)`")


def functions_of(file: str) -> set[str]:
    """Return the names of a file's functions."""
    path = ROOT / file
    if not path.is_file():
        return set()
    return {node.name for node in parsed(path).body if isinstance(node, ast.FunctionDef)}


def unproved(row: str) -> Iterator[str]:
    """Yield what a row lacks: a cell, a test, or the test that it names."""
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    if len(cells) != 4 or not all(cells):
        yield f"{cells[0]}: has no four cells: cause, what happens, what is seen, proved by"
        return
    named = NAMED.findall(cells[3])
    if not named:
        yield f"{cells[0]}: names no test"
    for file, name in named:
        if name not in functions_of(file):
            yield f"{cells[0]}: {file}::{name} is not there"


def test_every_row_names_tests_that_exist() -> None:
    """A promise without a test is a hope."""
    assert ROWS
    assert [text for row in ROWS for text in unproved(row)] == []


def test_every_test_of_the_fault_battery_is_in_a_row() -> None:
    """What is broken on purpose is described."""
    listed = {name for _, name in NAMED.findall(TEXT)}
    for file in sorted((ROOT / "tests" / "system" / "faults").glob("test_*.py")):
        functions = functions_of(str(file.relative_to(ROOT)))
        names = {name for name in functions if name.startswith("test_")}
        assert names <= listed, f"{file.name}: {sorted(names - listed)}"
