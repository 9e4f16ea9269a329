"""What all tests of other people's programs share: what they found goes onto the page."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from harness.clients.page import MODBUS, ROSBRIDGE, UPSTREAM, write

Record = dict[tuple[str, str], dict[str, str | None]]


def _collect(protocol: str) -> Iterator[Record]:
    """Collect; with CELL_CLIENTS_PAGE (`./cell test --clients` sets it) write the page's table."""
    found: Record = {}
    yield found
    if found and (page := os.environ.get("CELL_CLIENTS_PAGE")):
        write(Path(page), found, protocol)


@pytest.fixture(scope="session")
def record() -> Iterator[Record]:
    """Collect what went wrong by check, for each client of the gateway and version."""
    yield from _collect(ROSBRIDGE)


@pytest.fixture(scope="session")
def modbus_record() -> Iterator[Record]:
    """Collect likewise for clients of the robot."""
    yield from _collect(MODBUS)


@pytest.fixture(scope="session")
def upstream_record() -> Iterator[Record]:
    """Collect likewise for clients of the gateway at rosbridge_server."""
    yield from _collect(UPSTREAM)
