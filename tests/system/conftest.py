"""Whole cells. ``live_cell`` is one for all tests of a group that leave it running.

The others start their own. It ends with its group: two cells on one small machine would judge each
other. Which files are a group stands in tests/harness/running/lanes.py.
"""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from harness.live_cell import LiveCell
from harness.running.shared import GROUP


@pytest.fixture(scope="module")
def live_cell(tmp_path_factory: pytest.TempPathFactory) -> LiveCell:
    """Give a ready cell that its group shares."""
    made: LiveCell = GROUP.get(
        "live cell", lambda: LiveCell(tmp_path_factory.mktemp("live_cell")).ready()
    )
    return made


@pytest.fixture
def cell(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveCell]:
    """Give a cell that is not started yet."""
    made = LiveCell(tmp_path_factory.mktemp("cell"))
    yield made
    made.close()
