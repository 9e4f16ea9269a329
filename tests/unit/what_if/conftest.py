"""The world of a cell that was just started, for all tests of the second world."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from harness.yaml_files import CONFIG
from what_if.cell_files_io import resting_cell
from what_if.world import World


@pytest.fixture(scope="session")
def world() -> Iterator[World]:
    """The article's robot at home, nine parts on their stands."""
    with resting_cell(CONFIG) as (found, _):
        yield found
