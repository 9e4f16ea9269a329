"""Whole cells. ``live_cell`` is one for all tests of a file that leave it running; the others start their own.

It ends with its file: two cells on one small machine would judge each other.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from harness.live_cell import LiveCell


@pytest.fixture(scope="module")
def live_cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveCell]:
    """Give a ready cell with a master of its own."""
    cell = LiveCell(tmp_path_factory.mktemp("live_cell"))
    try:
        cell.wait_ready(cell.start())
        yield cell
    finally:
        cell.close()


@pytest.fixture
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveCell]:
    """Give a cell that is not started yet."""
    made = LiveCell(tmp_path_factory.mktemp("cell"))
    yield made
    made.close()
