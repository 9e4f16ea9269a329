"""What all tests of other people's programs share: what they found goes onto the page."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.opponents.clients_page import write

Record = dict[tuple[str, str], dict[str, str | None]]


@pytest.fixture(scope="session")
def record() -> Iterator[Record]:
    """Collect what went wrong by check, for each client and version.

    With CELL_CLIENTS_PAGE (`./cell test --clients` sets it) the table of that page is written.
    """
    found: Record = {}
    yield found
    if found and (page := os.environ.get("CELL_CLIENTS_PAGE")):
        write(Path(page), found)
