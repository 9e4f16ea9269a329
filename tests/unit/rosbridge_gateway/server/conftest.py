"""Gateways with a stand-in for the ROS graph."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import msgspec
import pytest
from harness.opponents.graph_and_clients import SHIPPED, Cell, MakeCell

PATIENT = {
    "port": 0,
    "driving": msgspec.structs.replace(SHIPPED.driving, ping_interval=60.0, ping_timeout=60.0),
    "handshake_timeout": 60.0,
}


@pytest.fixture
def make_cell() -> Iterator[MakeCell]:
    """Start gateways with changed settings."""
    cells: list[Cell] = []

    def make(limits: dict[str, Any] | None = None, **changes: Any) -> Cell:
        config = msgspec.structs.replace(SHIPPED, **{**PATIENT, **changes})
        config = msgspec.structs.replace(
            config, limits=msgspec.structs.replace(config.limits, **(limits or {}))
        )
        cells.append(Cell(config))
        cells[-1].server.start()
        return cells[-1]

    yield make
    for cell in cells:
        cell.close()


@pytest.fixture
def cell(make_cell: MakeCell) -> Cell:
    """Return a running gateway."""
    return make_cell()
